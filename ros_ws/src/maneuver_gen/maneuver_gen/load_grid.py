# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The load grid: a manoeuvre sampled at 100 Hz, the same bits live and offline."""

import math
from collections.abc import Iterator

import numpy as np

from maneuver_gen import profiles
from maneuver_gen.config import (
    LONGEST_S,
    ClimbDive,
    Constant,
    Gusts,
    ManeuverConfig,
    Ramp,
    Recorded,
    Sequence,
    SingleManeuver,
    Sinusoid,
    Step,
    Turn,
)
from maneuver_gen.errors import ManeuverError
from maneuver_gen.profiles import FloatArray
from maneuver_gen.recorded import open_flight
from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ, LOAD_STEP_NS


def check_duration(config: ManeuverConfig, duration_s: float) -> None:
    """Raise ManeuverError unless the manoeuvre can be flown for duration_s, s.

    Allowed: above 0 and at most a day. Recorded flights are read: each must cover its part.
    """
    if not 0.0 < duration_s <= LONGEST_S:
        raise ManeuverError(
            f'duration_s = {duration_s:g} is out of range; allowed: above 0 to {LONGEST_S:g} s'
        )
    for part, needed_s in _parts(config, duration_s):
        if isinstance(part, Recorded):
            open_flight(part.path).require(part.start_s, needed_s)


def load_grid(config: ManeuverConfig, duration_s: float) -> FloatArray:
    """Return the loads for a run of duration_s: float64, (points, 2), m/s^2.

    Row k is (load_y, load_z), apparent gravity per unit mass in frame `rotor` at k x 10 ms, from
    k = 0 through the first point at or after the end and one more. A longer run has the same
    first rows, bit for bit. Raises ManeuverError as `check_duration`.
    """
    check_duration(config, duration_s)
    # in whole nanoseconds, so that no rounding error adds a point
    last = -(-round(duration_s * 1e9) // LOAD_STEP_NS)
    times_s = np.arange(last + 2) / LOAD_RATE_HZ
    if isinstance(config, Sequence):
        return GRAVITY_M_S2 * _sequence(config, times_s)
    return GRAVITY_M_S2 * _load_factors(config, times_s)


def flight_path_angle(config: ManeuverConfig, times_s: FloatArray) -> FloatArray:
    """Return the flight-path angle at times of the run, rad, shape (n,), positive climbing.

    Only a climb-dive has one; NaN for the other profiles and for a sequence.
    """
    if isinstance(config, ClimbDive):
        return profiles.flight_path_angle(times_s, config.pulses())
    return np.full_like(times_s, math.nan)


def _parts(config: ManeuverConfig, duration_s: float) -> Iterator[tuple[SingleManeuver, float]]:
    """Yield each single manoeuvre of a run and for how long the run needs it, s."""
    if not isinstance(config, Sequence):
        yield config, duration_s
        return
    left_s = duration_s
    for segment in config.segments[:-1]:
        if left_s > 0.0:
            yield segment.maneuver, min(left_s, segment.duration_s + config.blend_s)
        left_s -= segment.duration_s
    if left_s > 0.0:
        yield config.segments[-1].maneuver, left_s


def _load_factors(config: SingleManeuver, times_s: FloatArray) -> FloatArray:
    """Return (n, 2) load factors, normal and lateral, at times from the manoeuvre's start."""
    lateral = np.zeros_like(times_s)
    match config:
        case Constant():
            normal = profiles.constant(times_s, config.load_factor)
            lateral = profiles.constant(times_s, config.lateral_load_factor)
        case Step():
            normal = profiles.step(times_s, config.before, config.after, config.at_s)
        case Ramp():
            normal = profiles.ramp(
                times_s, config.before, config.after, config.start_s, config.duration_s
            )
        case Sinusoid():
            normal = profiles.sinusoid(
                times_s, config.mean, config.amplitude, config.frequency_hz, config.phase_rad
            )
        case ClimbDive():
            pulses = config.pulses()
            normal = profiles.vertical_plane_load_factor(
                profiles.flight_path_angle(times_s, pulses),
                profiles.flight_path_rate(times_s, pulses),
                config.speed_m_s,
                config.weight,
            )
        case Turn():
            shape = config.level_s, config.roll_s, config.turn_s
            bank = profiles.bank_angle(times_s, config.bank_rad, *shape)
            normal = profiles.coordinated_turn_load_factor(bank)
            lateral = profiles.bank_angle(times_s, config.slip_load_factor, *shape)
        case Gusts():
            normal = profiles.constant(times_s, config.mean)
            for wave in config.waves():
                normal += profiles.sinusoid(
                    times_s, 0.0, wave.amplitude, wave.frequency_hz, wave.phase_rad
                )
        case Recorded():
            flight = open_flight(config.path)
            return flight.sample(config.start_s + times_s)
    return np.column_stack((normal, lateral))


def _sequence(config: Sequence, times_s: FloatArray) -> FloatArray:
    """Return (n, 2) load factors; a segment blends smoothly out of the one before, going on."""
    starts_s = np.concatenate(([0.0], np.cumsum([part.duration_s for part in config.segments])))
    starts_s[-1] = math.inf  # the last segment goes on
    result = np.empty((len(times_s), 2))
    for number, segment in enumerate(config.segments):
        inside = (times_s >= starts_s[number]) & (times_s < starts_s[number + 1])
        local_s = times_s[inside] - starts_s[number]
        load = _load_factors(segment.maneuver, local_s)
        if number:
            blending = local_s < config.blend_s
            old = _load_factors(
                config.segments[number - 1].maneuver,
                times_s[inside][blending] - starts_s[number - 1],
            )
            share = profiles.smooth_step(local_s[blending] / config.blend_s)[:, np.newaxis]
            load[blending] = old * (1.0 - share) + load[blending] * share
        result[inside] = load
    return result
