# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The registry of indicator families, which fixes their order.

The indicators of the window are published first, then those of each channel, then those of each
plane, each in the order of `FAMILIES`. A user's family is named in `extras` by its
entry point in the group `rotor_rig.indicators` or as `module:Class`, and comes last.
"""

import difflib
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from rotor_common import plugins
from rotor_interfaces.channels import channel_unit, is_channel, planes_of, source_and_kind
from vibration_monitor.errors import MonitorError
from vibration_monitor.indicators.average import Average
from vibration_monitor.indicators.crack import Crack
from vibration_monitor.indicators.envelope import Envelope
from vibration_monitor.indicators.family import OF_SOURCE, Family, Indicator
from vibration_monitor.indicators.mean import Mean
from vibration_monitor.indicators.orbit import Orbit
from vibration_monitor.indicators.passage import Passage
from vibration_monitor.indicators.ratios import Ratios
from vibration_monitor.indicators.shaft import Shaft
from vibration_monitor.indicators.spectrum import Spectrum
from vibration_monitor.indicators.statistics import Statistics
from vibration_monitor.indicators.trend import Trend
from vibration_monitor.indicators.vectors import Vectors
from vibration_monitor.indicators.whirl import Whirl

if TYPE_CHECKING:
    from vibration_monitor.monitor_config import MonitorConfig

GROUP = 'rotor_rig.indicators'
"""The group of entry points."""

FAMILIES: tuple[type[Family], ...] = (
    Shaft, Vectors, Ratios, Mean, Spectrum, Statistics, Envelope, Average, Passage, Trend, Whirl,
    Orbit, Crack,
)  # fmt: skip
"""In the order of publication; families of the same kind are also computed in this order."""

EXTRAS = tuple(family.key for family in FAMILIES if not family.is_always_on)
"""The families that are computed only if the settings name them."""

_loaded = {family.key: family for family in FAMILIES if not family.is_always_on}


def family_of(extra: str) -> type[Family]:
    """Return the family that an entry of `extras` names; it is loaded when first named.

    Raises:
        MonitorError: there is none, or it is not a family; one sentence says why.

    """
    if extra not in _loaded:
        target = plugins.target_of(extra, GROUP)
        if target is None:
            known = sorted({*EXTRAS, *plugins.names_of(GROUP)})
            close = difflib.get_close_matches(extra, known, n=1)
            hint = f'did you mean {close[0]!r}?' if close else f'allowed: {", ".join(known)}'
            raise MonitorError(f'there is no such family of indicators; {hint}')
        found = plugins.load(target, 'indicator family', MonitorError)
        if not (isinstance(found, type) and issubclass(found, Family)):
            raise MonitorError(f'{target} is not a class derived from Family')
        if found not in _loaded.values():
            _check_declaration(found, target)
        _loaded[extra] = found
        _find.cache_clear()
    return _loaded[extra]


def is_loaded(extra: str) -> bool:
    """Say whether the family is known without loading anything."""
    return extra in _loaded


def chosen(extras: Sequence[str]) -> list[type[Family]]:
    """Return the families that are computed, in the order of publication."""
    named = [family_of(extra) for extra in extras]
    own = [family for family in FAMILIES if family.is_always_on or family in named]
    return own + [family for family in named if family not in FAMILIES]


def kinds(source: str, orders: Sequence[float], extras: Sequence[str]) -> tuple[str, ...]:
    """Return the indicator names, without the source, of a channel, a plane, or ('') a window."""
    of = 'window' if not source else 'channel' if is_channel(source) else 'plane'
    return tuple(
        kind
        for family in chosen(extras)
        if family.of == of and family.is_of(source)
        for kind in family.kinds(orders)
    )


def layout(
    channels: tuple[str, ...], config: 'MonitorConfig'
) -> Iterator[tuple[type[Family], str, tuple[str, ...]]]:
    """Yield family, source and full names of what is published, in the order of publication."""
    families = chosen(config.extras)
    sources = {'window': ('',), 'channel': channels, 'plane': planes_of(channels)}
    for of, names in sources.items():
        for source in names:
            for family in families:
                if family.of == of and family.is_of(source):
                    prefix = f'{source}/' if source else ''
                    yield family, source, tuple(f'{prefix}{k}' for k in family.kinds(config.orders))


def indicator_names(channels: tuple[str, ...], config: 'MonitorConfig') -> tuple[str, ...]:
    """Return the names of all indicators in the order of publication."""
    return tuple(name for _, _, names in layout(channels, config) for name in names)


def find(name: str) -> Indicator | None:
    """Return what is known of an indicator by its full name; None if no family has it."""
    return _find(source_and_kind(name)[1])


def unit_of(name: str) -> str:
    """Return the unit of an indicator, '1' for a pure number and for an unknown name."""
    indicator = find(name)
    if indicator is None:
        return '1'
    return channel_unit(source_and_kind(name)[0]) if indicator.unit == OF_SOURCE else indicator.unit


@lru_cache(maxsize=1024)
def _find(kind: str) -> Indicator | None:
    families = dict.fromkeys((*FAMILIES, *_loaded.values()))
    indicators = (each for family in families for each in family.indicators)
    return next((each for each in indicators if each.is_named(kind)), None)


def _check_declaration(family: type[Family], target: str) -> None:
    """Raise MonitorError if a family lacks a declaration, or one of its names is known already."""
    for part in ('key', 'title', 'needs', 'fooled_by'):
        if not isinstance(getattr(family, part, None), str):
            raise MonitorError(f'{target} does not declare its {part}')
    if family.of not in {'window', 'channel', 'plane'}:
        raise MonitorError(f"{target} is of {family.of!r}; allowed: 'window', 'channel', 'plane'")
    known = [each.name for each in family.indicators if _find(each.name.replace('{order}', '1'))]
    if known:
        raise MonitorError(f'{target} takes the name {known[0]!r}, which is an indicator already')
