# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Node `rotor_sim`: integrates the next block once the load grid and the credits reach it.

Thin adapter around `RotorSimulator`: it feeds the grid in, publishes what comes out, and keeps
the three rules of the co-simulation: never past the grid, never more than a window ahead of the
slowest registered consumer (accelerated runs), never ahead of the wall clock (paced runs).
"""

import sys
import time
from typing import Any

from rotor_common.constants import LOAD_RATE_HZ, LOAD_STEP_NS
from rotor_common.errors import ConfigError, DataError
from rotor_common.plain_data import parse_json
from rotor_interfaces import messages, ros, topics
from rotor_interfaces.credit import Credits
from rotor_interfaces.messages import ROS, sample_stamp_ns
from rotor_interfaces.ros import Node
from rotor_interfaces.run_topics import RUN_ID, OtherRigs, Progress, RunTopics
from rotor_interfaces.topics import Topic
from rotor_sim.errors import CosimulationError, LoadConflictError, RotorError
from rotor_sim.messages import block_messages, config_message
from rotor_sim.plant.parameters import OF_THE_VARIANT
from rotor_sim.rotor_config import RotorSimConfig
from rotor_sim.sensors.sensor_config import NoiseLevels
from rotor_sim.stream.load_grid import LoadGrid
from rotor_sim.stream.simulator import RotorSimulator

TICK_S = 0.002
ASK_AGAIN_S = 1.0
"""A run that waits this long for a load asks for it again; DDS would resend a lost one sooner."""
BLOCKS_PER_TICK = 8
"""Few, so that incoming credits are handled between two ticks."""


class RotorSimNode(Node):  # type: ignore[misc]
    """Publishes the sensors and the ground truth of one run."""

    def __init__(self) -> None:
        super().__init__('rotor_sim')
        text = ros.declare(
            self, 'config', '', 'rotor part of a scenario as JSON; empty: the defaults'
        )
        self._scenario = _json(
            ros.declare(self, 'scenario', '{}', 'the whole scenario as JSON, for rotor/config')
        )
        self._versions = _json(ros.declare(self, 'versions', '{}', 'versions as JSON'))
        duration_s = ros.declare(self, 'duration_s', 20.0, 'length of the run [s]')
        self._rate: float = ros.declare(
            self, 'rate', 1.0, 'multiple of real time; 0: as fast as the consumers keep up'
        )
        consumers = ros.declare(self, 'consumers', [''], 'names on rig/progress that must keep up')
        self._window_blocks = ros.declare(
            self, 'window_blocks', 64, 'blocks ahead of the slowest consumer at other rates than 1'
        )
        self._timeout_s = ros.declare(
            self, 'timeout_s', 10.0, 'a stall of this length ends the run [s]; start-up: 3 times'
        )
        self._run = RunTopics(self, ros.declare(self, 'run_id', '', RUN_ID))
        config = self._declare_config(self._with_preset(RotorSimConfig.from_json(text or '{}')))
        self._check(duration_s)
        self._config = config
        self._end_sample = round(duration_s * config.rate_hz)
        self._simulator = RotorSimulator(config)
        self._simulator.compile()
        self._grid = LoadGrid()
        self._epoch_ns = -1  # the stamp of the first load
        self._credits = Credits(filter(None, consumers))
        self._sent_ns = 0  # the end of the newest block published
        self._state = self._wait_for_consumers
        self._state_since = time.monotonic()
        self._early_loads = 0
        self._asked_again = 0
        self._asked_at = 0.0
        self._refused_loads = 0
        self._overruns = 0
        self._stalls = 0
        self._stalled = False
        self._last_diagnostic_s = -1
        self._started = 0.0
        self._changes = [change.model_dump() for change in config.changes]

        published = [topics.WAVEFORM, topics.SHAFT, topics.TRUTH, topics.CONFIG, topics.CLOCK]
        published += [topics.DIAGNOSTICS]
        if config.sensors.truth_waveform:
            published.append(topics.TRUTH_WAVEFORM)
        if config.sensors.imu_rate_hz:
            published += [topics.BEARING_1_IMU, topics.BEARING_2_IMU]
        self._publishers_of = {topic: self._run.publisher(topic) for topic in published}
        self._progress = Progress(self._run, 'rotor_sim')
        self._load = self._run.subscription(topics.MANEUVER_LOAD, self._on_load)
        self._run.subscription(topics.PROGRESS, self._on_progress)
        self._other_rigs = OtherRigs(self, self._run)
        ros.accept_changes(self, {name: self._setter(name) for name in RotorSimulator.SETTABLE})
        self._publish_config()
        ros.timer(self, TICK_S, self._tick)

    def _with_preset(self, base: RotorSimConfig) -> RotorSimConfig:
        """Return the configuration with the preset that the node's parameter names."""
        preset = ros.declare(
            self, 'sensors.preset', base.sensors.preset, 'class of sensors; see docs/sensors.md'
        )
        if preset == base.sensors.preset:
            return base
        sensors = base.sensors.with_preset(preset).model_dump(mode='json')
        return RotorSimConfig.from_mapping({**base.model_dump(mode='json'), 'sensors': sensors})

    def _declare_config(self, base: RotorSimConfig) -> RotorSimConfig:
        """Declare every scalar of the configuration; live parameters have their own names."""
        live = ros.declare_model(self, base.live_parameters(), settable=RotorSimulator.SETTABLE)
        noise = {name: getattr(live, name) for name in NoiseLevels.model_fields}
        config = ros.declare_model(
            self,
            base,
            skip={
                'rotor.crack_stiffness_ratio',
                *(f'rotor.{name}' for name in OF_THE_VARIANT),
                'speed.initial_rad_s',
                'sensors.preset',
                *(f'sensors.{name}' for name in noise),
            },
        )
        plain = config.model_dump(mode='json')
        plain['rotor']['crack_stiffness_ratio'] = live.crack_stiffness_ratio
        plain['speed']['initial_rad_s'] = live.speed_target_rad_s
        plain['sensors'] |= noise
        return RotorSimConfig.from_mapping(plain)

    def _check(self, duration_s: float) -> None:
        if not 0.0 < duration_s <= 1e6:
            raise ConfigError(f'duration_s = {duration_s:g} is out of range; allowed: up to 1e6 s')
        if not 0.0 <= self._rate <= 1000.0:
            raise ConfigError(f'rate = {self._rate:g} is out of range; allowed: 0 to 1000')
        if self._window_blocks < 1:
            raise ConfigError(f'window_blocks = {self._window_blocks} must be at least 1')

    def _setter(self, name: str) -> Any:
        def apply(value: float) -> None:
            sample = self._simulator.set_parameter(name, value)
            self._changes.append({'sample': sample, 'parameter': name, 'value': float(value)})
            self._publish_config()

        return apply

    def _publish_config(self) -> None:
        # the configuration in force, parameter overrides included
        scenario = {
            **self._scenario,
            **self._config.model_dump(mode='json'),
            'duration_s': self._end_sample / self._config.rate_hz,
            'changes': self._changes,
        }
        self._publishers_of[topics.CONFIG].publish(
            config_message(ROS, scenario, self._versions, self._config.sensors.column_units),
            inside=self._state == self._wait_for_consumers,
        )

    # -- incoming ---------------------------------------------------------------------------

    def _on_load(self, message: Any) -> None:
        if message.header.frame_id != topics.ROTOR_FRAME:
            self._refuse(f'frame_id {message.header.frame_id!r}, wanted {topics.ROTOR_FRAME!r}')
            return
        if self._load.get_publisher_count() > 1:
            self._refuse('another source publishes it too, and nobody can tell which is right')
            return
        stamp_ns = messages.stamp_ns(message)
        if self._epoch_ns < 0:
            self._epoch_ns = stamp_ns
        k, remainder = divmod(stamp_ns - self._epoch_ns, LOAD_STEP_NS)
        if remainder or k < 0:
            self._refuse(f'stamp {stamp_ns} ns is not on the 10 ms grid of this run')
            return
        self._early_loads += k > self._grid.next_index
        try:
            self._grid.take(k, message.accel.linear.y, message.accel.linear.z)
        except LoadConflictError as error:
            raise CosimulationError(f'the run cannot go on: {error}') from None
        except RotorError as error:
            self._refuse(str(error))

    def _refuse(self, reason: str) -> None:
        self._refused_loads += 1
        self.get_logger().error(f'maneuver/load refused: {reason}', throttle_duration_sec=1.0)

    def _on_progress(self, message: Any) -> None:
        self._credits.take(message.frame_id, messages.stamp_ns(message), self._sent_ns)

    # -- the run ----------------------------------------------------------------------------

    def _tick(self) -> None:
        self._state()

    def _enter(self, state: Any) -> None:
        self._state = state
        self._state_since = time.monotonic()

    def _age_s(self) -> float:
        return time.monotonic() - self._state_since

    def _wait_for_consumers(self) -> None:
        """Report ready once every node that needs time 0 has reported and is connected."""
        missing = [f'no report from {name}' for name in self._credits.behind(0)]
        missing += [
            f'nobody listens to {topic.name}'
            for topic, publisher in self._publishers_of.items()
            if publisher.get_subscription_count() < self._expected_subscribers(topic)
        ]
        # DDS lists a killed rig for a while, so the node waits for other rigs to disappear
        others = self._other_rigs.obstacles()
        if self._other_rigs.stay():
            raise CosimulationError(f'the run cannot start: {others[0]}')
        if not (missing or others):
            self._enter(self._wait_for_load)
            self._publishers_of[topics.CONFIG].publish_outside()
            self._other_rigs.begin()
            self._progress.report(0)
        elif self._age_s() > 3 * self._timeout_s:
            raise CosimulationError(f'the run cannot start: {"; ".join(missing + others)}')

    def _expected_subscribers(self, topic: Topic) -> int:
        """Every consumer subscribes to the waveform, at least the recorder to other topics."""
        return len(self._credits) if topic is topics.WAVEFORM else min(len(self._credits), 1)

    def _wait_for_load(self) -> None:
        """Let the start-up settle under the initial load as soon as it is known."""
        if self._grid.next_index:
            self._simulator.prepare(self._grid)
            self._started = time.monotonic()
            self._enter(self._advance)
        elif self._age_s() > 3 * self._timeout_s:
            raise CosimulationError('the run cannot start: no maneuver/load')
        elif self._age_s() > self._timeout_s:  # the generator may have started later
            self._ask_again()

    def _advance(self) -> None:
        for _ in range(BLOCKS_PER_TICK):
            first = self._simulator.next_sample
            count = min(self._config.block_samples, self._end_sample - first)
            if count <= 0:
                self._enter(self._drain)
                return
            if not self._is_due(first + count):
                return
            if missing := self._missing_load(first + count):
                self._stall(missing)
                self._ask_again()
                return
            if slow := self._slow_consumer(first):
                self._stall(slow)
                return
            self._stalled = False
            self._publish_block(count)

    def _is_due(self, end_sample: int) -> bool:
        """Paced runs publish a block when its last sample would have been measured."""
        if not self._rate:
            return True
        late_s = time.monotonic() - self._started - end_sample / (self._config.rate_hz * self._rate)
        block_s = self._config.block_samples / (self._config.rate_hz * self._rate)
        if late_s > block_s and not self._stalled:
            self._overruns += 1
        return late_s >= 0.0

    def _missing_load(self, end_sample: int) -> str:
        """Return which load the next block must wait for, '' if none is missing."""
        if self._grid.covers(end_sample, self._config.rate_hz):
            return ''
        if self._load.get_publisher_count() > 1:
            return 'another source publishes maneuver/load'
        early = self._grid.early
        hole = f' ({early} later points came: there is a hole)' if early else ''
        return f'maneuver/load ends before point {self._grid.next_index}{hole}'

    def _slow_consumer(self, first: int) -> str:
        """Return which consumer the next block must wait for, '' if none is too far behind."""
        limit = first - self._window_blocks * self._config.block_samples
        has_limit = self._rate != 1.0 and limit >= 0
        slow = self._credits.behind(self._stamp(limit)) if has_limit else []
        return f'{slow[0]} is {self._window_blocks} blocks behind' if slow else ''

    def _stall(self, reason: str) -> None:
        if not self._stalled:
            self._stalled = True
            self._stalls += 1
            self._state_since = time.monotonic()
        if self._age_s() > self._timeout_s:
            first = self._simulator.next_sample / self._config.rate_hz
            raise CosimulationError(
                f'the run stalled at {first:.3f} s for {self._timeout_s:g} s: {reason}'
            )

    def _ask_again(self) -> None:
        """Subscribe to the load again each second: it is latched, so lost points are resent."""
        now = time.monotonic()
        is_early = now - max(self._state_since, self._asked_at) < ASK_AGAIN_S
        # not connected yet: nothing is lost; two sources: the load would be refused
        if is_early or self._load.get_publisher_count() != 1:
            return
        self._asked_at = now
        self._asked_again += 1
        self.destroy_subscription(self._load)
        self._load = self._run.subscription(topics.MANEUVER_LOAD, self._on_load)

    def _publish_block(self, count: int) -> None:
        block = self._simulator.advance(count, self._grid)
        self._grid.discard_before(block.first_sample * LOAD_RATE_HZ // self._config.rate_hz)
        for topic, _, message in block_messages(ROS, self._config, self._epoch_ns, block):
            self._publishers_of[topic].publish(message)
        end_ns = self._sent_ns = self._stamp(block.first_sample + count)
        self._publishers_of[topics.CLOCK].publish(messages.clock(ROS, end_ns))
        self._progress.report(end_ns)
        self._diagnose(block.first_sample + count, end_ns)

    def _diagnose(self, end_sample: int, end_ns: int) -> None:
        """Publish /diagnostics once a second of simulated time."""
        seconds = end_sample // self._config.rate_hz
        if seconds == self._last_diagnostic_s:
            return
        self._last_diagnostic_s = seconds
        simulated_s = end_sample / self._config.rate_hz
        elapsed_s = max(time.monotonic() - self._started, 1e-9)
        bad = self._refused_loads + self._credits.refused + self._asked_again + self._overruns
        text = 'load or progress refused, load asked for again, or late blocks' if bad else ''
        text = self._other_rigs.text() or text
        self._publishers_of[topics.DIAGNOSTICS].publish(
            messages.diagnostics(
                ROS,
                end_ns,
                'rotor_sim: co-simulation',
                level=1 if text else 0,
                text=text or 'on time',
                values={
                    'simulated time [s]': f'{simulated_s:.3f}',
                    'real-time factor [1]': f'{simulated_s / elapsed_s:.3f}',
                    'late blocks [1]': self._overruns,
                    'stalls [1]': self._stalls,
                    'early load points [1]': self._early_loads,
                    'load asked for again [1]': self._asked_again,
                    'refused loads [1]': self._refused_loads,
                    'refused progress [1]': self._credits.refused,
                    'topics with another source': ', '.join(self._other_rigs.topics),
                    'process time [s]': f'{time.process_time():.3f}',
                },
            )
        )

    def _drain(self) -> None:
        """Wait until every consumer has taken the last block."""
        count = (self._end_sample - 1) % self._config.block_samples + 1
        last_ns = self._stamp(self._end_sample - count)
        if not (behind := self._credits.behind(last_ns)):
            self._enter(self._idle)
        elif self._age_s() > self._timeout_s:
            raise CosimulationError(f'{" and ".join(behind)} did not take the last block')

    def _idle(self) -> None:
        pass

    def _stamp(self, sample: int) -> int:
        return sample_stamp_ns(self._epoch_ns, sample, self._config.rate_hz)

    def is_done(self) -> bool:
        """Say whether the last block has been taken by every consumer."""
        return self._state == self._idle

    def finish(self) -> None:
        """Wait until what was published has been acknowledged."""
        self._run.wait_until_acknowledged()


def _json(text: str) -> dict[str, Any]:
    try:
        data = parse_json(text)
    except DataError as error:
        raise ConfigError(f'a parameter is not valid JSON: {error}') from None
    if not isinstance(data, dict):
        raise ConfigError(f'a parameter must hold a JSON object, not {text[:40]!r}')
    return data


def main(args: list[str] | None = None) -> int:
    """Run the node until the run is over or a signal comes; return the exit code."""
    return ros.run(lambda: [RotorSimNode()], args, has_end=True)


if __name__ == '__main__':
    sys.exit(main())
