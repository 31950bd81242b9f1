# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Hostile recordings and scenarios, through the commands that read them."""

import contextlib
import copy
import functools
import io
import json
import math
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_blocks import EPOCH_NS, hostile_bytes, sane_block
from mcap.writer import CompressionType, Writer
from numpy.random import Generator, default_rng

from rotor_bringup.cli import app
from rotor_common.errors import RigError
from rotor_common.plain_data import dump_yaml
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE, to_cdr
from rotor_interfaces.topics import Topic
from rotor_interfaces.waveform import encode
from rotor_recording.reading import CONFIG_RECORD, Recording, config_record
from rotor_recording.recording import qos_profiles
from rotor_recording.replay import begin_ns, latched_before, offer_of, selected, timed
from rotor_rig.scenario_model import Scenario, load_scenario, shipped_scenarios

BLOCKS = 6
VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2**31, 2**63, 2**64, -(2**63), 10**40, 0.5, 1e-320, 1e300,
    math.inf,
    -math.inf, math.nan, '', '0', 'x', 'x' * 3000, '\x1b[31m', 'a\0b', '2024-01-01', '1_000', 'yes',
    '~', '/dev/zero', '..', [], [[]], {}, [None], {'': None}, {'a': {'b': []}}, [1, 'a', None],
)  # fmt: skip
SNIPPETS = (
    '2024-01-01', '!!python/object:os.system x', '!!binary x', '&a [*a, *a]', '*a', '<<: *a',
    '9' * 5000, '[' * 2000, '{' * 2000, '1e999', '\x00', '\t', '\ud7ff', ': ', '- ', '? ', '|\n',
    '---\n', '...\n', '%YAML 9.9\n', '!', '"\\UFFFFFFFF"', 'NaN', 'Infinity', '-0', '0x', '1:30',
)  # fmt: skip
DEFINITIONS = {
    'sensor_msgs/msg/PointCloud2': 'std_msgs/Header header',
    'std_msgs/msg/String': 'string data',
}


def changed(rng: Generator, data: Any) -> Any:
    """Return plain data with something else in a place of it."""
    place, key, holder = data, None, None
    for _ in range(rng.integers(0, 6)):
        if isinstance(place, dict) and place:
            holder, key = place, [*place][rng.integers(len(place))]
        elif isinstance(place, list) and place:
            holder, key = place, int(rng.integers(len(place)))
        else:
            break
        place = holder[key]
    value = copy.deepcopy(VALUES[rng.integers(len(VALUES))])
    if holder is None:
        return value if rng.integers(4) == 0 else data
    kind = rng.integers(4)
    if kind < 2:
        holder[key] = value
    elif kind == 2 and isinstance(holder, dict):
        del holder[key]
    elif isinstance(holder, dict):
        holder[str(VALUES[rng.integers(len(VALUES))])] = value
    else:
        holder.append(value)
    return data


def changed_text(rng: Generator, text: str) -> str:
    """Return a text that was cut, or into which something was put."""
    for _ in range(rng.integers(0, 4)):
        at = int(rng.integers(len(text) + 1))
        kind = rng.integers(4)
        if kind == 0:
            text = text[:at] + SNIPPETS[rng.integers(len(SNIPPETS))] + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + int(rng.integers(1, 20)) :]
        elif kind == 2:
            text = text[:at] + chr(int(rng.integers(1, 256))) + text[at + 1 :]
        elif text:
            end = at + int(rng.integers(1, 200))
            text = text[:end] + text[at:end] + text[end:]
    return text


def json_text(rng: Generator, data: Any) -> str:
    """Return a JSON text of changed data."""
    other = json.loads(json.dumps(data))
    for _ in range(rng.integers(1, 4)):
        other = changed(rng, other)
    return changed_text(rng, json.dumps(other)) if rng.integers(3) == 0 else json.dumps(other)


def spoilt(rng: Generator, data: bytes) -> bytes:
    """Return a file of which bytes have changed, at times."""
    found = bytearray(data)
    for _ in range(rng.integers(0, 6) if rng.integers(2) else 0):
        at = rng.integers(len(found))
        if rng.integers(4) == 0:
            found[at : at + 8] = int(rng.choice([0, 1, 2**31, 2**62])).to_bytes(8, 'little')
        else:
            found[at] = rng.integers(256)
    return bytes(found[: rng.integers(len(found))] if rng.integers(20) == 0 else found)


