# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the analyses behind the commands and describes their results."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.progress import OnProgress
from rotor_common.units import number_text
from rotor_dynamics import (
    LyapunovExponent,
    ResultCache,
    Survey,
    lyapunov_exponent,
    parameter_map,
    poincare_section,
    survey,
    sweep_figures,
)
from rotor_dynamics.cluster import executor
from rotor_dynamics.diagrams import Direction, Sweep, continuation
from rotor_dynamics.ensemble import steps_needed
from rotor_dynamics.motion import SIGNIFICANCE
from rotor_dynamics.surveys import EXPONENT_ERRORS, EXPONENT_RESOLUTION
from rotor_dynamics.sweep_commands import Question
from rotor_dynamics.sweep_files import SweepResult


@dataclass(frozen=True)
class Resources:
    """Where a sweep is computed and kept."""

    scheduler: str | None
    jobs: int | None
    cache: Path | None

    @contextmanager
    def opened(self) -> Iterator[dict[str, Any]]:
        """Yield the arguments `executor` and `cache` of a survey."""
        cache = None if self.cache is None else ResultCache(self.cache)
        with executor(self.scheduler, self.jobs) as pool:
            yield {'executor': pool, 'cache': cache}


def run_sweep(
    command: str, question: Question, resources: Resources, on_progress: OnProgress
) -> SweepResult:
    """Return the survey over a parameter, drawn as `command` draws it."""
    with resources.opened() as where:
        found = survey(question.points, question.plan, on_progress=on_progress, **where)
    return _outcome(command, question, found, 'fixed')


def run_continuation(command: str, question: Question, direction: Direction) -> SweepResult:
    """Return the survey that continues from value to value; it is not repeated at 2N steps."""
    once = replace(question, plan=replace(question.plan, check_steps=False))
    (found,) = continuation([(question.points, direction)], question.values, once.plan)
    return _outcome(command, once, found, direction)


def _outcome(command: str, question: Question, found: Survey, direction: Direction) -> SweepResult:
    rows = {'values': question.values, 'length_scale_m': found.length_scale_m}
    for field in fields(found):
        if field.name not in {'points', 'plan', 'orders'} and getattr(found, field.name).size:
            rows[field.name] = getattr(found, field.name)
    rows['speed_rad_s'] = np.array([point.speed_rad_s for point in found.points])
    shared = {'orders': found.orders} if found.orders.size else {}
    asked = question.asked(command)
    if command in {'orbit-diagram', 'waterfall'}:
        asked['direction'] = direction
    return SweepResult(
        asked=asked,
        rows=rows,
        shared=shared,
        found=_json_of(found, question),
        sentences=[
            *_labels(question, found.label),
            *_diverged(found, question),
            *_about(found, question),
        ],
        draw=partial(_SWEEPS[command], rows | shared, asked),
        failed=bool((found.label == 'diverged').all())
        or bool(command == 'lyapunov' and np.isnan(found.exponent).all()),
    )


def run_map(
    question: Question,
    against: str,
    values: NDArray[np.float64],
    resources: Resources,
    on_progress: OnProgress,
) -> SweepResult:
    """Return exponents and amplitudes over the question's parameter and a second one."""
    assert question.over is not None  # noqa: S101 - the command asks for it
    with resources.opened() as where:
        result = parameter_map(
            question.points[0],
            (Sweep(question.over, question.values), Sweep(against, values)),
            question.plan,
            on_progress=on_progress,
            **where,
        )
    count = result.label.size
    over = result.label.dims
    grid = np.meshgrid(*(result[name].values for name in over), indexing='ij')
    rows = {str(name): axis.ravel() for name, axis in zip(over, grid, strict=True)}
    for name in ('exponent', 'standard_error', 'label', 'converged', 'length_scale_m'):
        rows[name] = result[name].values.ravel()
    for name in ('order_amplitude_y', 'order_amplitude_z'):
        rows[name] = result[name].values.reshape(count, -1)
    asked = question.asked('map') | {'against': over[1]}
    asked |= {name: None for name in ('speed_rad_s', 'load_factor') if name == over[1]}
    positive = int((result.exponent > SIGNIFICANCE * result.standard_error).sum())
    kinds = ', '.join(f'{n} {kind}' for kind, n in Counter(rows['label'].tolist()).most_common())
    gone = int((result.label == 'diverged').sum())
    sentences = [
        f'{count} points over {over[0]} and {over[1]}: {kinds}',
        f'exponent positive by {SIGNIFICANCE:g} standard errors at {positive} of them',
        *([f'{gone} of {count} points diverged{_WHERE_DIVERGED}'] if gone else []),
    ]
    if question.plan.check_steps:
        bad = int((~result.converged & (result.label != 'diverged')).sum())
        sentences.append(f'{bad} have NOT converged: twice the steps give something else')
    return SweepResult(
        asked=asked,
        rows=rows,
        shared={},
        found={
            'over': list(over),
            'values': [result[name].values.tolist() for name in over],
            **{
                name: result[name].values.tolist()
                for name in ('exponent', 'standard_error', 'label', 'converged')
            },
            'positive': positive,
            'diverged': gone,
        },
        sentences=sentences,
        draw=partial(sweep_figures.parameter_map, result, asked),
        failed=gone == count,
    )


