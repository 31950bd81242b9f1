# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the reliability run that fly: an hour, kills, signals, two rigs, sockets."""

import ipaddress
import json
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import psutil  # type: ignore[import-untyped]
from live_flight import CLI, NODES, LiveFlight, private_environment, running

from rotor_common.exit_code import ExitCode
from rotor_interfaces import topics
from rotor_recording.reading import Recording, waveform_blocks
from rotor_recording.recovery import recover
from rotor_recording.verification import is_good, verify

MIB = 2**20
MOST_GROWTH_MIB = 24.0
"""In an hour: the recorder keeps an index of the chunks that it has written."""
MOST_LOST_S = 0.3
"""A quarter of a second and one block, and 25 ms for a busy machine."""
MOST_MIB = 300
"""Of a command that reads a recording, whatever its length."""
SETTLED_S = 60.0
"""After this much of a long flight, what a process holds must stay."""


class BrokenPromise(Exception):  # noqa: N818 - it is the finding
    """What was promised did not hold; the text says where, `figures` are those there are."""

    def __init__(self, text: str, figures: dict[str, Any] | None = None) -> None:
        super().__init__(text)
        self.figures = figures or {}


def hold(promise: object, otherwise: str) -> None:
    """Raise BrokenPromise unless the promise holds."""
    if not promise:
        raise BrokenPromise(otherwise)


# --- an hour -------------------------------------------------------------------------------------


