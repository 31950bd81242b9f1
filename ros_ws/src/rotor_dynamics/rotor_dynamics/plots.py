# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Drawing one diagram of an analysis into one matplotlib axes, from plain arrays.

Nothing here keeps a state of pyplot, scales a value or sets an axis label: `AXES` has the labels
and scales. What does not converge at twice the steps is drawn in `ORANGE` and counted in the
legend, what diverged (a row with NaN) is a cross on the lower edge, counted as well.
"""

from typing import Any

import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]
BoolArray = NDArray[np.bool_]

MICRO = '\N{GREEK SMALL LETTER MU}'
BLUE, ORANGE, GREY = '#0072b2', '#d55e00', '#8a8a8a'

AXES = {
    'speed_rad_s': ('speed [rad/s]', 1.0),
    'load_factor': ('load factor G', 1.0),
    'crack_stiffness_ratio': ('crack stiffness ratio K', 1.0),
    'clearance_m': (f'clearance [{MICRO}m]', 1e6),
    'eccentricity_m': (f'eccentricity e [{MICRO}m]', 1e6),
}
"""Axis label and factor from SI for the parameters that the paper sweeps."""

RECONSTRUCTION = 'empirical reconstruction'
"""Note on pictures of the variants `figure` and `figure_chaos`."""

WATERFALL_LINES = 60
"""More lines than this hide each other; a waterfall with more values shows every k-th."""


def variant_text(variant: str) -> str:
    """Return the variant as a picture names it; the `figure` ones are marked as reconstructions."""
    return f'{variant} ({RECONSTRUCTION})' if variant.startswith('figure') else variant


def draw_orbit_diagram(
    axes: Any,
    x: FloatArray,
    section: FloatArray,
    converged: BoolArray | None = None,
    *,
    colour: str = BLUE,
    label: str | None = None,
    size: float = 1.2,
    legend: bool = True,
) -> None:
    """Draw the stroboscopic positions over a parameter.

    `x` (n,) and `section` (n, revolutions) in the units to show; `converged` (n,), None where it
    was not checked. `label` names a second or third sweep in the same axes.
    """
    good = np.isfinite(section).all(axis=1)
    bad = good & ~converged if converged is not None else np.zeros_like(good)
    for rows, dots in ((good & ~bad, colour), (bad, ORANGE)):
        axes.plot(
            np.repeat(x[rows], section.shape[1]),
            section[rows].ravel(),
            linestyle='none',
            marker='o',
            markersize=size,
            markeredgewidth=0.0,
            color=dots,
            rasterized=True,
        )
    if label:
        _key(axes, colour, label)
    _mark(axes, x, bad, ~good, legend=legend)


def draw_exponents(
    axes: Any,
    x: FloatArray,
    exponent: FloatArray,
    standard_error: FloatArray,
    converged: BoolArray | None = None,
    *,
    colour: str = BLUE,
    label: str | None = None,
    legend: bool = True,
) -> None:
    """Draw the largest Lyapunov exponent (per unit tau) over x, two standard errors shaded.

    All arrays (n,). With `x` = revolutions it draws a running estimate.
    """
    good = np.isfinite(exponent)
    bad = good & ~converged if converged is not None else np.zeros_like(good)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    band = 2.0 * np.where(np.isfinite(standard_error), standard_error, 0.0)
    axes.fill_between(x, exponent - band, exponent + band, color=colour, alpha=0.25, linewidth=0)
    axes.plot(x, exponent, color=colour, linewidth=0.9, label=label)
    axes.plot(x[bad], exponent[bad], 'o', markersize=2.5, color=ORANGE)
    _mark(axes, x, bad, ~good, legend=legend)


def draw_waterfall(
    axes: Any,
    frequency: FloatArray,
    x: FloatArray,
    amplitude: FloatArray,
    converged: BoolArray | None = None,
    *,
    highest: float | None = None,
    colour: str = BLUE,
    legend: bool = True,
) -> None:
    """Draw spectra behind each other, frequency to the right, the parameter into the depth.

    `axes` is a 3-D axes; `frequency` (n_b,) or (n, n_b), `x` (n,), `amplitude` (n, n_b), in the
    units to show. Shows frequencies up to `highest`, and at most WATERFALL_LINES lines.
    """
    frequency = np.broadcast_to(frequency, amplitude.shape)
    highest = float(frequency.max()) if highest is None else highest
    good = np.isfinite(amplitude).all(axis=1)
    bad = good & ~converged if converged is not None else np.zeros_like(good)
    shown = np.flatnonzero(good)[:: max(1, -(-int(good.sum()) // WATERFALL_LINES))]
    curtains, colours = [], []
    for row in shown[np.argsort(-x[shown])]:
        part = frequency[row] <= highest
        across, up = frequency[row, part], amplitude[row, part]
        across = np.concatenate([across[:1], across, across[-1:]])
        up = np.concatenate([[0.0], up, [0.0]])
        curtains.append(np.column_stack([across, np.full(across.size, x[row]), up]))
        colours.append(ORANGE if bad[row] else colour)
    axes.add_collection3d(
        Poly3DCollection(
            _of_one_length(curtains), facecolors='white', edgecolors=colours, linewidths=0.4
        )
    )
    axes.set_xlim(0.0, highest)
    axes.set_ylim(*_span(x))
    axes.set_zlim(0.0, max((float(line[:, 2].max()) for line in curtains), default=0.0) or 1.0)
    axes.view_init(elev=35.0, azim=-65.0)
    axes.set_box_aspect((1.4, 1.2, 0.8), zoom=0.95)
    axes.zaxis.set_major_formatter('{x:.3g}')
    axes.grid(visible=False)
    counted = _counts(bad, ~good)
    if legend and counted:
        axes.text2D(
            0.02, 0.98, '\n'.join(counted), transform=axes.transAxes, va='top', color=ORANGE
        )


def _of_one_length(lines: list[FloatArray]) -> list[FloatArray]:
    """Return the lines (n, 3) with points repeated, evenly, until all are as long as the longest.

    matplotlib would compute with uninitialised memory after the end of shorter lines.
    """
    longest = max(map(len, lines), default=0)
    return [line[np.linspace(0, len(line) - 1, longest).round().astype(int)] for line in lines]


def draw_section(
    axes: Any,
    horizontal: FloatArray,
    vertical: FloatArray,
    *,
    colour: str = BLUE,
    size: float = 2.0,
) -> None:
    """Draw the points of a Poincare section, any shape, in the units to show."""
    axes.plot(
        horizontal.ravel(),
        vertical.ravel(),
        linestyle='none',
        marker='o',
        markersize=size,
        markeredgewidth=0.0,
        color=colour,
    )
    _say_if_empty(axes, horizontal)


def draw_orbit(
    axes: Any,
    horizontal: FloatArray,
    vertical: FloatArray,
    *,
    colour: str = BLUE,
    width: float = 0.4,
) -> None:
    """Draw a path, of an orbit, a phase portrait or over time; any shape, in the units to show."""
    axes.plot(horizontal.ravel(), vertical.ravel(), color=colour, linewidth=width)
    _say_if_empty(axes, horizontal)


def draw_spectrum(
    axes: Any,
    frequency: FloatArray,
    amplitude: FloatArray,
    *,
    highest: float | None = None,
    colour: str = BLUE,
) -> None:
    """Draw one amplitude spectrum, (n_b,) each, up to the frequency `highest`."""
    part = frequency <= (np.inf if highest is None else highest)
    axes.plot(frequency[part], amplitude[part], color=colour, linewidth=0.8)
    axes.set_xlim(0.0, float(frequency[part].max()))
    axes.set_ylim(bottom=0.0)
    _say_if_empty(axes, amplitude)


def _span(x: FloatArray) -> tuple[float, float]:
    """Return the limits of an axis; 1 wide if there is a single value."""
    low, high = float(x.min()), float(x.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _counts(bad: BoolArray, diverged: BoolArray) -> list[str]:
    """Return the legend's texts about values that did not converge or diverged."""
    return [
        f'{int(rows.sum())} of {rows.size} values {what}'
        for rows, what in ((bad, 'not converged at 2N steps'), (diverged, 'diverged'))
        if rows.any()
    ]


