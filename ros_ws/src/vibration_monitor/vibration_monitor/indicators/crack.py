# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The crack estimate as indicators, and the doubts about it."""

import math
from typing import TYPE_CHECKING

from vibration_monitor.crack import CrackEstimator
from vibration_monitor.crack_model import CRACK_ORDERS, PROBES, CrackWindow
from vibration_monitor.indicators.family import Family, Indicator
from vibration_monitor.indicators.window import Window

if TYPE_CHECKING:
    from vibration_monitor.monitor_config import MonitorConfig


class Crack(Family):
    """How deep a crack would have to be to explain what the probes say.

    [crack.md](crack.md) has the method.
    """

    key = 'crack'
    title = 'Crack'
    needs = (
        'All six displacement probes, what `monitor.crack` tells of the rotor, a load that changes '
        'by 0.08 g, and a speed up to 0.6 of the rigid critical speed (0.525 to call it sound).'
    )
    fooled_by = (
        'Scale errors of the probes, a wrong critical speed, and what else gives the shaft another '
        'stiffness as it turns; `crack_reference_ratio_low` by whatever changes 2x and 3x at once.'
    )
    source = (
        'Markert, Platz and Seidler, International Journal of Rotating Machinery 7 (2001) 311-321.'
    )
    of = 'window'
    indicators = (
        Indicator(
            'crack_ratio',
            '1',
            'estimate of the crack stiffness ratio K from the change with the load; NaN for the '
            'first 10 s and 160 revolutions, and where a probe is silent',
        ),
        Indicator(
            'crack_ratio_low',
            '1',
            'what K is at least (4 standard errors, the lesser of 2x and 3x); negative: no '
            'evidence',
        ),
        Indicator(
            'crack_angle',
            'rad',
            'angle of the crack from the mark of angle 0 (the heavy spot, with the encoder of the '
            'rig)',
        ),
        Indicator(
            'crack_reference_ratio_low',
            '1',
            'what K is at least by the difference from reference flights; NaN without a baseline',
        ),
    )

    @classmethod
    def refusal(cls, config: 'MonitorConfig') -> str:
        """Return why these settings rule it out, '' where they do not."""
        orders = [f'{order:g}' for order in CRACK_ORDERS if order not in config.orders]
        if orders:
            return f"extras holds 'crack', which needs order {orders[0]} in orders"
        probes = [name for name in PROBES if config.channels and name not in config.channels]
        if probes:
            return f"extras holds 'crack', but channels does not hold {probes[0]!r}"
        return ''

    def __init__(
        self, config: 'MonitorConfig', channels: tuple[str, ...], sources: tuple[str, ...]
    ) -> None:
        super().__init__(config, channels, sources)
        self._estimator = CrackEstimator(
            config.crack,
            window_revolutions=config.window_revolutions,
            hop_revolutions=config.hop_revolutions,
        )

    def compute(self, window: Window) -> list[list[float]]:
        """Return the estimate; note the doubts about it in the window."""
        findings = self._estimator.update(
            CrackWindow.of(window.indicators, window.step_revolutions)
        )
        found, reference = findings.by_load, findings.by_reference.lowest
        *by_load, by_reference = (indicator.name for indicator in self.indicators)
        # the last one compares with reference flights, which does not need a changing load
        if findings.doubt:
            window.doubts.update(dict.fromkeys(by_load, findings.doubt))
        if math.isnan(reference):
            missing = 'there is no baseline to compare with (monitor.crack.baseline)'
            has_baseline = self.config.crack.baseline is not None
            window.doubts[by_reference] = findings.doubt if has_baseline else missing
        return [[found.ratio, found.lowest, found.angle_rad, reference]]
