# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The indicators of one window; docs/indicators.md says what each needs and what fools it."""

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import GRAVITY_M_S2
from rotor_interfaces.channels import is_acceleration, planes_of
from vibration_monitor.crack import CrackEstimator
from vibration_monitor.crack_model import CrackWindow
from vibration_monitor.envelope import envelope_spectrum, is_resolved
from vibration_monitor.monitor_config import MonitorConfig
from vibration_monitor.names import (
    CRACK_INDICATORS,
    ENVELOPE_LINES,
    PASSAGE_ORDERS,
    RATIO_ORDERS,
    TREND_ORDERS,
    channel_indicators,
    plane_indicators,
    window_indicators,
)
from vibration_monitor.orbit_shape import ORBIT_ORDERS, orbit_shape
from vibration_monitor.order_tracking import highest_order, points_per_revolution, resample
from vibration_monitor.passage import PassageTracker
from vibration_monitor.spectrum import order_components, weighted
from vibration_monitor.synchronous import average_and_residual_rms
from vibration_monitor.trend import LoadTrend, overlap_inflation
from vibration_monitor.vectors import highest_vector_order, order_vectors
from vibration_monitor.whirl import forward_and_backward

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Window:
    """The samples of one window of whole revolutions.

    `revolutions` (samples,) is the rising shaft angle in revolutions: its first value is at or
    before `start`, its last at or after start + count. `signals` (channels, samples) are in m or
    m/s^2, `load_y` (samples,) in m/s^2; both may hold NaN. `inside` are the samples with
    start <= angle < start + count.
    """

    start: int
    count: int
    revolutions: Array
    signals: Array
    load_y: Array
    inside: slice
    rate_hz: int


class Findings(NamedTuple):
    """What a window says: values in the order of `Analyser.names`, and the spectrum if wanted.

    `doubts` says of an indicator why its value, or its lack, cannot vouch for a sound machine.
    """

    values: Array
    spectrum: 'OrderSpectrum | None'
    doubts: dict[str, str]


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """One-sided order spectrum of each channel.

    Amplitudes are zero-to-peak in the unit of the channel (m, m/s^2), Blackman-Harris window,
    bin width 1 / window revolutions, the mean removed. `frequency_hz` is order times mean shaft
    frequency. NaN where a channel has NaN or the samples do not resolve the order.
    """

    orders: Array
    frequency_hz: Array
    amplitudes: dict[str, Array]


def indicator_names(channels: tuple[str, ...], config: MonitorConfig) -> tuple[str, ...]:
    """Return the names of all indicators in the order of `analyse`."""
    names = list(window_indicators(config.extras))
    for channel in channels:
        kinds = channel_indicators(channel, config.orders, config.extras)
        names += [f'{channel}/{kind}' for kind in kinds]
    for plane in planes_of(channels):
        names += [f'{plane}/{kind}' for kind in plane_indicators(config.orders, config.extras)]
    return tuple(names)


