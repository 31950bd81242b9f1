# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Detectors that fail in every way, for the tests of the evaluation."""

import importlib
import math
import os
import signal
import time
from collections.abc import Iterable

import numpy as np

from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.detectors.protocol import Verdict


class Sound:
    """Scores the largest of disk_y, above what fit has seen; counts blocks in its evidence."""

    alarm_score = 2.0

    def __init__(self) -> None:
        self.reference = 0.0
        self.fitted_blocks = 0
        self.blocks = 0

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        for flight in flights:
            for block in flight:
                self.fitted_blocks += 1
                self.reference = max(self.reference, float(block.rows['disk_y'].max()))

    def push(self, block: WaveformBlock) -> Verdict:
        self.blocks += 1
        score = float(block.rows['disk_y'].max()) / self.reference
        text = f'block {self.blocks}, fitted on {self.fitted_blocks}, reference {self.reference:g}'
        return Verdict(score, text)


class Silent(Sound):
    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        return Verdict(math.nan, '')


class LooksAtFirstBlocksOnly(Sound):
    """Leaves flights before they end, which must not shift the next ones."""

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        for flight in flights:
            first = next(iter(flight))
            assert first.rows['sample'][0] == 0
            self.fitted_blocks += 1
        self.reference = 1.0


class RaisesAtOnce(Sound):
    def __init__(self) -> None:
        raise ValueError('never made')


class RaisesInFit(Sound):
    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:  # noqa: ARG002
        raise ZeroDivisionError('cannot fit this')


class RaisesLater(Sound):
    def push(self, block: WaveformBlock) -> Verdict:
        if self.blocks == 2:
            raise KeyError('third block')
        return super().push(block)


class Exits(Sound):
    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        raise SystemExit(0)


class Dies(Sound):
    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError


class DiesInFit(Sound):
    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:  # noqa: ARG002
        os._exit(0)


class CannotBeCopied(Sound):
    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        super().fit(flights)
        self.scale = lambda height: height / self.reference


class Hangs(Sound):
    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        time.sleep(600)
        raise AssertionError


class SaysNoVerdict(Sound):
    def push(self, block: WaveformBlock) -> Verdict:
        return float(block.rows['disk_y'][0])  # type: ignore[return-value]


class SaysInfinity(Sound):
    def push(self, block: WaveformBlock) -> Verdict:  # noqa: ARG002
        return Verdict(math.inf, 'certain')


class HasNoAlarm:
    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        """Learn nothing."""

    def push(self, block: WaveformBlock) -> Verdict:
        return Verdict(float(np.max(block.rows['disk_y'])), '')


class WritesEverywhere(Sound):
    """Writes where it may and tries where it may not."""

    def push(self, block: WaveformBlock) -> Verdict:
        with open('own', 'w') as file:  # noqa: PTH123
            file.write('mine')
        try:
            with open('/tmp/not-mine', 'w') as file:  # noqa: PTH123, S108
                file.write('not mine')
        except OSError:
            return super().push(block)
        raise AssertionError('wrote outside')


class FliesItself(Sound):
    """Tries to import what it could fly its flight again with."""

    def push(self, block: WaveformBlock) -> Verdict:
        importlib.import_module('rotor_recording')  # others of the rig are there
        for name in ('rotor_sim.stream.simulator', 'maneuver_gen', 'rotor_bench.dataset.stream'):
            try:
                importlib.import_module(name)
            except OSError:
                continue
            raise AssertionError(f'{name} was imported')
        return super().push(block)
