# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The data of a figure as arrays for one npz file. SI; divide lengths by length_scale_m."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics import Survey
from rotor_paper.figures import HIGHEST_FREQUENCY_RAD_S, Figure
from rotor_paper.judging import Results

ONE_MOTION = frozenset({'series', 'portrait', 'section', 'spectrum'})
"""Panels that show a single point of their diagram."""

ALWAYS = (
    'label',
    'converged',
    'difference',
    'steps_per_revolution',
    'length_scale_m',
    'order_amplitude_y',
    'order_amplitude_z',
)
BY_KIND = {
    'orbit_diagram': ('y', 'z'),
    'section': ('y', 'z', 'velocity_y', 'velocity_z', 'exponent', 'standard_error', 'zero_one'),
    'exponents': (
        'exponent',
        'standard_error',
        'naive_exponent',
        'exponent_difference',
        'zero_one',
    ),
}


def rows_shown(figure: Figure, results: Results) -> dict[str, NDArray[np.intp]]:
    """Return by diagram which of its points a figure shows."""
    rows: dict[str, set[int]] = {}
    for panel in figure.panels:
        every = range(len(results.surveys[panel.diagram].points))
        shown = {panel.index} if panel.kind in ONE_MOTION else set(every)
        rows.setdefault(panel.diagram, set()).update(shown)
    return {key: np.array(sorted(shown)) for key, shown in rows.items()}


def arrays(figure: Figure, results: Results) -> dict[str, NDArray[Any]]:
    """Return the data that the figure shows, named `diagram/field`, one row per point.

    The name of the first field is that of the swept parameter. Spectra end at the highest
    frequency drawn: NaN beyond. Paths of a motion are dimensionless.
    """
    made: dict[str, NDArray[Any]] = {}
    for key, rows in rows_shown(figure, results).items():
        survey = results.surveys[key]
        made[f'{key}/{results.diagrams[key].over}'] = results.swept(key)[rows]
        made |= {f'{key}/{name}': getattr(survey, name)[rows] for name in ALWAYS}
    for panel in figure.panels:
        key, survey = panel.diagram, results.surveys[panel.diagram]
        rows = rows_shown(figure, results)[key]
        made |= {
            f'{key}/{name}': getattr(survey, name)[rows] for name in BY_KIND.get(panel.kind, ())
        }
        if panel.kind in {'waterfall', 'spectrum'}:
            name = f'amplitude_{panel.coordinate}'
            made[f'{key}/orders'] = survey.orders
            made[f'{key}/{name}'] = _drawn(survey, name)[rows]
        if panel.kind == 'orbit_diagram' and key in results.sweeps:
            sweeps = results.sweeps[key]
            made[f'{key}/sweep_values'] = sweeps.values
            made |= {f'{key}/Z_up': sweeps.up, f'{key}/Z_down': sweeps.down}
        if panel.kind in {'series', 'portrait'}:
            path = results.paths[key][panel.index]
            made |= {f'{key}/tau': path.tau, f'{key}/Y': path.y, f'{key}/Z': path.z}
    return made


def _drawn(survey: Survey, name: str) -> NDArray[Any]:
    speeds = np.array([point.speed_rad_s for point in survey.points])
    beyond = survey.orders[None, :] * speeds[:, None] > HIGHEST_FREQUENCY_RAD_S
    amplitude: NDArray[np.float32] = getattr(survey, name)
    return np.where(beyond, np.float32(np.nan), amplitude)
