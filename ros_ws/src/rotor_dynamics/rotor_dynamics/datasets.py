# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Results as `xarray.Dataset`: every variable with its dimensions, unit and one sentence."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics.ensemble import OperatingPoint
from rotor_dynamics.surveys import HARMONICS, Survey

if TYPE_CHECKING:
    import xarray

Axis = tuple[str, NDArray[np.float64], Mapping[str, str]]
"""A coordinate: dimension, values, attrs."""

ABOUT_A_MOTION = ('label', 'reason', 'diverged_at', 'difference', 'converged')

_SECTION, _ORDER, _PLACE = ('revolution',), ('order',), ('harmonic',)
_AMPLITUDE = 'zero-to-peak amplitude (Hann window, mean removed) of the disk along'
_QUANTITIES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    'y': ('m', 'displacement y of the disk at tau = 2 pi j', _SECTION),
    'z': ('m', 'displacement z of the disk at tau = 2 pi j', _SECTION),
    'velocity_y': ('m/s', 'velocity of the disk along y at tau = 2 pi j', _SECTION),
    'velocity_z': ('m/s', 'velocity of the disk along z at tau = 2 pi j', _SECTION),
    'amplitude_y': ('m', f'{_AMPLITUDE} y', _ORDER),
    'amplitude_z': ('m', f'{_AMPLITUDE} z', _ORDER),
    'order_amplitude_y': ('m', f'{_AMPLITUDE} y at an order', _PLACE),
    'order_amplitude_z': ('m', f'{_AMPLITUDE} z at an order', _PLACE),
    'exponent': ('1', 'largest Lyapunov exponent per unit tau', ()),
    'standard_error': ('1', 'standard error of the exponent per unit tau', ()),
    'exponent_difference': ('1', 'change of the exponent with twice the steps', ()),
    'label': ('1', 'kind of motion', ()),
    'reason': ('1', 'why the motion is undecided or diverged', ()),
    'converged': ('1', 'whether twice the steps give the same', ()),
    'steps_per_revolution': ('1', 'steps a revolution', ()),
    'length_scale_m': ('m', 'static deflection, the length scale of Hou et al. (2016)', ()),
    'diverged_at': ('1', 'revolution in which the motion left the model', ()),
    'difference': ('1', 'largest relative change of means and amplitudes with twice the steps', ()),
}
"""Unit, description, and the dimensions besides those of the sweep."""


def _about(name: str) -> dict[str, str]:
    unit, text, _ = _QUANTITIES[name]
    return {'units': unit, 'long_name': text}


def survey_dataset(
    found: Survey, names: Sequence[str], axes: Sequence[Axis], **attrs: str
) -> 'xarray.Dataset':
    """Return arrays of a survey and its length scale over a sweep's axis, else over `point`."""
    import xarray  # noqa: PLC0415 - slow

    over = axes[0][0] if axes else 'point'
    names = (*names, 'length_scale_m')
    variables = {
        name: ((over, *_QUANTITIES[name][2]), getattr(found, name), _about(name)) for name in names
    }
    dims = {dim for dims, _, _ in variables.values() for dim in dims}
    known = {
        'revolution': ('1', 'recorded revolution j', np.arange(found.plan.revolutions)),
        'order': ('1', 'multiple of the speed', found.orders),
        'harmonic': ('1', 'order', np.array([*(f'{h:g}' for h in HARMONICS), 'ball_pass'])),
    }
    coords: dict[str, Any] = {
        dim: (dim, values, {'units': unit, 'long_name': text})
        for dim, (unit, text, values) in known.items()
        if dim in dims
    }
    coords |= {name: (name, values, dict(about)) for name, values, about in axes}
    if axes:
        attrs |= {'over': over, 'unit': axes[0][2]['units']}
    return xarray.Dataset(variables, coords, attrs)


def on_grid(parts: Sequence['xarray.Dataset'], axes: Sequence[Axis]) -> 'xarray.Dataset':
    """Join consecutive datasets over `point` into one over the axes (row by row)."""
    import xarray  # noqa: PLC0415 - slow

    shape = tuple(len(values) for _, values, _ in axes)
    dims = tuple(name for name, _, _ in axes)
    variables = {
        name: (
            (*dims, *variable.dims[1:]),
            np.concatenate([part[name].values for part in parts]).reshape(
                *shape, *variable.shape[1:]
            ),
            variable.attrs,
        )
        for name, variable in parts[0].data_vars.items()
    }
    coords: dict[Any, Any] = {name: (name, values, dict(about)) for name, values, about in axes}
    return xarray.Dataset(variables, {**parts[0].coords, **coords})


def section_dataset(
    orbit: Mapping[str, NDArray[np.float64]],
    motion: Mapping[str, Any],
    evidence: Mapping[str, float],
    point: OperatingPoint,
) -> 'xarray.Dataset':
    """Return one motion: orbits (revolution, phase), section at phase 0, label and evidence."""
    import xarray  # noqa: PLC0415 - slow

    variables: dict[str, Any] = {
        name: ('revolution', path[:, 0], _about(name)) for name, path in orbit.items()
    }
    for name, path in orbit.items():
        about = _about(name)
        about['long_name'] = about['long_name'].replace(' at tau = 2 pi j', ' through a turn')
        variables[f'orbit_{name}'] = ('revolution', 'phase'), path, about
    motion = {**motion, 'length_scale_m': point.parameters.length_scale_m}
    variables |= {name: ((), value, _about(name)) for name, value in motion.items()}
    for name, value in evidence.items():
        about = {'units': '1', 'long_name': f'{name}, evidence of the label'}
        variables[f'evidence_{name}'] = (), value, about
    revolutions, samples = orbit['y'].shape
    coords = {
        'revolution': ('revolution', np.arange(revolutions), {'units': '1'}),
        'phase': ('phase', np.arange(samples) * (2.0 * math.pi / samples), {'units': 'rad'}),
    }
    attrs = {'speed_rad_s': point.speed_rad_s, 'load_factor': point.load_factor}
    return xarray.Dataset(variables, coords, attrs)
