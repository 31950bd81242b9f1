# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of the analysis commands; lengths dimensionless as in the paper."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from rotor_common.configuration import unit_of
from rotor_common.tapers import hann
from rotor_dynamics import LyapunovExponent, plots
from rotor_dynamics.plots import AXES, variant_text
from rotor_dynamics.surveys import HARMONICS
from rotor_sim.plant.parameters import RotorParameters

if TYPE_CHECKING:
    import xarray

Rows = Mapping[str, NDArray[Any]]
"""Arrays of a survey by name, and `values` of the parameter."""

EXPONENT_LABEL = r'largest Lyapunov exponent [per unit $\tau$]'


def canvas(title: str, width: float, height: float) -> Figure:
    """Return an empty figure of that size in inches, independent of pyplot."""
    figure = Figure(figsize=(width, height), layout='constrained')
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize='medium')
    return figure


def axis_of(over: str) -> tuple[str, float]:
    """Return label and factor from SI of a swept parameter."""
    if over in AXES:
        return AXES[over]
    unit = unit_of(RotorParameters.model_fields[over])
    return f'{over} [{unit}]' if unit != '1' else over, 1.0


def heading(what: str, asked: dict[str, Any], converged: bool | None = None) -> str:
    """Return the title of a picture: the diagram, the point and how it was computed."""
    variant = asked['parameters']['variant']
    point = [variant_text(variant)]
    usual = RotorParameters.hou2016(variant).model_dump()
    for name, value in asked['parameters'].items():
        if value != usual[name]:
            label, factor = axis_of(name) if isinstance(value, float) else (name, 1)
            what_is, _, unit = label.partition(' [')
            point.append(f'{what_is} = {value * factor:g} {unit.rstrip("]")}'.rstrip())
    if asked['speed_rad_s'] is not None:
        point.append(f'{asked["speed_rad_s"]:g} rad/s')
    if asked['load_factor'] is not None:
        point.append(f'G = {asked["load_factor"]:g}')
    run = [
        f'{asked["transient_revolutions"]} revolutions of transient',
        _recorded(asked),
        f'N = {asked["steps_per_revolution"]}',
    ]
    if asked.get('direction'):
        run.insert(0, _DIRECTIONS[asked['direction']])
    if not asked['check_steps']:
        run.append('not checked at 2N')
    if converged is False:
        run.append('NOT converged at 2N')
    return f'{what}: {", ".join(point)}\n{", ".join(run)}'


def _recorded(asked: dict[str, Any]) -> str:
    if asked['command'] == 'lyapunov':
        return f'{asked["exponent_revolutions"]} of the exponent'
    return f'{asked["revolutions"]} recorded'


_DIRECTIONS = {
    'fixed': 'the same start at every value',
    'up': 'continued upwards',
    'down': 'continued downwards',
}


def orbit_diagram(rows: Rows, asked: dict[str, Any]) -> Figure:
    """Return the stroboscopic Z and Y over the parameter."""
    label, factor = axis_of(asked['over'])
    figure = canvas(heading('Orbit diagram', asked), 8.0, 7.0)
    panels = figure.subplots(2, 1, sharex=True)
    for axes, name in zip(panels, 'zy', strict=True):
        plots.draw_orbit_diagram(
            axes,
            rows['values'] * factor,
            rows[name] / rows['length_scale_m'][:, None],
            _checked(rows, asked),
            legend=name == 'z',
        )
        axes.set_ylabel(_length(name))
    panels[-1].set_xlabel(label)
    return figure


def waterfall(rows: Rows, asked: dict[str, Any]) -> Figure:
    """Return the spectra of Z and Y over the parameter; over rad/s where the speed is swept."""
    label, factor = axis_of(asked['over'])
    by_speed = asked['over'] == 'speed_rad_s'
    # single precision, as the amplitudes: a fine sweep is large
    frequency = rows['orders'].astype(np.float32)
    if by_speed:
        frequency = np.outer(rows['speed_rad_s'].astype(np.float32), frequency)
    scale = rows['length_scale_m'].astype(np.float32)[:, None]
    figure = canvas(heading('Spectra (Hann window, zero-to-peak)', asked), 12.0, 5.8)
    for number, name in enumerate('zy', start=1):
        axes = figure.add_subplot(1, 2, number, projection='3d')
        plots.draw_waterfall(
            axes,
            frequency,
            rows['values'] * factor,
            rows[f'amplitude_{name}'] / scale,
            _checked(rows, asked),
            highest=2.0 * rows['speed_rad_s'].max() if by_speed else HIGHEST_ORDER,
            legend=name == 'z',
        )
        axes.set_xlabel('frequency [rad/s]' if by_speed else 'order')
        axes.set_ylabel(label)
        axes.set_zlabel(f'amplitude of {_length(name)}')
    return figure


