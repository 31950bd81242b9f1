# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The indicators of one window; docs/monitor.md says what each needs and what fools it."""

import cmath
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor_interfaces.waveform import CHANNEL_COLUMNS
from vibration_monitor.config import (
    RATIO_ORDERS,
    WINDOW_INDICATORS,
    MonitorConfig,
    channel_indicators,
    is_acceleration,
    is_channel,
)
from vibration_monitor.order_tracking import highest_order, points_per_revolution, resample
from vibration_monitor.spectrum import component, order_components, weighted

GRAVITY_M_S2 = 9.81
"""As the paper rounds it: load factor 1 = 9.81 m/s^2 along +y."""


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
    revolutions: NDArray[np.float64]
    signals: NDArray[np.float64]
    load_y: NDArray[np.float64]
    inside: slice
    rate_hz: int


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """One-sided order spectrum of each channel.

    Amplitudes are zero-to-peak in the unit of the channel (m, m/s^2), Blackman-Harris window,
    bin width 1 / window revolutions, the mean removed. `frequency_hz` is order times mean shaft
    frequency. NaN where a channel has NaN or the samples do not resolve the order.
    """

    orders: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    amplitudes: dict[str, NDArray[np.float64]]


def channels_of(columns: tuple[str, ...]) -> tuple[str, ...]:
    """Return the vibration channels among the columns: those of the contract, then others."""
    known = [name for name in CHANNEL_COLUMNS if name in columns]
    return (*known, *sorted(n for n in columns if is_channel(n) and n not in CHANNEL_COLUMNS))


def indicator_names(channels: tuple[str, ...], config: MonitorConfig) -> tuple[str, ...]:
    """Return the names of all indicators in the order of `analyse`."""
    kinds = channel_indicators(config.orders)
    return WINDOW_INDICATORS + tuple(f'{name}/{kind}' for name in channels for kind in kinds)


def analyse(
    window: Window, channels: tuple[str, ...], config: MonitorConfig
) -> tuple[NDArray[np.float64], OrderSpectrum]:
    """Return the values of `indicator_names` and the order spectrum of a window.

    A channel with a NaN, or without any motion at all (a dead sensor), is NaN throughout; the
    others are untouched.
    """
    used = window.signals[:, window.inside]
    alive = np.isfinite(window.signals).all(axis=1) & (used.max(axis=1) > used.min(axis=1))
    points = points_per_revolution(window.revolutions)
    tracked = resample(
        window.revolutions,
        np.where(alive[:, np.newaxis], window.signals, 0.0),
        start=window.start,
        count=window.count,
        points=points,
    )
    resolved = highest_order(window.revolutions)
    speed_rad_s = mean_speed(window)
    values = _window_values(window, speed_rad_s)
    orders = np.arange(math.floor(config.spectrum_max_order * window.count) + 1) / window.count
    amplitudes = {}
    for index, channel in enumerate(channels):
        if not alive[index]:
            values += [math.nan] * len(channel_indicators(config.orders))
            amplitudes[channel] = np.full(len(orders), math.nan)
            continue
        signal = weighted(tracked[index])
        spectrum = order_components(signal, window.count)
        values += _tracked_values(
            signal, spectrum, window=window, channel=channel, config=config, resolved=resolved
        )
        values += statistics(used[index])
        amplitudes[channel] = _amplitudes(spectrum, orders, resolved)
    frequency_hz = orders * (speed_rad_s / (2 * math.pi))
    return np.array(values), OrderSpectrum(orders, frequency_hz, amplitudes)


def mean_speed(window: Window) -> float:
    """Return the mean shaft speed in rad/s: the angle of the window over its duration."""
    index = np.arange(len(window.revolutions), dtype=np.float64)
    ends = [window.start, window.start + window.count]
    first, last = np.interp(ends, window.revolutions, index)
    return float(2 * math.pi * window.count * window.rate_hz / (last - first))


def statistics(samples: NDArray[np.float64]) -> list[float]:
    """Return RMS about the mean (unit of x), crest factor and kurtosis (Gaussian noise: 3).

    Crest factor = max|x - mean| / RMS, kurtosis = mean((x - mean)^4) / RMS^4.
    """
    square = (samples - np.mean(samples)) ** 2
    mean_square = float(np.mean(square))
    crest = math.sqrt(float(np.max(square)) / mean_square)
    return [math.sqrt(mean_square), crest, float(np.mean(square * square)) / mean_square**2]


def _window_values(window: Window, speed_rad_s: float) -> list[float]:
    load_factor = window.load_y[window.inside] / GRAVITY_M_S2
    if not np.isfinite(load_factor).all():
        return [speed_rad_s, math.nan, math.nan]
    return [speed_rad_s, float(np.mean(load_factor)), float(np.ptp(load_factor))]


def _tracked_values(
    signal: NDArray[np.float64],
    spectrum: NDArray[np.complex128],
    *,
    window: Window,
    channel: str,
    config: MonitorConfig,
    resolved: float,
) -> list[float]:
    """Return amplitude and phase at each order, then the ratios and their denominator."""
    amplitude: dict[float, float] = {}
    values = []
    for order in (*config.orders, config.ball_pass_order):
        at_order = complex(math.nan, math.nan)
        if order <= resolved:
            bin_number = order * window.count
            at_order = (
                complex(spectrum[int(bin_number)])
                if bin_number.is_integer()
                else component(signal, window.count, order)
            )
        amplitude[order] = abs(at_order)
        values += [abs(at_order), _phase(at_order, order * window.start)]
    floor = (
        config.acceleration_floor_m_s2 if is_acceleration(channel) else config.displacement_floor_m
    )
    denominator = max(amplitude[1.0], floor)
    values += [amplitude[order] / denominator for order in RATIO_ORDERS if order in config.orders]
    return [*values, denominator]


def _phase(at_order: complex, cycles_before: float) -> float:
    """Return the phase in (-pi, pi] relative to shaft angle 0; NaN where there is no motion.

    The window starts `cycles_before` cycles of this order after angle 0.
    """
    if at_order == 0:
        return math.nan
    phase = cmath.phase(at_order) - 2 * math.pi * (cycles_before % 1.0)
    return phase + 2 * math.pi if phase <= -math.pi else phase


def _amplitudes(
    spectrum: NDArray[np.complex128], orders: NDArray[np.float64], resolved: float
) -> NDArray[np.float64]:
    """Return the amplitudes at `orders`, the first bins; NaN where there are none to trust."""
    result = np.full(len(orders), math.nan)
    count = min(len(spectrum), int(np.searchsorted(orders, resolved, side='right')))
    result[:count] = np.abs(spectrum[:count])
    return result
