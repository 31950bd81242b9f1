# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The protocol of a crack detector, and how one is found by name.

A detector is found through the entry points of the group `rotor_rig.detectors`, or by
`module:Class`; either leads to a callable without arguments that makes one.
"""

import inspect
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol, cast

from rotor_common import plugins
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.errors import MonitorError

GROUP = 'rotor_rig.detectors'
"""The group of entry points."""


@dataclass(frozen=True)
class Verdict:
    """What a detector says after a block; NaN where it has nothing to say yet."""

    score: float
    """Higher = more likely cracked, in any unit; NaN = nothing to say yet."""
    evidence: str
    """One sentence for people."""


SILENT = Verdict(math.nan, '')
"""The verdict before there is anything to judge."""


class Detector(Protocol):
    """One instance watches one machine.

    `fit` is called once with the machine's own healthy reference flights; every flight under test
    is then given to a fresh copy of the fitted instance, made by pickle, so nothing learnt in one
    reaches another.
    """

    alarm_score: float
    """At or above this score the detector raises its alarm."""

    def fit(self, flights: Iterable[Iterable[WaveformBlock]]) -> None:
        """Learn from healthy flights, each a stream of blocks to be read once, in order."""

    def push(self, block: WaveformBlock) -> Verdict:
        """Take the next block of the flight under test; return what is known now."""


def detector_names() -> list[str]:
    """Return the names of the installed detectors."""
    return plugins.names_of(GROUP)


def detector_target(name: str) -> str:
    """Return `module:attribute` of a detector given by the name of an entry point or directly.

    Raises:
        MonitorError: no such entry point, and not of the form `module:Class`.

    """
    target = plugins.target_of(name, GROUP)
    if target is not None:
        return target
    raise MonitorError(
        f'detector {name!r} is not known; give one of {", ".join(detector_names()) or "(none)"}, '
        'module:Class, or topic:NAME'
    )


def load_detector(target: str) -> Callable[[], Detector]:
    """Return the class or function that makes a detector, given as `module:attribute`.

    Raises:
        MonitorError: the module cannot be imported, lacks the attribute, or it is not callable.

    """
    made = plugins.load(target, 'detector', MonitorError)
    if not callable(made):
        raise MonitorError(f'detector {target!r} is not a class or function that makes a detector')
    return cast('Callable[[], Detector]', made)


def check_detector(detector: Any, target: str) -> Detector:
    """Return `detector`; raises MonitorError if it lacks a part of the protocol."""
    for name, count in (('fit', 1), ('push', 1)):
        method = getattr(detector, name, None)
        if not callable(method):
            raise MonitorError(f'detector {target!r} has no method {name}')
        try:
            inspect.signature(method).bind(*range(count))
        except TypeError:
            raise MonitorError(f'{name} of detector {target!r} must take one argument') from None
        except ValueError:  # no signature to look at
            continue
    alarm_score = getattr(detector, 'alarm_score', None)
    if not isinstance(alarm_score, int | float) or math.isnan(alarm_score):
        raise MonitorError(
            f'alarm_score of detector {target!r} is {alarm_score!r}; it must be a number'
        )
    return cast('Detector', detector)
