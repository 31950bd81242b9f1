# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A point of every group of figures, as the figures define it, against another program's values.

Reference: docs/physics.md, 'What is checked' (dimensionless, 256 steps a revolution, 1500 + 300
revolutions from the same start). Here the transient is 250 revolutions: exponents near -0.01 per
unit tau leave exp(-0.01 * 2 pi 250) = 2e-7 of it.
"""

import dataclasses

import numpy as np
import pytest

from rotor_dynamics import Survey, survey
from rotor_paper import judging
from rotor_paper.figures import Settings, diagrams, load_facts

DIAGRAMS = diagrams(load_facts())
SETTINGS = Settings(values=1, transient=250, exponent_revolutions=250, check_steps=False)

PRINTED = 0.5e-3
"""Half of the last digit of amplitudes and means."""

WINDOW = 2e-4
"""Beyond that, amplitudes differ by their windows, Hann here and unknown there: without a window
a ball-pass line of 0.1 leaks 0.1/(2 pi 300 0.0846) = 6e-4 into 3x, less into the others."""

SECTION = 0.006
"""Half of the last digit of a section's limits, 0.005, and what 300 points of it leave open."""

SCATTER = 0.003
"""An exponent over 500 revolutions scatters by about 0.002; half as many, sqrt(2) times more."""


def at(key: str, variant: str, value: float) -> Survey:
    """Return the survey of a single value of a figure's diagram."""
    diagram = dataclasses.replace(DIAGRAMS[key], values=(value,), transient_ratio=1.0)
    return survey(diagram.points(variant, 1), diagram.plan(SETTINGS))


# mean Y, amplitudes of Z at 1, 2, 2.5, 3 and 4x, exponent
POINTS = {
    'Figs 7-10': ('four_speeds', 'derived', 263.0, 4.413, [0.150, 0.112, 0, 0.105, 0.056], -0.010),
    'Figs 11-13': ('G_at_542', 'derived', 3.0, 4.388, [0.574, 1.472, 0, 0.034, 0.025], -0.010),
    'Figs 5, 6': ('speed_at_G3', 'figure', 431.0, 4.160, [0.180, 0.546, 4.165, 0.398, 0.063], None),
    'Fig. 14': ('K', 'derived', 0.0, 4.325, [0.196, 0.001, 0, 0.012, 0], -0.0093),
    'Fig. 15': ('K_sections', 'figure', 0.1, 4.210, [0.199, 0.366, 0, 3.935, 0.020], -0.012),
    'Fig. 17': ('clearance', 'derived', 5e-6, 5.355, [0.284, 0.183, 0, 0.210, 0.001], -0.0063),
    'Fig. 19': ('eccentricity', 'derived', 1e-5, 4.395, [0.225, 0.171, 0, 2.872, 0.028], -0.0115),
    'Fig. 5a, 6a': ('speed_at_G0', 'derived', 800.0, 0.0, [2.570, 0, 0, 0, 0], None),
    'Fig. 7': ('four_speeds', 'natural', 263.0, 4.385, [0.168, 0.095, 0, 0.071, 1.749], -0.0114),
}


@pytest.mark.parametrize('figure', POINTS)
def test_a_point_of_the_figure_has_the_reference_values(figure: str) -> None:
    key, variant, value, mean, amplitudes, exponent = POINTS[figure]
    found = at(key, variant, value)
    assert found.mean_y[0] / found.length_scale_m[0] == pytest.approx(mean, abs=PRINTED)
    np.testing.assert_allclose(judging.orders(found)[0], amplitudes, atol=PRINTED + WINDOW)
    if exponent is not None:
        assert found.exponent[0] == pytest.approx(exponent, abs=SCATTER)


SECTIONS = {
    'Fig. 7': ('four_speeds', 'natural', 263.0, (4.634, 4.719), (-1.65, -1.57)),
    'Fig. 9': ('four_speeds', 'figure', 431.0, (4.32, 4.76), (-3.63, 2.81)),
    'Fig. 15': ('K_sections', 'derived', 0.1, (4.11, 4.41), (1.73, 2.24)),
    'Fig. 18': ('clearance_sections', 'derived', 5e-6, (4.91, 5.45), (0.13, 0.33)),
}


@pytest.mark.parametrize('figure', SECTIONS)
def test_a_section_of_the_figure_has_the_reference_limits(figure: str) -> None:
    key, variant, value, y, z = SECTIONS[figure]
    found = at(key, variant, value)
    for coordinate, limits in (('y', y), ('z', z)):
        points = judging.section(found, coordinate)[0]
        np.testing.assert_allclose([points.min(), points.max()], limits, atol=SECTION)


def test_no_load_and_no_crack_give_a_plain_harmonic_over_the_eccentricity() -> None:
    """Fig. 16's rotor without its crack: at G = 0 only 1x is left of the amplitudes."""
    found = at('K_unloaded', 'derived', 0.0)
    amplitudes = judging.orders(found)[0]
    assert amplitudes[0] > 0.1
    assert amplitudes[1:].max() < 1e-3 * amplitudes[0]


@pytest.mark.slow
def test_a_motion_that_hops_at_256_steps_is_not_called_chaotic() -> None:
    """figure, K = 0.225 (Fig. 15e): 0.001 +- 0.0015 with located switches, +0.056 at 256 steps.

    The whole figure is surveyed: up to 4 trajectories run by other machine code and hop elsewhere.
    """
    diagram = DIAGRAMS['K_sections']
    points = diagram.points('figure', 1)
    at = [point.parameters.crack_stiffness_ratio for point in points].index(0.225)
    found = survey(points, diagram.plan(Settings()))
    assert found.label[at] != 'chaotic', found.reason[at]
    plan = dataclasses.replace(diagram.plan(Settings(check_steps=False)), steps_per_revolution=1024)
    finer = survey(points, plan)
    assert finer.exponent[at] < 3.0 * finer.standard_error[at]
    assert finer.label[at] != 'chaotic'