def command(*arguments: str, wanted: tuple[int, ...] = (0, 2)) -> None:
    """Run a command of `rotor-rig` in this process; raises what it lets through."""
    out, err = io.StringIO(), io.StringIO()
    code: Any = 0
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            app(list(arguments), prog_name='rotor-rig')
    except SystemExit as end:
        code = end.code
    if code not in wanted:
        raise AssertionError(f'{arguments} ended with exit code {code}: {err.getvalue()}')
    if '\x1b' in err.getvalue():
        raise AssertionError(f'{arguments} wrote control characters: {err.getvalue()!r}')


class Scenarios:
    """Scenario files through `scenario show` and `scenario check`."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix='rotor-rig-fuzz-')
        self._scenarios = [load_scenario(name).plain() for name in shipped_scenarios()]

    def start(self) -> None:
        """Keep nothing."""

    def feed(self, rng: Generator) -> None:
        """Check one file."""
        data = json.loads(json.dumps(self._scenarios[rng.integers(len(self._scenarios))]))
        for _ in range(rng.integers(0, 4)):
            data = changed(rng, data)
        try:
            text = dump_yaml(data)
        except (RigError, ValueError):
            text = json.dumps(data)
        file = Path(self._folder.name) / 'scenario.yaml'
        file.write_text(changed_text(rng, text), 'utf-8', errors='replace')
        command('scenario', ('show', 'check')[rng.integers(2)], str(file))


class Recordings:
    """Recordings through all commands that read them; of a replay, what needs no ROS."""

    suffix = '.mcap'

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix='rotor-rig-fuzz-')
        self._scenario: Scenario = load_scenario('level_healthy')
        whole = Path(self._folder.name) / f'whole{self.suffix}'
        whole.write_bytes(self._recording(default_rng(0)))
        for way in self._ways(str(whole), 0.0):
            way()  # imports and compiles, which is not the time of an input

    def start(self) -> None:
        """Keep nothing."""

    def feed(self, rng: Generator) -> None:
        """Read one recording in one way."""
        folder = Path(self._folder.name) / 'bag'
        folder.mkdir(exist_ok=True)
        for file in folder.iterdir():
            file.unlink()
        file = folder / f'run_0{self.suffix}'
        file.write_bytes(spoilt(rng, self._recording(rng)))
        path = str(file)
        if rng.integers(4) == 0:
            text = self._metadata(rng, file.name)
            (folder / 'metadata.yaml').write_text(text, 'utf-8', errors='replace')
            path = str(folder)
        self._read(rng, path)

    def _read(self, rng: Generator, path: str) -> None:
        start_s = float(rng.choice([0.0, 0.05, 1e9]))
        ways = self._ways(path, start_s)
        ways[rng.integers(len(ways))]()

    def _ways(self, path: str, _start_s: float) -> tuple[Callable[[], None], ...]:
        return (
            lambda: command('analyze', path, '--json'),
            lambda: command('analyze', path, '--out', f'{self._folder.name}/windows.csv'),
            lambda: command('analyze', path),
            lambda: command('view', path, '--save', f'{self._folder.name}/view.rrd'),
            lambda: command('scenario', 'show', path),
            lambda: command('baseline', path, '--json'),
            lambda: command('verify', path, wanted=(0, 1, 2)),
            lambda: self._recover(path),
            lambda: _plan_replay(Path(path), _start_s),
        )

    def _recover(self, path: str) -> None:
        out = Path(self._folder.name) / 'recovered'
        shutil.rmtree(out, ignore_errors=True)
        command('recover', path, '--out', str(out), wanted=(0, 1, 2))
        if out.exists():
            command('verify', str(out), wanted=(0, 1))

    def _recording(self, rng: Generator) -> bytes:
        out = io.BytesIO()
        compression = CompressionType.ZSTD if rng.integers(2) else CompressionType.NONE
        writer = Writer(out, chunk_size=20_000, compression=compression)
        writer.start('', 'fuzz')
        config = {'scenario': self._scenario.plain(), 'column_units': {'disk_y': 'm'}}
        text = json_text(rng, config)
        if rng.integers(2):
            record = config_record(text) if rng.integers(4) else {'json': text, 'crc32': 'x'}
            writer.add_metadata(CONFIG_RECORD, record)
        channels: dict[Topic, int] = {}
        for topic, data in self._messages(rng, text):
            if topic not in channels:
                channels[topic] = self._channel(rng, writer, topic)
            stamp = EPOCH_NS + int(rng.integers(10**9))
            if rng.integers(50) == 0:
                stamp = int(rng.choice(np.array([0, 1, 2**63, 2**64 - 1], np.uint64)))
            writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()
        return out.getvalue()

    def _messages(self, rng: Generator, text: str) -> list[tuple[Topic, bytes]]:
        found = [(topics.CONFIG, to_cdr(messages.string(OFFLINE, text)))]
        hostile = rng.integers(BLOCKS)
        for number in range(BLOCKS):
            block = sane_block(number * 512)
            bad = number == hostile and rng.integers(2)
            wire = hostile_bytes(rng, number * 512) if bad else to_cdr(encode(block, OFFLINE))
            found.append((topics.WAVEFORM, wire))
            load = messages.load(OFFLINE, block.stamp_ns, *rng.choice([9.81, math.inf, 1e300], 2))
            found.append((topics.MANEUVER_LOAD, to_cdr(load)))
            names = ['speed_rad_s', str(rng.choice(['disk_y/rms', '', '\x1b', 'crack_ratio']))]
            said = messages.joint_state(
                OFFLINE, block.stamp_ns, 'rotor', names, rng.choice([0.0, 1e300, math.nan], 2)
            )
            if rng.integers(3) == 0:
                found.append((topics.INDICATORS, to_cdr(said)))
            found.append((topics.TRUTH, to_cdr(said)))
            alarm = messages.diagnostics(
                OFFLINE,
                block.stamp_ns,
                'x',
                level=int(rng.integers(-128, 128)),
                text='y',
                values={},
            )
            found.append((topics.ALARM, to_cdr(alarm)))
        return [
            (topic, data[: rng.integers(len(data))] if rng.integers(60) == 0 else data)
            for topic, data in found
        ]

    def _channel(self, rng: Generator, writer: Writer, topic: Topic) -> int:
        kind, encoding, name = topic.type, 'cdr', f'/{topic.name.lstrip("/")}'
        qos = dump_yaml(qos_profiles(topic))
        if rng.integers(8) == 0:
            kind = str(rng.choice(['std_msgs/msg/String', 'sensor_msgs/msg/Imu', '', 'x/y', 'ü']))
        if rng.integers(20) == 0:
            encoding = str(rng.choice(['json', '', 'CDR', 'ros1']))
        if rng.integers(20) == 0:
            name = str(rng.choice(['', '/', '/a/rotor/waveform', '\x1b[31m', '/rotor/waveform']))
        if rng.integers(4) == 0:
            qos = changed_text(rng, qos)
        schema = writer.register_schema(
            kind, 'ros2msg', DEFINITIONS.get(topic.type, 'int32 x').encode()
        )
        return writer.register_channel(name, encoding, schema, {'offered_qos_profiles': qos})

    def _metadata(self, rng: Generator, name: str) -> str:
        data: Any = {
            'rosbag2_bagfile_information': {
                'version': 9,
                'relative_file_paths': [name],
                'compression_format': '',
                'compression_mode': '',
                'topics_with_message_count': [],
            }
        }
        for _ in range(rng.integers(0, 3)):
            data = changed(rng, data)
        try:
            return changed_text(rng, dump_yaml(data))
        except (RigError, ValueError):
            return json.dumps(data)


class Repeats(Recordings):
    """Recordings whose run is made again by `simulate`, for a moment of it."""

    def __init__(self) -> None:
        super().__init__()
        self._repeat('level_healthy', '0.1')  # compiles, which is not the time of an input

    def _ways(self, path: str, _start_s: float) -> tuple[Callable[[], None], ...]:
        return tuple(functools.partial(self._repeat, path, s) for s in ('0.001', '0.03', '0.1'))

    def _repeat(self, path: str, length_s: str) -> None:
        out = Path(self._folder.name) / 'again.mcap'
        out.unlink(missing_ok=True)
        command('simulate', path, '--out', str(out), '--duration', length_s, '--json')


def _plan_replay(path: Path, start_s: float) -> None:
    """Do all of a replay that needs no ROS."""
    try:
        recording = Recording(path)
        connections = selected(recording, ())
        for connection in connections.values():
            offer_of(connection)
        begin = begin_ns(recording, start_s, connections)
        latched_before(recording, connections, begin)
        for _ in timed(recording.messages(connections, begin), begin, []):
            pass
    except RigError:
        return