def _mark(axes: Any, x: FloatArray, bad: BoolArray, diverged: BoolArray, *, legend: bool) -> None:
    """Mark the diverged values on the lower edge and count them and the `bad` ones."""
    if diverged.any():
        (crosses,) = axes.plot(
            x[diverged],
            np.zeros(int(diverged.sum())),
            'x',
            markersize=3.5,
            color=ORANGE,
            transform=axes.get_xaxis_transform(),
            clip_on=False,
        )
        crosses.set_in_layout(False)
    for text in _counts(bad, diverged):
        _key(axes, ORANGE, text, marker='x' if 'diverged' in text else 'o')
    axes.set_xlim(*_span(x))
    if legend and axes.get_legend_handles_labels()[1]:
        axes.legend(loc='best', fontsize='small', frameon=True, framealpha=0.85, edgecolor='none')


def _key(axes: Any, colour: str, text: str, marker: str = 'o') -> None:
    """Add a line to the legend whose mark is large enough to be seen."""
    axes.plot([], [], marker, markersize=4.0, color=colour, label=text)


def _say_if_empty(axes: Any, values: FloatArray) -> None:
    if not np.isfinite(values).any():
        axes.text(0.5, 0.5, 'diverged', transform=axes.transAxes, ha='center', color=ORANGE)
