# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The base class of indicator families."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

if TYPE_CHECKING:
    from vibration_monitor.indicators.window import Array, Window
    from vibration_monitor.monitor_config import MonitorConfig

OF_SOURCE = 'unit of channel'
"""Stands for the unit of the indicator's channel, or m for a plane."""


@dataclass(frozen=True)
class Indicator:
    """One published number.

    `name` is what follows `channel/` or `plane/`; with `{order}` in it there is one for each order.
    `unit` is in SI, '1' for a pure number, or `OF_SOURCE`. `what` is the formula in a few words,
    `curves` the group of curves in which the viewer draws it.
    """

    name: str
    unit: str
    what: str
    curves: str = 'other'

    def is_named(self, name: str) -> bool:
        """Say whether this name is that of this indicator, at any order."""
        pattern = re.escape(self.name).replace(re.escape('{order}'), r'[0-9]+(\.[0-9]+)?')
        return re.fullmatch(pattern, name, re.ASCII) is not None


class Family:
    """Indicators that are computed together; there is one object for each run."""

    key: ClassVar[str]
    """Its name in `extras`."""
    title: ClassVar[str]
    needs: ClassVar[str]
    """Requirements; if one is not met, it is NaN or wrong."""
    fooled_by: ClassVar[str]
    """Other causes than a fault that change it."""
    source: ClassVar[str] = ''
    indicators: ClassVar[tuple[Indicator, ...]] = ()
    """Those with `{order}` come first, order after order."""
    of: ClassVar[Literal['window', 'channel', 'plane']] = 'channel'
    """Whether it is computed for each window, channel, or plane measured in both directions."""
    is_always_on: ClassVar[bool] = False
    orders: ClassVar[tuple[float, ...]] = ()
    """Orders that `{order}` stands for, of those that the monitor tracks; (): all of them."""
    more_orders: ClassVar[tuple[float, ...]] = ()
    """Orders that it needs tracked, besides those of the settings."""

    @classmethod
    def kinds(cls, orders: Sequence[float]) -> tuple[str, ...]:
        """Return the names of its indicators, without the source, for these tracked orders."""
        places = [order for order in cls.orders if order in orders] if cls.orders else orders
        by_order = [each.name for each in cls.indicators if '{order}' in each.name]
        names = [name.replace('{order}', f'{order:g}') for order in places for name in by_order]
        return (*names, *(each.name for each in cls.indicators if each.name not in by_order))

    @classmethod
    def is_of(cls, source: str) -> bool:  # noqa: ARG003 - for subclasses
        """Say whether it is computed for this channel or plane."""
        return True

    @classmethod
    def refusal(cls, config: 'MonitorConfig') -> str:  # noqa: ARG003 - for subclasses
        """Return in one sentence why these settings rule it out, '' where they do not."""
        return ''

    def __init__(
        self, config: 'MonitorConfig', channels: tuple[str, ...], sources: tuple[str, ...]
    ) -> None:
        """Start a run; `sources` are its channels or planes, ('',) for a family of the window."""
        self.config = config
        self.channels = channels
        self.sources = sources

    def compute(self, window: 'Window') -> 'Sequence[Sequence[float] | Array] | Array':
        """Return a row for each of `sources`, with a value for each of `kinds`; NaN = unknown."""
        raise NotImplementedError
