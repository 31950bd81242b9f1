# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Plot the figures: one picture per figure and variant, panels as in the paper.

Lengths are dimensionless, Y = y/delta and Z = z/delta; tau = speed times time. Grey dashes and
grey bands show the paper's outer ticks and thresholds where the facts have them.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Rectangle

from rotor_dynamics import Survey, plots
from rotor_paper import judging
from rotor_paper.figures import (
    HIGHEST_FREQUENCY_RAD_S,
    RECONSTRUCTION,
    RECONSTRUCTIONS,
    Figure,
    Panel,
)
from rotor_paper.judging import FloatArray, Results

PANEL_INCHES = {1: (8.0, 5.0), 2: (5.6, 3.9), 4: (3.6, 3.4)}
"""Width and height of a panel, by the columns of the layout."""

DOTS_PER_INCH = 110

MOST_WIDENED = 3.0
"""How many times wider a section may be drawn for the paper's ticks to be in the picture."""

FREQUENCIES = np.linspace(0.0, HIGHEST_FREQUENCY_RAD_S, 501)
"""Bins of a waterfall, rad/s: 3 rad/s, about the resolution of 300 revolutions at 1000 rad/s."""

UP, DOWN = '#8fbfe0', '#f0b98d'
"""Light colours of the up- and the down-sweep behind the fixed start."""

NAIVE = '#9a7fb5'
"""Colour of the exponents without saltation: the tangent does not jump where f does."""


def variant_title(variant: str) -> str:
    """Return a variant as every picture and table names it."""
    note = f' ({RECONSTRUCTION})' if variant in RECONSTRUCTIONS else ''
    return f'variant {variant}{note}'