class Analyser:
    """Computes the indicators of window after window of one run."""

    def __init__(self, channels: tuple[str, ...], config: MonitorConfig) -> None:
        self.channels = channels
        self.names = indicator_names(channels, config)
        self._config = config
        self._extras = frozenset(config.extras)
        self._planes = planes_of(channels)
        self._orders = (*config.orders, config.ball_pass_order)
        if 'orbit' in self._extras:
            self._orders += tuple(order for order in ORBIT_ORDERS if order not in config.orders)
        self._passages = {
            order: PassageTracker(config.critical_speed_rad_s / order, len(channels))
            for order in PASSAGE_ORDERS
            if 'passage' in self._extras and config.critical_speed_rad_s and order in config.orders
        }
        self._trend_orders = [self._orders.index(n) for n in TREND_ORDERS if n in config.orders]
        inflation = overlap_inflation(config.window_revolutions, config.hop_revolutions)
        self._trend = LoadTrend(config.trend_windows, inflation)
        self._last_start: int | None = None
        self._crack = CrackEstimator(
            config.crack,
            window_revolutions=config.window_revolutions,
            hop_revolutions=config.hop_revolutions,
        )

    def analyse(self, window: Window) -> Findings:
        """Return the values of `names`, the doubts and, if wanted, the spectrum of a window.

        A channel with a NaN, or without any motion at all (a dead sensor), is NaN throughout; the
        others are untouched.
        """
        inside = window.signals[:, window.inside]
        alive = np.isfinite(window.signals).all(axis=1) & (inside.max(axis=1) > inside.min(axis=1))
        # always a copy: of an array in another form the sums would be compiled anew, for 10 s
        signals = np.where(alive[:, np.newaxis], window.signals, 0.0)
        window = dataclasses.replace(window, signals=signals)
        speed_rad_s = mean_speed(window)
        load = _load_values(window)
        vectors = tracked_vectors(window, self._orders)
        vectors[~alive] = complex(math.nan, math.nan)
        tracked = None
        if self._extras & _ON_EQUAL_ANGLES:
            tracked = resampled(window)
            tracked[~alive] = math.nan
        columns = [
            _vector_values(row, name, self._config)
            for row, name in zip(vectors, self.channels, strict=True)
        ]
        for column, signal, ok in zip(columns, inside, alive, strict=True):
            column.append(float(np.mean(signal)) if ok else math.nan)
        used = [signal if ok else None for signal, ok in zip(inside, alive, strict=True)]
        self._extend_by_samples(columns, used, window.rate_hz, speed_rad_s)
        if tracked is not None and 'average' in self._extras:
            _extend(columns, *average_and_residual_rms(tracked, window.count))
        self._extend_by_history(columns, window.start, speed_rad_s, load[0], vectors)
        values = [speed_rad_s, *load]
        for column in columns:
            values += column
        for plane in self._planes:
            values += self._plane_values(plane, vectors)
        doubts: dict[str, str] = {}
        if 'crack' in self._extras:
            values[3:3], doubts = self._crack_values(values, self._step_revolutions(window.start))
        self._last_start = window.start
        spectrum = None
        if tracked is not None and 'spectrum' in self._extras:
            spectrum = self._spectrum(window, tracked, speed_rad_s)
        return Findings(np.array(values), spectrum, doubts)

    def _extend_by_samples(
        self, columns: list[list[float]], signals: list[Array | None], rate_hz: int, speed: float
    ) -> None:
        """Add what is computed from the samples in time; None stands for a dead channel."""
        for column, channel, signal in zip(columns, self.channels, signals, strict=True):
            if 'statistics' in self._extras:
                column.extend([math.nan] * 3 if signal is None else statistics(signal))
            if 'envelope' in self._extras and is_acceleration(channel):
                column.extend(self._envelope_values(signal, rate_hz, speed))

    def _envelope_values(
        self, signal: Array | None, rate_hz: int, speed_rad_s: float
    ) -> list[float]:
        """Return amplitude and prominence of the bearing's lines."""
        band_hz = self._config.envelope_band_hz
        if signal is None or not is_resolved(band_hz, len(signal), rate_hz):
            return [math.nan] * (2 * len(ENVELOPE_LINES))
        spectrum = envelope_spectrum(signal, rate_hz, band_hz)
        ball_pass = self._config.ball_pass_order
        orders = (ball_pass / self._config.ball_count, ball_pass,
                  self._config.ball_count - ball_pass)  # fmt: skip
        values = []
        for order in orders:
            line = spectrum.line_near(order * speed_rad_s / (2 * math.pi))
            values += [line.amplitude, line.prominence]
        return values

    def _extend_by_history(
        self,
        columns: list[list[float]],
        start: int,
        speed_rad_s: float,
        load_factor: float,
        vectors: NDArray[np.complex128],
    ) -> None:
        """Add the indicators that look back over the windows before."""
        last = self._last_start
        broken = last is None or start - last != self._config.hop_revolutions
        for order, tracker in self._passages.items():
            if broken:
                tracker.forget()
            amplitudes = np.abs(vectors[:, self._orders.index(order)])
            _extend(columns, *tracker.update(speed_rad_s, amplitudes))
        if 'trend' in self._extras:
            slopes, errors = self._trend.update(
                speed_rad_s, load_factor, vectors[:, self._trend_orders]
            )
            for index in range(len(self._trend_orders)):
                _extend(columns, slopes[:, index], errors[:, index])

    def _plane_values(self, plane: str, vectors: NDArray[np.complex128]) -> list[float]:
        y, z = (vectors[self.channels.index(f'{plane}_{axis}')] for axis in 'yz')
        values: list[float] = []
        if 'whirl' in self._extras:
            count = len(self._config.orders)
            both = forward_and_backward(y[:count], z[:count])
            values += np.stack(both, axis=1).ravel().tolist()
        if 'orbit' in self._extras:
            places = [self._orders.index(order) for order in ORBIT_ORDERS]
            shape = orbit_shape(y[places], z[places], self._config.displacement_floor_m)
            values += [shape.turns, shape.crossings, shape.axis_ratio]
        return values

    def _step_revolutions(self, start: int) -> int:
        """Return the revolutions since the window before; one hop where the angle began anew."""
        if self._last_start is None or start <= self._last_start:
            return self._config.hop_revolutions
        return start - self._last_start

    def _crack_values(
        self, others: list[float], step_revolutions: int
    ) -> tuple[list[float], dict[str, str]]:
        """Return the indicators of the crack, which follow from all others, and their doubts."""
        names = (name for name in self.names if name not in CRACK_INDICATORS)
        known = dict(zip(names, others, strict=True))
        findings = self._crack.update(CrackWindow.of(known, step_revolutions))
        found = findings.by_load
        values = [found.ratio, found.lowest, found.angle_rad, findings.by_reference.lowest]
        # the last one compares with reference flights, which does not need a changing load
        doubts = dict.fromkeys(CRACK_INDICATORS[:-1], findings.doubt) if findings.doubt else {}
        if math.isnan(values[-1]):
            missing = 'there is no baseline to compare with (monitor.crack.baseline)'
            has_baseline = self._config.crack.baseline is not None
            doubts[CRACK_INDICATORS[-1]] = findings.doubt if has_baseline else missing
        return values, doubts

    def _spectrum(self, window: Window, tracked: Array, speed_rad_s: float) -> OrderSpectrum:
        count = window.count
        orders = np.arange(math.floor(self._config.spectrum_max_order * count) + 1) / count
        resolved = highest_order(window.revolutions)
        amplitudes = {}
        for channel, signal in zip(self.channels, tracked, strict=True):
            amplitudes[channel] = np.full(len(orders), math.nan)
            components = order_components(weighted(signal), count)
            found = min(len(components), int(np.searchsorted(orders, resolved, side='right')))
            amplitudes[channel][:found] = np.abs(components[:found])
        return OrderSpectrum(orders, orders * (speed_rad_s / (2 * math.pi)), amplitudes)