def hour(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Fly an hour of wall time; watch memory, handles and threads, then use the recording."""
    length_s = 20 if quick else 3600
    flight = LiveFlight(folder, 'climb_dive', '--duration', str(length_s), '--json')
    samples: dict[str, list[tuple[float, int, int, int]]] = {}
    try:
        flight.wait_until_recording()
        processes = {name: psutil.Process(pid) for name, pid in flight.nodes().items()}
        processes['rotor-rig'] = psutil.Process(flight.process.pid)
        began = time.monotonic()
        while flight.process.poll() is None:
            for name, process in processes.items():
                try:
                    with process.oneshot():
                        held = (process.memory_info().rss, process.num_fds(), process.num_threads())
                except psutil.Error:
                    continue
                samples.setdefault(name, []).append((time.monotonic() - began, *held))
            time.sleep(1.0 if quick else 5.0)
        code, said = flight.finish()
    finally:
        flight.close()
    hold(code == 0, f'exit code {code}: {said[-500:]}')
    summary = json.loads(said[said.index('{') :].rpartition('}')[0] + '}')
    hold(summary['lost_samples'] == 0, f'{summary["lost_samples"]} samples were lost')
    found: dict[str, Any] = {
        'length [s]': length_s,
        'real-time factor': round(summary['real_time_factor'], 4),
        'lost samples': summary['lost_samples'],
        'late blocks': summary['late_blocks'],
    }
    broken: list[str] = []
    for name, rows in sorted(samples.items()):
        found |= _held(name, rows, 5.0 if quick else SETTLED_S, broken)
    recording = Path(summary['recording'])
    found['recording [MiB]'] = round(sum(p.stat().st_size for p in recording.iterdir()) / MIB)
    found |= _latency(Recording(recording))
    found |= _read_long(recording, length_s, broken)
    if broken:
        raise BrokenPromise('; '.join(broken), found)
    return found


def _held(
    name: str, rows: list[tuple[float, int, int, int]], settled_s: float, broken: list[str]
) -> dict[str, Any]:
    """Return what a process held once it had settled, at first and at last."""
    hold(len(rows) > 5 and rows[-1][0] > settled_s, f'{name} was not watched')
    settled = np.array([row[1:] for row in rows if row[0] >= settled_s], dtype=np.int64)
    tenth = max(len(settled) // 10, 1)
    before, after = (np.median(part, axis=0) for part in (settled[:tenth], settled[-tenth:]))
    growth_mib = (after[0] - before[0]) / MIB
    if growth_mib > MOST_GROWTH_MIB:
        broken.append(f'{name} grew by {growth_mib:.0f} MiB')
    if after[1] > before[1] + 2 or after[2] > before[2]:
        broken.append(f'{name} holds more files or threads')
    return {
        f'{name}: memory, first and last tenth [MiB]': [
            round(before[0] / MIB), round(after[0] / MIB)
        ],
        f'{name}: open files, first and last tenth': [int(before[1]), int(after[1])],
        f'{name}: threads, first and last tenth': [int(before[2]), int(after[2])],
    }  # fmt: skip


def _latency(recording: Recording) -> dict[str, Any]:
    """Return the wall time from a window's last block to its indicators, at the recorder."""
    names = [recording.find(topic) or '' for topic in (topics.WAVEFORM, topics.INDICATORS)]
    times = {name: [(m.log_time_ns, m.publish_time_ns) for m in recording.messages([name])]
             for name in names}  # fmt: skip
    blocks, windows = (np.array(times[name], dtype=np.int64) for name in names)
    last = np.maximum(np.searchsorted(blocks[:, 0], windows[:, 0], 'right') - 1, 0)
    last = np.minimum(last + 1, np.searchsorted(blocks[:, 1], windows[:, 1], 'right') - 1)
    latency_ms = (windows[:, 1] - blocks[last, 1]) * 1e-6
    third = len(latency_ms) // 3
    return {
        'windows': len(windows),
        'block to indicators, first third, p50 and p99 [ms]': _percentiles(latency_ms[:third]),
        'block to indicators, last third, p50 and p99 [ms]': _percentiles(latency_ms[-third:]),
    }


def _percentiles(values: Any) -> list[float]:
    return [round(float(value), 2) for value in np.percentile(values, [50, 99])]


PEAK = """
import resource, subprocess, sys
done = subprocess.run(sys.argv[1:], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(done.returncode)
"""
"""Between us and the command: a process begins with the peak of the one that starts it."""


def _read_long(recording: Path, length_s: float, broken: list[str]) -> dict[str, Any]:
    """Return time and memory of the commands that read the recording."""
    found: dict[str, Any] = {}
    last_s = 5.0
    for name, words in {
        'verify': ['verify', recording],
        'analyze': ['analyze', recording, '--json', '--out', recording.parent / 'windows.json'],
        'view --save': ['view', recording, '--save', recording.parent / 'view.rrd'],
        f'replay --start {length_s - last_s:g}': [
            'replay', recording, '--start', f'{length_s - last_s:g}'
        ],
    }.items():  # fmt: skip
        began = time.monotonic()
        done = subprocess.run(
            [sys.executable, '-S', '-c', PEAK, *CLI, *map(str, words)],
            env=private_environment(recording.parent / 'log'),
            capture_output=True,
            text=True,
            check=False,
        )
        taken_s = time.monotonic() - began
        hold(done.returncode == 0, f'{name}: {done.stderr[-500:]}')
        most_mib = round(int(done.stdout) / 1024)
        found[f'{name}: time [s], most memory [MiB]'] = [round(taken_s, 1), most_mib]
        if most_mib > MOST_MIB:
            broken.append(f'{name} took {most_mib} MiB')
    return found


# --- kills ---------------------------------------------------------------------------------------


LISTEN = """
import sys, time
import rclpy
from rotor_interfaces import messages, ros, topics

def heard(message):
    sys.stdout.write(f'[{time.time_ns()}, {messages.stamp_ns(message)}]\\n')

rclpy.init()
node = ros.Node('listener')
ros.subscription(node, topics.WAVEFORM, heard)
try:
    rclpy.spin(node)
except KeyboardInterrupt:
    pass
"""
"""Prints when a block was heard, and its stamp."""


def kills(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Kill the recorder at a random time; count what another subscriber had and its file lacks."""
    lost_s, scenarios = [], 2 if quick else 100
    for number in range(scenarios):
        flight = LiveFlight(folder / str(number), 'climb_dive', '--duration', '60')
        listener = subprocess.Popen(
            [sys.executable, '-c', LISTEN],
            env=flight.environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            flight.wait_until_recording(0.5)
            time.sleep(random.uniform(0.0, 2.0))
            pids = flight.nodes()
            psutil.Process(pids['recorder']).kill()
            killed_ns = time.time_ns()
            code, said = flight.finish()
            listener.send_signal(signal.SIGINT)
            heard = [json.loads(line) for line in listener.communicate()[0].splitlines()]
        finally:
            flight.close()
            listener.kill()
        hold(code == ExitCode.PROCESS_FAILED, f'kill {number}: exit code {code}')
        hold('Traceback' not in said, f'kill {number}: {said[-500:]}')
        hold(not (left := running(pids)), f'kill {number}: {left} still run')
        bag = flight.bag()
        blocks = list(waveform_blocks(Recording(bag)))
        published = max(stamp_ns for received_ns, stamp_ns in heard if received_ns < killed_ns)
        lost_s.append(max(published - blocks[-1].stamp_ns, 0) * 1e-9)
        indices = np.concatenate([block.rows['sample'] for block in blocks])
        hold(np.all(np.diff(indices) == 1), f'kill {number}: the samples have a hole')
        whole = folder / f'{number}-recovered'
        recover(bag, whole)
        hold(is_good(verify(whole)), f'kill {number}: the recovered file is not whole')
        shutil.rmtree(folder / str(number))
    hold(max(lost_s) < (0.5 if quick else MOST_LOST_S), f'{max(lost_s):.2f} s were lost')
    return {
        'kills': scenarios,
        'files read and recovered': len(lost_s),
        'lost of what others had heard by then, median [s]': round(float(np.median(lost_s)), 3),
        'lost of what others had heard by then, most [s]': round(max(lost_s), 3),
    }


# --- signals -------------------------------------------------------------------------------------

SIGNALS = ('SIGINT', 'SIGTERM', 'SIGHUP', 'SIGQUIT', 'SIGABRT', 'SIGSEGV', 'SIGKILL', 'SIGSTOP')


def signals(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Send each signal to each process; SIGSTOP is followed by SIGCONT two seconds later."""
    names = ('rotor-rig', *NODES)
    pairs = [(name, number) for name in names for number in SIGNALS]
    table: dict[str, dict[str, str]] = {name: {} for name in names}
    for name, number in pairs[:: 13 if quick else 1]:
        length_s = '12' if number == 'SIGSTOP' else '60'
        flight = LiveFlight(folder / f'{name}-{number}', 'climb_dive', '--duration', length_s)
        try:
            flight.wait_until_recording(1.0)
            pids = flight.nodes()
            process = psutil.Process(pids.get(name, flight.process.pid))
            process.send_signal(getattr(signal, number))
            if number == 'SIGSTOP':
                time.sleep(2.0)
                process.send_signal(signal.SIGCONT)
            code, said = flight.finish()
        finally:
            flight.close()
        what = f'{number} to {name}'
        hold((code == 0) is (number == 'SIGSTOP'), f'{what}: exit code {code}')
        hold('Traceback' not in said, f'{what}: {said[-500:]}')
        hold(not (left := running(pids)), f'{what}: {left} still run')
        recording = Recording(flight.bag())
        rows = sum(len(block.rows) for block in waveform_blocks(recording))
        hold(rows > 10_000, f'{what}: only {rows} samples were recorded')
        state = 'file closed' if (flight.bag() / 'metadata.yaml').exists() else 'file readable'
        table[name][number] = f'exit {code}, {state}'
        shutil.rmtree(folder / f'{name}-{number}')
    return {'outcome': table}


# --- two rigs ------------------------------------------------------------------------------------


def two_rigs(folder: Path, *, quick: bool) -> dict[str, Any]:
    """Start a second rig in the same domain at 30 offsets; neither may enter the other's flight."""
    alone = {}
    lengths_s = {'climb_dive': 6, 'level_healthy': 3}
    for name, length_s in lengths_s.items():
        alone[name] = waveform_bytes(Recording(simulated(folder, name, str(length_s))))
    offsets_s = np.linspace(0.0, 14.5, 2 if quick else 30).tolist()
    refused = flown = 0
    for number, offset_s in enumerate(offsets_s):
        environment = private_environment(folder / 'log')
        with ExitStack() as stack:
            flights = {}
            for name, length_s in lengths_s.items():
                place = folder / f'{number}-{name}'
                words = (name, '--duration', str(length_s), '--json')
                flight = LiveFlight(place, *words, environment=environment)
                flights[name] = stack.enter_context(flight)
                if len(flights) == 1:
                    time.sleep(offset_s)
            ended = {name: flight.finish() for name, flight in flights.items()}
        for name, (code, said) in ended.items():
            if code == 0:
                flown += 1
                bytes_match = waveform_bytes(Recording(flights[name].bag())) == alone[name]
                hold(bytes_match, f'offset {offset_s:.1f} s: {name} has other bytes')
            else:
                refused += 1
                text = 'another source publishes rotor/waveform in this ROS domain'
                hold(
                    code == ExitCode.PROCESS_FAILED and text in said,
                    f'{offset_s:.1f} s: {said[-500:]}',
                )
                files = list(flights[name].folder.glob('*/*.mcap*'))
                hold(not files, f'offset {offset_s:.1f} s: the refused rig left {files}')
        hold(any(code == 0 for code, _ in ended.values()), f'{offset_s:.1f} s: nobody flew')
    return {
        'offsets': len(offsets_s),
        'flights with the bytes of a flight alone': flown,
        'flights refused in one sentence': refused,
    }


def simulated(folder: Path, name: str, length_s: str) -> Path:
    """Return the recording that a scenario has when it is simulated offline."""
    file = folder / f'{name}.mcap'
    command = [*CLI, 'simulate', name, '--duration', length_s, '--out', str(file)]
    subprocess.run(command, check=True, capture_output=True)
    return file


def waveform_bytes(recording: Recording) -> bytes:
    """Return all rows of a recording's waveform."""
    return b''.join(block.rows.tobytes() for block in waveform_blocks(recording))


# --- sockets -------------------------------------------------------------------------------------


def sockets(folder: Path, *, quick: bool) -> dict[str, Any]:
    """List every UDP and listening socket of a rig, in processes and in one."""
    found: dict[str, Any] = {}
    for name, options in {'processes': [], 'composed': ['--composed']}.items():
        length_s = '3' if quick else '10'
        words = ('climb_dive', '--duration', length_s, *options)
        with LiveFlight(folder / name, *words) as flight:
            addresses = _addresses(flight)
            code, said = flight.finish()
        hold(code == 0, said[-500:])
        outside = [ip for ip in addresses.values() if not _is_loopback(ip)]
        hold(not outside, f'{name}: sockets on {sorted(set(outside))}')
        hold(addresses, f'{name}: no socket was seen')
        found[f'{name}: sockets on loopback, others'] = [len(addresses), len(outside)]
    return found


def _addresses(flight: LiveFlight) -> dict[tuple[int, int], str]:
    """Return the addresses of the UDP and listening sockets of a rig, until it ends."""
    found: dict[tuple[int, int], str] = {}
    while flight.process.poll() is None:
        rig = psutil.Process(flight.process.pid)
        for process in (rig, *rig.children(recursive=True)):
            try:
                links = process.net_connections('inet')
            except psutil.Error:
                continue
            for link in links:
                if link.type.name == 'SOCK_DGRAM' or link.status == psutil.CONN_LISTEN:
                    found[process.pid, link.laddr.port] = link.laddr.ip
        time.sleep(0.2)
    return found


def _is_loopback(address: str) -> bool:
    parsed = ipaddress.ip_address(address)
    return parsed.is_loopback or parsed in ipaddress.ip_network('239.255.0.0/16')