def draw(figure: Figure, results: Results, variant: str) -> Canvas:
    """Return the picture of a figure from the results of one variant."""
    rows = -(-len(figure.panels) // figure.columns)
    width, height = PANEL_INCHES[figure.columns]
    width, height = width * figure.columns, height * rows + 0.8
    canvas = Canvas(figsize=(width, height), dpi=DOTS_PER_INCH)
    FigureCanvasAgg(canvas)
    canvas.subplots_adjust(
        left=0.7 / width,
        right=1.0 - 0.25 / width,
        bottom=0.5 / height,
        top=1.0 - 1.15 / height,
        wspace=0.22,
        hspace=0.3,
    )
    canvas.suptitle(
        f'Fig. {figure.number}: {figure.title}\n{variant_title(variant)}', fontsize='medium'
    )
    for number, panel in enumerate(figure.panels):
        projection = '3d' if panel.kind == 'waterfall' else None
        axes = canvas.add_subplot(rows, figure.columns, number + 1, projection=projection)
        _DRAW[panel.kind](axes, panel, results)
        axes.tick_params(labelsize='x-small')
        rows_above = _legend(axes)
        axes.set_title(
            f'({"abcdefgh"[number]}) {panel.caption}',
            fontsize='small',
            loc='left',
            pad=6.0 + 11.0 * rows_above,
        )
    return canvas


def _legend(axes: Any) -> int:
    """Put the legend above the axes, where it hides nothing; return its number of rows."""
    entries = len(axes.get_legend_handles_labels()[1])
    columns = 3 if entries <= 3 else 2
    if entries:
        axes.legend(
            loc='lower right',
            bbox_to_anchor=(1.0, 1.0),
            ncols=columns,
            fontsize='x-small',
            frameon=False,
            borderaxespad=0.1,
            columnspacing=1.0,
            handletextpad=0.3,
            labelspacing=0.2,
        )
    for text in axes.texts:
        text.set_fontsize('x-small')
    return -(-entries // columns)


def save(canvas: Canvas, folder: Path, name: str) -> None:
    """Write a picture as PNG and as SVG; in the SVG, curves and points are an image."""
    for axes in canvas.axes:
        for artist in (*axes.lines, *axes.collections):
            artist.set_rasterized(True)
    canvas.savefig(folder / f'{name}.png')
    canvas.savefig(folder / f'{name}.svg', metadata={'Date': None})


def converged(survey: Survey) -> Any:
    """Return which points converged at 2N steps, None where that was not checked."""
    return survey.converged if survey.plan.check_steps else None


def _swept(axes: Any, panel: Panel, results: Results) -> FloatArray:
    """Label the horizontal axis and return the swept parameter in its unit."""
    label, scale = plots.AXES[results.diagrams[panel.diagram].over]
    axes.set_xlabel(label, fontsize='small')
    if panel.mark_x is not None:
        axes.axvline(panel.mark_x * scale, color=plots.GREY, linestyle='--', linewidth=0.8)
    return results.swept(panel.diagram) * scale


def _orbit_diagram(axes: Any, panel: Panel, results: Results) -> None:
    survey = results.surveys[panel.diagram]
    x = _swept(axes, panel, results)
    sweeps = results.sweeps.get(panel.diagram)
    if sweeps is not None:
        for z, colour, label in ((sweeps.up, UP, 'up-sweep'), (sweeps.down, DOWN, 'down-sweep')):
            plots.draw_orbit_diagram(
                axes, sweeps.values, z, colour=colour, label=label, size=2.5, legend=False
            )
    z = judging.section(survey, panel.coordinate)
    plots.draw_orbit_diagram(axes, x, z, converged(survey), size=1.0, legend=False)
    axes.set_ylabel(f'{panel.coordinate.upper()} at tau = 2 pi n', fontsize='small')


def _waterfall(axes: Any, panel: Panel, results: Results) -> None:
    survey = results.surveys[panel.diagram]
    label, scale = plots.AXES[results.diagrams[panel.diagram].over]
    plots.draw_waterfall(
        axes,
        FREQUENCIES,
        results.swept(panel.diagram) * scale,
        peaks(survey, panel.coordinate),
        converged(survey),
        highest=float(FREQUENCIES[-1]),
    )
    axes.set_xlabel('frequency [rad/s]', fontsize='small')
    axes.set_ylabel(label, fontsize='small')
    axes.set_zlabel(f'amplitude of {panel.coordinate.upper()}', fontsize='small')


def peaks(survey: Survey, coordinate: str) -> Any:
    """Return the spectra on the grid `FREQUENCIES`, (n, bins): the largest amplitude in each bin.

    A picture has fewer columns than a spectrum has lines; no line is lost. Between lines that
    are wider apart than bins it is interpolated; zero beyond the end of a spectrum.
    """
    made = np.zeros((len(survey.points), FREQUENCIES.size))
    for row, (point, amplitude) in enumerate(
        zip(survey.points, amplitudes(survey, coordinate), strict=True)
    ):
        frequency = survey.orders * point.speed_rad_s
        shown = frequency <= FREQUENCIES[-1]
        made[row] = np.interp(FREQUENCIES, frequency, amplitude, right=0.0)
        bins = np.rint(frequency[shown] / FREQUENCIES[1]).astype(np.intp)
        np.maximum.at(made[row], bins, amplitude[shown])
    return made


def amplitudes(survey: Survey, coordinate: str) -> Any:
    """Return the dimensionless spectra, (n, n_b)."""
    amplitude = survey.amplitude_z if coordinate == 'z' else survey.amplitude_y
    return amplitude / survey.length_scale_m[:, None].astype(amplitude.dtype)


def _exponents(axes: Any, panel: Panel, results: Results) -> None:
    survey = results.surveys[panel.diagram]
    x = _swept(axes, panel, results)
    if panel.ticks_y is not None:
        axes.axhspan(*panel.ticks_y, color='#efefef', zorder=0, label="paper's ticks")
    if np.isfinite(survey.naive_exponent).any():
        axes.plot(x, survey.naive_exponent, color=NAIVE, linewidth=0.8, label='without saltation')
    plots.draw_exponents(
        axes, x, survey.exponent, survey.standard_error, converged(survey), legend=False
    )
    axes.set_ylabel('exponent per unit tau', fontsize='small')


def _series(axes: Any, panel: Panel, results: Results) -> None:
    path = results.paths[panel.diagram][panel.index]
    shown = (path.tau >= path.window[0]) & (path.tau <= path.window[1])
    plots.draw_orbit(axes, path.tau[shown], path.z[shown], width=0.8)
    for tick in panel.ticks_y or ():
        axes.axhline(tick, color=plots.GREY, linestyle='--', linewidth=0.8)
    axes.set_xlim(*path.window)
    axes.set_xlabel('tau', fontsize='small')
    axes.set_ylabel('Z', fontsize='small')


def _portrait(axes: Any, panel: Panel, results: Results) -> None:
    path = results.paths[panel.diagram][panel.index]
    plots.draw_orbit(axes, path.z, path.y)
    _plane(axes, panel)


def _section(axes: Any, panel: Panel, results: Results) -> None:
    survey = results.surveys[panel.diagram]
    y, z = (judging.section(survey, coordinate)[panel.index] for coordinate in 'yz')
    settled = not survey.plan.check_steps or bool(survey.converged[panel.index])
    plots.draw_section(axes, z, y, colour=plots.BLUE if settled else plots.ORANGE)
    label = str(survey.label[panel.index])
    text = label if settled or label == 'diverged' else f'{label}, not converged at 2N steps'
    axes.text(0.02, 0.97, text, transform=axes.transAxes, va='top', fontsize='x-small')
    axes.margins(y=0.12)
    _plane(axes, panel)


def _plane(axes: Any, panel: Panel) -> None:
    """Label the plane (Z, Y) and frame the paper's ticks in it, or say where they are."""
    axes.set_xlabel('Z', fontsize='small')
    axes.set_ylabel('Y', fontsize='small')
    if panel.ticks_x is None or panel.ticks_y is None:
        return
    (left, right), (low, high) = panel.ticks_x, panel.ticks_y
    frame = Rectangle(
        (left, low),
        right - left,
        high - low,
        fill=False,
        edgecolor=plots.GREY,
        linestyle='--',
        linewidth=0.8,
    )
    own = axes.get_xlim(), axes.get_ylim()
    wider = max(
        (max(span[1], last) - min(span[0], first)) / (span[1] - span[0])
        for span, first, last in ((own[0], left, right), (own[1], low, high))
    )
    axes.add_patch(frame)
    if wider <= MOST_WIDENED:
        axes.autoscale_view()
        return
    axes.set(xlim=own[0], ylim=own[1])
    text = f"the paper's ticks: Z {left:g} to {right:g}, Y {low:g} to {high:g}"
    axes.text(0.98, 0.03, text, transform=axes.transAxes, ha='right', color=plots.GREY)


def _spectrum(axes: Any, panel: Panel, results: Results) -> None:
    survey = results.surveys[panel.diagram]
    frequency = survey.orders * survey.points[panel.index].speed_rad_s
    amplitude = amplitudes(survey, panel.coordinate)[panel.index]
    plots.draw_spectrum(axes, frequency, amplitude, highest=HIGHEST_FREQUENCY_RAD_S)
    axes.set_xlim(0.0, HIGHEST_FREQUENCY_RAD_S)
    axes.set_xlabel('frequency [rad/s]', fontsize='small')
    axes.set_ylabel(f'amplitude of {panel.coordinate.upper()}', fontsize='small')


_DRAW = {
    'orbit_diagram': _orbit_diagram,
    'waterfall': _waterfall,
    'exponents': _exponents,
    'series': _series,
    'portrait': _portrait,
    'section': _section,
    'spectrum': _spectrum,
}