def run_exponent(question: Question, method: str, *, spectrum: bool) -> SweepResult:
    """Return the largest exponent at one point, and whether twice the steps give the same."""
    (point,) = question.points
    plan = question.plan

    def at(steps: int, *, everything: bool) -> Any:
        return lyapunov_exponent(
            point.parameters,
            speed_rad_s=point.speed_rad_s,
            load_factor=point.load_factor,
            transient_revolutions=plan.transient_revolutions,
            revolutions=plan.exponent_revolutions,
            steps_per_revolution=steps,
            method='tangent' if method == 'tangent' else 'two_trajectories',
            spectrum=everything,
        )

    result = at(plan.steps_per_revolution, everything=spectrum)
    failed = not np.isfinite(result.exponent)
    found: dict[str, Any] = {
        'method': method,
        'exponent': result.exponent,
        'standard_error': result.standard_error,
        'diverged_at': np.nan if result.diverged_at is None else float(result.diverged_at),
    }
    sentences = [
        f'no largest Lyapunov exponent: {_lost(result)}; more --steps show whether the step is to '
        'blame'
        if failed
        else f'largest Lyapunov exponent {_number(result)} per unit tau (standard error; '
        f'{plan.exponent_revolutions} revolutions, {method})'
    ]
    if plan.check_steps and not failed:
        steps = 2 * steps_needed(point, plan.steps_per_revolution)
        finer = at(steps, everything=False)
        difference = abs(result.exponent - finer.exponent)
        error = np.hypot(result.standard_error, finer.standard_error)
        converged = bool(difference <= EXPONENT_ERRORS * error + EXPONENT_RESOLUTION)
        found |= {'exponent_difference': difference, 'converged': converged}
        sentences.append(
            f'{"converged" if converged else "NOT converged"}: {steps} steps a revolution give '
            + (_number(finer) if np.isfinite(finer.exponent) else f'none, {_lost(finer)}')
        )
    shared = {}
    if result.spectrum is not None and not failed:
        shared = {
            'spectrum': result.spectrum,
            'spectrum_standard_error': result.spectrum_standard_error,
        }
        found |= {name: values.tolist() for name, values in shared.items()}
        sentences.append(
            'all exponents: ' + ' '.join(number_text(x, '.4f') for x in result.spectrum)
        )
    asked = question.asked('lyapunov')
    return SweepResult(
        asked=asked,
        rows={'running': result.running},
        shared=shared | {name: np.array(x) for name, x in found.items() if name not in shared},
        found=found,
        sentences=sentences,
        draw=partial(sweep_figures.lyapunov_exponent, result, asked, found.get('converged')),
        failed=failed,
    )


def _number(result: LyapunovExponent) -> str:
    return f'{result.exponent:.5f} +- {result.standard_error:.5f}'


def _lost(result: LyapunovExponent) -> str:
    """Return why there is no exponent."""
    if result.diverged_at is None:
        return 'the growth of a deviation was lost in rounding, though the motion did not diverge'
    return f'the motion diverged, it left the model in revolution {result.diverged_at}'


