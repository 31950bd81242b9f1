# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Gusts against the formulas they come from, written out here a second time."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad

from maneuver_gen import load_grid, parse_maneuver
from maneuver_gen.maneuvers.gusts import BAND_HZ, gust_waves

V, L = 120.0, 533.4  # 1750 ft, MIL-F-8785C above 2000 ft
BANDS_HZ = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


def density(frequency_hz: float) -> float:
    """MIL-F-8785C, 3.7.2.2, Dryden form, w_g; then a mass that the gusts lift, z'' = w_g - z'."""
    wave_number = 2.0 * math.pi * frequency_hz / V
    gust = L / math.pi * (1.0 + 3.0 * (L * wave_number) ** 2) / (1.0 + (L * wave_number) ** 2) ** 2
    s = 2.0j * math.pi * frequency_hz
    return float(gust * abs(s / (s + 1.0)) ** 2)


def test_the_power_in_every_band_is_that_of_the_spectrum() -> None:
    rms = 0.25
    total = quad(density, *BAND_HZ, limit=200)[0]
    waves = [wave for seed in range(400) for wave in gust_waves(rms, V, L, seed)]
    frequencies = np.array([wave.frequency_hz for wave in waves])
    powers = np.array([0.5 * wave.amplitude**2 for wave in waves])
    for low, high in itertools.pairwise(BANDS_HZ):
        found = powers[(frequencies >= low) & (frequencies < high)].sum() / 400
        wanted = rms**2 * quad(density, low, high)[0] / total
        # a bin's power is its density at one drawn frequency: 400 draws in some five bins
        assert found == pytest.approx(wanted, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(5))
def test_the_course_has_the_root_mean_square_that_was_asked_for(seed: int) -> None:
    data = {'profile': 'gusts', 'rms': 0.3, 'mean': 1.5, 'seed': seed}
    factors = load_grid(parse_maneuver(data), 3600.0)[:, 0] / 9.81
    # an hour is 72 periods of the slowest wave; neighbours 0.003 Hz apart beat ten times in it
    assert factors.mean() == pytest.approx(1.5, abs=0.003)
    assert factors.std() == pytest.approx(0.3, rel=0.02)
    # near enough to Gaussian: 0.27 % of the time beyond three times that
    beyond = np.mean(np.abs(factors - 1.5) > 0.9)
    assert 0.0002 < beyond < 0.006


@pytest.mark.slow
def test_seeds_give_courses_that_have_nothing_to_do_with_each_other() -> None:
    courses = [
        load_grid(parse_maneuver({'profile': 'gusts', 'rms': 0.3, 'seed': seed}), 1800.0)[:, 0]
        for seed in range(4)
    ]
    correlation = np.corrcoef(courses)
    # some 200 independent stretches (half a period of the strongest waves): 3 sigma
    assert np.abs(correlation - np.eye(4)).max() < 0.2
