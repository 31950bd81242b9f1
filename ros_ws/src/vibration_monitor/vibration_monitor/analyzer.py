# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Compute the selected indicator families for each window."""

import math

import numpy as np

from vibration_monitor.errors import MonitorError
from vibration_monitor.indicators.family import Family
from vibration_monitor.indicators.registry import chosen, layout
from vibration_monitor.indicators.window import Window
from vibration_monitor.monitor_config import MonitorConfig

_TURN = {'channel': 0, 'plane': 1, 'window': 2}
"""The indicators of the window may be derived from all others, so they are computed last."""


class Analyzer:
    """Computes the indicators of one run."""

    def __init__(self, channels: tuple[str, ...], config: MonitorConfig) -> None:
        self.channels = channels
        self._config = config
        names: list[str] = []
        places: dict[type[Family], dict[str, slice]] = {}
        for family, source, added in layout(channels, config):
            places.setdefault(family, {})[source] = slice(len(names), len(names) + len(added))
            names += added
        self.names = tuple(names)
        self._families = [
            (family(config, channels, tuple(places[family])), list(places[family].values()))
            for family in sorted(places, key=lambda family: _TURN[family.of])
        ]
        orders = (*config.orders, config.ball_pass_order)
        for family in chosen(config.extras):
            orders += tuple(order for order in family.more_orders if order not in orders)
        self._orders = orders
        self._last_start: int | None = None

    def analyze(self, window: Window) -> Window:
        """Fill in the values of `names`, the doubts and, if wanted, the spectrum of a window.

        Raises:
            MonitorError: a family does not return the values that it declares.

        """
        window.channels, window.orders, window.names = self.channels, self._orders, self.names
        window.hop, window.previous_start = self._config.hop_revolutions, self._last_start
        window.values = np.full(len(self.names), math.nan)
        for family, places in self._families:
            rows = family.compute(window)
            if [len(row) for row in rows] != [place.stop - place.start for place in places]:
                raise MonitorError(
                    f'indicator family {family.key!r} returned rows whose lengths differ from '
                    'the number of names that it declares'
                )
            for place, row in zip(places, rows, strict=True):
                window.values[place] = row
        self._last_start = window.start
        return window