def run_section(question: Question) -> SweepResult:
    """Return one motion: orbit, section, its label with the evidence, and whether 2N agrees."""
    (point,) = question.points
    plan = question.plan
    result = poincare_section(point, plan)
    rows = {str(name): array.values for name, array in result.items() if array.ndim}
    said = {str(name): array.item() for name, array in result.items() if not array.ndim}
    label, diverged = said['label'], said['label'] == 'diverged'
    evidence = {
        name.removeprefix('evidence_'): value
        for name, value in said.items()
        if name.startswith('evidence_')
    }
    found: dict[str, Any] = {
        **{name: said[name] for name in ('label', 'reason', 'diverged_at')},
        'evidence': evidence,
    }
    because = f' ({said["reason"]})' if said['reason'] else ''
    numbers = ', '.join(
        f'{name} {value:.4g}' for name, value in evidence.items() if np.isfinite(value)
    )
    sentences = [f'{label} motion{because}' + ('' if diverged else f': {numbers}')]
    if plan.check_steps:
        found |= {'converged': said['converged'], 'difference': said['difference']}
    if plan.check_steps and np.isfinite(said['difference']):
        sentences.append(
            f'{"converged" if said["converged"] else "NOT converged"}: twice the steps change '
            f'means and amplitudes by {said["difference"]:.2g} of the largest'
        )
    asked = question.asked('poincare')
    return SweepResult(
        asked=asked,
        rows=rows,
        shared={
            name: np.array(said[name])
            for name in ('length_scale_m', 'label', 'reason', 'diverged_at')
        },
        found=found,
        sentences=sentences,
        draw=partial(sweep_figures.poincare_section, result, label, asked, found.get('converged')),
        failed=diverged,
    )


_SWEEPS = {
    'orbit-diagram': sweep_figures.orbit_diagram,
    'waterfall': sweep_figures.waterfall,
    'lyapunov': sweep_figures.lyapunov_diagram,
    'poincare': sweep_figures.sections,
}


_WHERE_DIVERGED = '; their numbers are NaN in the data, null in JSON'


def _json_of(found: Survey, question: Question) -> dict[str, Any]:
    names = ['label', 'reason', 'diverged_at']
    if question.plan.exponent_revolutions:
        names += ['exponent', 'standard_error']
    if question.plan.check_steps:
        names += ['converged', 'difference']
        if question.plan.exponent_revolutions:
            names.append('exponent_difference')
    return {
        'values': question.values.tolist(),
        **{name: getattr(found, name).tolist() for name in names},
        'diverged': int((found.label == 'diverged').sum()),
    }


def _labels(question: Question, label: NDArray[np.str_]) -> list[str]:
    counted = Counter(label.tolist()).most_common()
    kinds = ', '.join(f'{count} {name}' for name, count in counted)
    return [f'{len(label)} values of {question.over}: {kinds}']


def _diverged(found: Survey, question: Question) -> list[str]:
    """Return a sentence about the values at which the motion diverged, if any."""
    gone = found.label == 'diverged'
    if not gone.any():
        return []
    values, left = question.values[gone], found.diverged_at[gone]
    said = (
        f'{int(gone.sum())} of {len(found)} values diverged, between {question.over} = '
        f'{values.min():g} and {values.max():g}: the motions left the model in revolution '
        f'{left.min():.0f} to {left.max():.0f}{_WHERE_DIVERGED}'
    )
    return [said]


def _about(found: Survey, question: Question) -> list[str]:
    """Return sentences about exponents and convergence."""
    sentences = []
    finite = np.isfinite(found.exponent)
    if finite.any():
        at = int(np.nanargmax(found.exponent))
        positive = found.exponent > SIGNIFICANCE * found.standard_error
        sentences.append(
            f'largest exponents {np.nanmin(found.exponent):.4f} to {found.exponent[at]:.4f} per '
            f'unit tau, the highest at {question.values[at]:g}; positive by {SIGNIFICANCE:g} '
            f'standard errors at {int(positive.sum())} of {len(found)} values'
        )
    none = np.isnan(found.exponent) & (found.label != 'diverged')
    if question.plan.exponent_revolutions and none.any():
        sentences.append(
            f'{int(none.sum())} of {len(found)} values have no exponent: the growth of a deviation '
            'was lost in rounding'
        )
    bad = ~found.converged & (found.label != 'diverged')
    if question.plan.check_steps and bad.any():
        sentences.append(
            f'{int(bad.sum())} of {len(found)} values have NOT converged: twice '
            'the steps give something else; they are marked in the picture and in the data'
        )
    return sentences
