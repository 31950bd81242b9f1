# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Diagrams show every number where it belongs, and count what must not be read like the rest."""

from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from rotor_dynamics import plots
from rotor_sim.plant.parameters import VARIANTS

X = np.linspace(0.0, 0.3, 6)
CONVERGED = np.array([True, True, False, True, True, False])
RNG = np.random.default_rng(1)


@pytest.fixture
def figure() -> Figure:
    figure = Figure(layout='constrained')
    FigureCanvasAgg(figure)
    return figure


def drawn(figure: Figure) -> Figure:
    """Draw it: warnings are errors."""
    figure.canvas.draw()
    return figure


def dots(axes: Any, colour: str) -> set[tuple[float, float]]:
    return {
        point
        for line in axes.lines
        if line.get_marker() == 'o' and to_rgba(line.get_color()) == to_rgba(colour)
        for point in zip(*(np.asarray(part).tolist() for part in line.get_data()), strict=True)
    }


def legend(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []


def test_an_orbit_diagram_has_every_point_in_the_colour_of_its_convergence(figure: Figure) -> None:
    section = RNG.normal(size=(6, 4))
    section[1] = np.nan
    axes = figure.subplots()
    plots.draw_orbit_diagram(axes, X, section, CONVERGED)
    drawn(figure)
    good, bad = [0, 3, 4], [2, 5]
    for rows, colour in ((good, plots.BLUE), (bad, plots.ORANGE)):
        assert dots(axes, colour) == {(X[row], value) for row in rows for value in section[row]}
    assert legend(axes) == [
        '2 of 6 values not converged at 2N steps',
        '1 of 6 values diverged',
    ]
    assert axes.get_xlim() == (0.0, 0.3)


def test_what_was_not_checked_is_not_called_unconverged(figure: Figure) -> None:
    axes = figure.subplots()
    plots.draw_orbit_diagram(axes, X, RNG.normal(size=(6, 4)))
    drawn(figure)
    assert legend(axes) == []
    assert not dots(axes, plots.ORANGE)


def test_exponents_have_a_band_and_gaps(figure: Figure) -> None:
    exponent = np.array([-0.01, np.nan, 0.02, 0.0, 0.01, -0.01])
    error = np.full(6, 0.002)
    axes = figure.subplots()
    plots.draw_exponents(axes, X, exponent, error, CONVERGED)
    drawn(figure)
    assert dots(axes, plots.ORANGE) == {(X[2], 0.02), (X[5], -0.01)}
    assert legend(axes) == ['2 of 6 values not converged at 2N steps', '1 of 6 values diverged']
    corners = np.concatenate([path.vertices for path in axes.collections[0].get_paths()])
    assert corners[:, 1].max() == pytest.approx(0.024)  # two standard errors


def test_a_waterfall_shows_the_highest_amplitude_and_no_frequency_beyond(figure: Figure) -> None:
    frequency = np.arange(50.0)
    amplitude = RNG.random((6, 50))
    amplitude[3, 7] = 3.0
    amplitude[4, 30] = 9.0  # beyond
    amplitude[0] = np.nan
    axes = figure.add_subplot(projection='3d')
    plots.draw_waterfall(axes, frequency, X, amplitude, CONVERGED, highest=20.0)
    drawn(figure)
    assert axes.get_zlim()[1] == pytest.approx(3.0, rel=0.1)
    assert axes.get_xlim()[1] == pytest.approx(20.0, rel=0.1)
    (text,) = axes.texts
    assert text.get_text().splitlines() == [
        '2 of 6 values not converged at 2N steps',
        '1 of 6 values diverged',
    ]


def test_the_limits_of_a_waterfall_do_not_come_from_unset_memory(
    figure: Figure, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Lines of different length leave part of matplotlib's array of corners unset."""
    unset = np.empty

    def garbage(shape: Any, *arguments: Any, **options: Any) -> Any:
        array = unset(shape, *arguments, **options)
        if array.dtype == np.float64:
            array[...] = np.where(np.arange(array.size).reshape(array.shape) % 2, 1e308, -1e308)
        return array

    monkeypatch.setattr(np, 'empty', garbage)
    axes = figure.add_subplot(projection='3d')
    frequency = X[:, None] * np.arange(50.0)
    plots.draw_waterfall(axes, frequency, X, RNG.random((6, 50)), highest=8.0)
    drawn(figure)
    assert axes.get_xlim()[1] == pytest.approx(8.0, rel=0.1)
    assert axes.get_ylim()[1] == pytest.approx(0.3, rel=0.1)


def test_a_waterfall_of_many_values_shows_some_of_them(figure: Figure) -> None:
    axes = figure.add_subplot(projection='3d')
    plots.draw_waterfall(axes, np.arange(9.0), np.arange(400.0), RNG.random((400, 9)))
    drawn(figure)
    lines = len(axes.collections[0].get_facecolor())
    assert lines <= plots.WATERFALL_LINES
    assert axes.get_ylim()[1] >= 399.0


def test_nothing_but_nan_is_said_to_have_diverged(figure: Figure) -> None:
    nothing = np.full((3, 4), np.nan)
    first, second, third, fourth, fifth = figure.subplots(1, 5)
    plots.draw_orbit_diagram(first, X[:3], nothing, CONVERGED[:3])
    plots.draw_exponents(second, X[:3], nothing[:, 0], nothing[:, 0], CONVERGED[:3])
    plots.draw_section(third, nothing, nothing)
    plots.draw_orbit(fourth, nothing, nothing)
    plots.draw_spectrum(fifth, np.arange(4.0), nothing[0])
    drawn(figure)
    assert legend(first) == legend(second) == ['3 of 3 values diverged']
    assert [axes.texts[0].get_text() for axes in (third, fourth, fifth)] == ['diverged'] * 3


def test_a_waterfall_of_nothing_can_be_drawn(figure: Figure) -> None:
    axes = figure.add_subplot(projection='3d')
    plots.draw_waterfall(axes, np.arange(4.0), X[:3], np.full((3, 4), np.nan))
    drawn(figure)


def test_one_value_has_an_axis(figure: Figure) -> None:
    axes = figure.subplots()
    plots.draw_orbit_diagram(axes, X[:1], RNG.normal(size=(1, 4)))
    drawn(figure)
    low, high = axes.get_xlim()
    assert low < X[0] < high


@pytest.mark.parametrize('variant', VARIANTS)
def test_only_the_figures_variants_are_called_reconstructions(variant: str) -> None:
    marked = 'empirical reconstruction' in plots.variant_text(variant)
    assert marked == variant.startswith('figure')