def _extend(columns: list[list[float]], *values: Array) -> None:
    """Add one value of each array to each channel's column."""
    for column, *more in zip(columns, *values, strict=True):
        column.extend(map(float, more))


_ON_EQUAL_ANGLES = frozenset({'spectrum', 'average'})


def mean_speed(window: Window) -> float:
    """Return the mean shaft speed in rad/s: the angle of the window over its duration."""
    ends = np.array([window.start, window.start + window.count])
    after = np.clip(np.searchsorted(window.revolutions, ends), 1, len(window.revolutions) - 1)
    low, high = window.revolutions[after - 1], window.revolutions[after]
    first, last = after - 1 + (ends - low) / (high - low)
    return float(2 * math.pi * window.count * window.rate_hz / (last - first))


def tracked_vectors(window: Window, orders: tuple[float, ...]) -> NDArray[np.complex128]:
    """Return A exp(i phase) of each signal and order, phases relative to shaft angle 0.

    In the unit of the signals, amplitudes zero-to-peak; NaN where the samples do not resolve the
    order; (signals, orders).
    """
    vectors = order_vectors(
        window.revolutions, window.signals, start=window.start, count=window.count, orders=orders
    )
    cycles_before = np.array(orders) * window.start % 1.0
    vectors *= np.exp(-2j * np.pi * cycles_before)
    resolved = highest_vector_order(window.revolutions, window.count)
    vectors[:, np.array(orders) > resolved] = complex(math.nan, math.nan)
    return vectors


def resampled(window: Window) -> Array:
    """Return the signals at equal angles; (signals, points)."""
    return resample(
        window.revolutions,
        window.signals,
        start=window.start,
        count=window.count,
        points=points_per_revolution(window.revolutions),
    )


def statistics(samples: Array) -> list[float]:
    """Return RMS about the mean (unit of x), crest factor and kurtosis (Gaussian noise: 3).

    Crest factor = max|x - mean| / RMS, kurtosis = mean((x - mean)^4) / RMS^4; NaN where the motion
    is too small for a float64.
    """
    square = (samples - np.mean(samples)) ** 2
    mean_square = float(np.mean(square))
    if not mean_square**2 > 0.0:
        return [math.sqrt(mean_square), math.nan, math.nan]
    crest = math.sqrt(float(np.max(square)) / mean_square)
    return [math.sqrt(mean_square), crest, float(np.mean(square * square)) / mean_square**2]


def _load_values(window: Window) -> list[float]:
    """Return mean and range of the load factor; NaN where a sample has none."""
    load_y = window.load_y[window.inside]
    mean = float(np.mean(load_y))
    if not math.isfinite(mean):
        return [math.nan, math.nan]
    return [mean / GRAVITY_M_S2, float(np.ptp(load_y)) / GRAVITY_M_S2]


def _vector_values(
    vectors: NDArray[np.complex128], channel: str, config: MonitorConfig
) -> list[float]:
    """Return amplitude and phase at each order, then the ratios and their denominator."""
    vectors = vectors[: len(config.orders) + 1]
    amplitudes = np.abs(vectors)
    phases = np.angle(vectors)
    phases[phases <= -math.pi] = math.pi
    phases[amplitudes == 0] = math.nan
    values: list[float] = np.stack([amplitudes, phases], axis=1).ravel().tolist()
    amplitude = dict(zip(config.orders, amplitudes.tolist(), strict=False))
    floor = (
        config.acceleration_floor_m_s2 if is_acceleration(channel) else config.displacement_floor_m
    )
    denominator = max(amplitude[1.0], floor)  # NaN stays NaN: it stands first
    values += [amplitude[order] / denominator for order in RATIO_ORDERS if order in amplitude]
    return [*values, denominator]
