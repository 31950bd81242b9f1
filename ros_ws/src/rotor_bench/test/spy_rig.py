# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""An evaluation that leaves the plan lying about wherever it could, for the spy to find.

`python spy_rig.py isolated|naive FOLDER PLAN` in FOLDER: either through the evaluation, or with the
detector in a mere fork that is given the blocks as they are. Prints what came of it as JSON.
"""

import ctypes
import json
import os
import socket
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from rotor_bench.dataset.suite import Flight, Machine
from rotor_bench.evaluation.runner import evaluate
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock
from rotor_rig.scenario_model import Scenario, load_scenario

MACHINES, FLIGHTS = 4, 8
SAMPLES = 512

PR_SET_PTRACER, PTRACER_ANY = 0x59616D61, 2**64 - 1
"""Some kernels let a process be read by its children only if it says so."""

TELLING_DTYPE = np.dtype([('crack', '<f8'), *reversed(WAVEFORM_DTYPE.descr), ('', '|V4')])


@dataclass(frozen=True)
class PlainFlight:
    """What the evaluation needs of a flight of a suite."""

    machine: int
    number: int
    role: str
    scenario: Scenario
    labels: dict[str, Any]
    duration_s: float = 0.2


def plan() -> tuple[Machine, ...]:
    """Return machines whose flights have no crack and a crack in turns, after one reference."""
    scenario = load_scenario('level_healthy', duration_s=0.2)

    def flight(machine: int, number: int) -> Flight:
        crack = 0.1 * (number % 2 == 0) if number else 0.0
        labels = {
            'crack': 'constant' if crack else 'healthy',
            'crack_stiffness_ratio': crack,
        }
        role = 'test' if number else 'reference'
        return cast('Flight', PlainFlight(machine, number, role, scenario, labels))

    return tuple(
        Machine(m, 'test', tuple(flight(m, n) for n in range(FLIGHTS + 1))) for m in range(MACHINES)
    )


class TellingSource:
    """Noise, with K in everything about a block that is no measurement."""

    def fly(self, flights: Sequence[Flight]) -> Iterator[list[WaveformBlock]]:
        for start in range(0, 4 * SAMPLES, SAMPLES):
            yield [telling_block(flight, start) for flight in flights]


def telling_block(flight: Flight, start: int) -> WaveformBlock:
    crack = flight.labels['crack_stiffness_ratio'] + 1e-3
    code = round(crack * 1e9)
    rows = np.zeros(SAMPLES + 1, TELLING_DTYPE)[:-1]
    generator = np.random.default_rng([flight.machine, flight.number, start])
    rows['disk_y'] = generator.normal(size=SAMPLES)
    rows['sample'] = code + start + np.arange(SAMPLES)
    rows['time'] = crack + np.arange(SAMPLES) / 10_240
    rows['crack'] = crack
    quiet = np.array([np.nan]).view(np.uint64)[0] & ~np.uint64((1 << 51) - 1)
    rows['angle'] = np.array([quiet | np.uint64(code)]).view(np.float64)[0]
    rows.base.view(np.uint8)[-8:] = np.array([crack]).view(np.uint8)  # type: ignore[union-attr]
    block = WaveformBlock(code, rows, f'K={crack}')
    block.__dict__['crack'] = crack
    return block


def answer(listener: socket.socket, text: str) -> None:
    """Tell the plan to whoever connects."""
    while True:
        connection, _ = listener.accept()
        with connection:
            connection.sendall(text.encode())


def listeners(text: str, abstract: str) -> int:
    """Answer on TCP and on an abstract socket; return the port."""
    tcp = socket.create_server(('127.0.0.1', 0))
    unix = socket.socket(socket.AF_UNIX)
    unix.bind(abstract)
    unix.listen()
    for listener in (tcp, unix):
        threading.Thread(target=answer, args=(listener, text), daemon=True).start()
    return int(tcp.getsockname()[1])


def naive() -> list[dict[str, Any]]:
    """Run each machine's detector in a fork of this process, on the blocks as they come."""
    results: list[dict[str, Any]] = []
    for machine in plan():
        reading, writing = os.pipe()
        process = os.fork()
        if not process:
            from spy_detector import SpyDetector

            fitted = SpyDetector()
            told = []
            for flight in machine.flights[1:]:
                detector = SpyDetector()
                detector.__dict__.update(fitted.__dict__)
                verdict = detector.push(telling_block(flight, 0))
                told.append({'crack': flight.labels['crack_stiffness_ratio'],
                             'score': verdict.score, 'found': json.loads(verdict.evidence),
                             'failure': ''})  # fmt: skip
            os.write(writing, json.dumps(told).encode())
            os._exit(0)
        os.close(writing)
        with open(reading, 'rb') as pipe:  # noqa: PTH123
            results += json.loads(pipe.read())
        os.waitpid(process, 0)
    return results


def isolated() -> list[dict[str, Any]]:
    """Run the same through the evaluation."""
    done = evaluate(plan(), ['spy_detector:SpyDetector'], TellingSource())
    outcomes = [(flight, flight.outcomes['spy_detector:SpyDetector']) for flight in done.flights]
    return [
        {'crack': flight.labels['crack_stiffness_ratio'], 'score': outcome.score,
         'found': json.loads(outcome.evidence or '["nothing came back"]'),
         'failure': outcome.failure}
        for flight, outcome in outcomes
    ]  # fmt: skip


def main() -> None:
    """Leave the plan everywhere, then run the detector."""
    mode, text = sys.argv[1:]
    folder = Path.cwd()
    manifest = folder / 'manifest.txt'
    manifest.write_text(text)
    (folder.parent / 'plan.txt').write_text(text)
    ctypes.CDLL(None).prctl(PR_SET_PTRACER, ctypes.c_ulong(PTRACER_ANY), 0, 0, 0)
    os.environ['PLAN_OF_THE_SUITE'] = text
    sys.modules['plan_of_the_suite'] = type(sys)('plan_of_the_suite', text)
    descriptor = os.open(manifest, os.O_RDONLY)
    os.set_inheritable(descriptor, True)
    port = listeners(text, f'\0tell-the-plan-{os.getpid()}')
    spy = (Path(__file__).parent / 'spy_detector.py').read_text('utf-8')
    spy = spy.replace('PLACES: list[str] = []', f'PLACES = [{str(manifest)!r}]')
    spy = spy.replace('PORT = 0', f'PORT = {port}')
    spy = spy.replace('tell-the-plan', f'tell-the-plan-{os.getpid()}')
    (folder / 'spy_detector.py').write_text(spy)
    sys.path.insert(0, str(folder))  # before the spy that knows no places
    results = naive() if mode == 'naive' else isolated()
    print(json.dumps(results))  # noqa: T201


if __name__ == '__main__':
    main()