def lyapunov_diagram(rows: Rows, asked: dict[str, Any]) -> Figure:
    """Return the largest exponent over the parameter."""
    label, factor = axis_of(asked['over'])
    figure = canvas(heading('Largest Lyapunov exponent', asked), 8.0, 4.5)
    axes = figure.subplots()
    plots.draw_exponents(
        axes,
        rows['values'] * factor,
        rows['exponent'],
        rows['standard_error'],
        _checked(rows, asked),
    )
    axes.set_xlabel(label)
    axes.set_ylabel(EXPONENT_LABEL + '\nshaded: 2 standard errors')
    return figure


def lyapunov_exponent(
    result: LyapunovExponent, asked: dict[str, Any], converged: bool | None
) -> Figure:
    """Return the running estimate of one exponent with its final standard error."""
    figure = canvas(heading('Largest Lyapunov exponent', asked, converged), 8.0, 4.5)
    axes = figure.subplots()
    revolutions = np.arange(1.0, result.running.size + 1.0)
    error = np.full(revolutions.size, result.standard_error)
    plots.draw_exponents(axes, revolutions, result.running, error, legend=False)
    settled = result.running[result.running.size // 10 :]
    if np.isfinite(settled).all():
        low, high = min(settled.min(), 0.0), max(settled.max(), 0.0)
        margin = 0.1 * (high - low) + 3.0 * result.standard_error
        axes.set_ylim(low - margin, high + margin)
    axes.set_xlabel('revolutions')
    axes.set_ylabel('running estimate [per unit $\\tau$]\nshaded: 2 final standard errors')
    title = f'{result.exponent:.5f} $\\pm$ {result.standard_error:.5f}'
    if not np.isfinite(result.exponent):
        left = result.diverged_at
        title = 'no exponent' if left is None else f'no exponent: diverged in revolution {left}'
    axes.set_title(title, fontsize='small', loc='left')
    return figure


def poincare_section(
    result: 'xarray.Dataset', label: str, asked: dict[str, Any], converged: bool | None
) -> Figure:
    """Return orbit, phase portrait, section and spectrum of one motion."""
    figure = canvas(heading(f'{label} motion', asked, converged), 9.0, 8.0)
    orbit, portrait, section, spectrum = figure.subplots(2, 2).ravel()
    length_scale_m = result.length_scale_m.item()
    y, z, velocity = _path(result, asked['speed_rad_s'])
    plots.draw_orbit(orbit, z, y)
    plots.draw_orbit(portrait, z, velocity)
    plots.draw_section(section, result.z.values / length_scale_m, result.y.values / length_scale_m)
    plots.draw_spectrum(
        spectrum, *spectrum_of(result.orbit_z.values / length_scale_m), highest=HIGHEST_ORDER
    )
    for axes, title, across, up in (
        (orbit, 'orbit', _length('z'), _length('y')),
        (portrait, 'phase portrait', _length('z'), r"Z' = dZ/d$\tau$"),
        (section, r'section at $\tau = 2\pi n$', _length('z'), _length('y')),
        (spectrum, 'spectrum (Hann window, zero-to-peak)', 'order', f'amplitude of {_length("z")}'),
    ):
        axes.set_title(title, fontsize='small')
        axes.set_xlabel(across)
        axes.set_ylabel(up)
    return figure


HIGHEST_ORDER = 6.0
"""Highest order shown in spectra."""

SHOWN_REVOLUTIONS = 40
"""Revolutions of a motion's path; more would fill the picture."""

_ORBIT = ('y', 'z', 'velocity_y', 'velocity_z')


def _path(
    result: 'xarray.Dataset', speed_rad_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return Y, Z and Z' of the last revolutions, interpolated smoothly between the samples."""
    samples = result.orbit_y.shape[1]
    last = slice(-SHOWN_REVOLUTIONS * samples, None)
    orbit = {name: result[f'orbit_{name}'].values.ravel()[last] for name in _ORBIT}
    place = np.stack([orbit['y'], orbit['z']], axis=1)
    speed = np.stack([orbit['velocity_y'], orbit['velocity_z']], axis=1)
    tau = np.arange(len(place)) * (2.0 * np.pi / samples)
    if not np.isfinite(place).all():
        nothing = np.full(len(place), np.nan)
        return nothing, nothing, nothing
    path = CubicHermiteSpline(tau, place, speed / speed_rad_s)
    fine = np.linspace(tau[0], tau[-1], 4 * len(tau))
    scale = result.length_scale_m.item()
    shown = path(fine) / scale
    return shown[:, 0], shown[:, 1], path(fine, 1)[:, 1] / scale


def spectrum_of(turns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return orders and zero-to-peak amplitudes of samples (revolutions, samples a revolution)."""
    samples = turns.ravel()
    window = hann(samples.size)
    amplitude = np.abs(np.fft.rfft((samples - samples.mean()) * window)) / (0.5 * window.sum())
    return np.fft.rfftfreq(samples.size, 1.0 / turns.shape[1]), amplitude


def sections(rows: Rows, asked: dict[str, Any]) -> Figure:
    """Return the Poincare sections (Z, Y) at every value of the parameter."""
    label, factor = axis_of(asked['over'])
    name, _, unit = label.partition(' [')
    columns = min(4, math.ceil(math.sqrt(len(rows['values']))))
    lines = math.ceil(len(rows['values']) / columns)
    figure = canvas(heading('Poincare sections', asked), 3.0 * columns, 2.8 * lines + 0.7)
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    checked = _checked(rows, asked)
    for number, axes in enumerate(panels):
        if number >= len(rows['values']):
            axes.set_axis_off()
            continue
        scale = rows['length_scale_m'][number]
        good = checked is None or bool(checked[number])
        colour = plots.BLUE if good else plots.ORANGE
        plots.draw_section(
            axes, rows['z'][number] / scale, rows['y'][number] / scale, colour=colour
        )
        value = f'{name} = {rows["values"][number] * factor:g} {unit.rstrip("]")}'.rstrip()
        note = '' if good or rows['label'][number] == 'diverged' else ' (not converged at 2N)'
        axes.set_title(f'{value}\n{rows["label"][number]}{note}', fontsize='small')
        axes.set_xlabel('Z')
        axes.set_ylabel('Y')
    return figure


def parameter_map(result: 'xarray.Dataset', asked: dict[str, Any]) -> Figure:
    """Return the exponent and the largest super-harmonic of Z over two parameters.

    Dots mark points that do not converge at 2N steps; diverged points are white.
    """
    figure = canvas(heading('Map', asked), 12.0, 5.0)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    over = [str(name) for name in result.label.dims]
    (across, x_factor), (up, y_factor) = (axis_of(name) for name in over)
    x, y = result[over[0]].values * x_factor, result[over[1]].values * y_factor
    exponent, scale = result.exponent.values, result.length_scale_m.values
    higher = result.order_amplitude_z.values[..., 1 : len(HARMONICS)].max(axis=-1) / scale
    finite = exponent[np.isfinite(exponent)]
    limit = float(np.abs(finite).max()) if finite.size else 1.0
    for axes, values, label, colours in (
        (
            panels[0],
            exponent,
            EXPONENT_LABEL,
            {'cmap': 'RdBu_r', 'vmin': -limit, 'vmax': limit},
        ),
        (
            panels[1],
            higher,
            f'largest super-harmonic (2x to 4x) of {_length("z")}',
            {'cmap': 'viridis'},
        ),
    ):
        mesh = axes.pcolormesh(x, y, values.T, shading='nearest', rasterized=True, **colours)
        figure.colorbar(mesh, ax=axes, label=label)
        if asked['check_steps']:
            row, column = np.nonzero((~result.converged & (result.label != 'diverged')).values)
            axes.plot(x[row], y[column], '.', color='black', markersize=1.5)
        axes.set_xlabel(across)
    panels[0].set_ylabel(up)
    return figure


def _length(name: str) -> str:
    return rf'{name.upper()} = {name}/$\delta$'


def _checked(rows: Rows, asked: dict[str, Any]) -> Any:
    return rows['converged'] if asked['check_steps'] else None
