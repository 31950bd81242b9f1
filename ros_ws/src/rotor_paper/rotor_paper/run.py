# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Compute, plot and judge the figures, group by group, variant by variant.

Figures that show the same diagrams, or that one claim compares, form a group and share its surveys.
Only the results of one group and variant are in memory at a time.
"""

import concurrent.futures
import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rotor_common import interrupt
from rotor_common.progress import OnProgress
from rotor_dynamics import Plan, Survey, continuation, poincare_section, survey
from rotor_dynamics.cache import ResultCache
from rotor_paper import panels
from rotor_paper.claim import Claim, ClaimVerdict
from rotor_paper.claims import claims
from rotor_paper.data import arrays, rows_shown
from rotor_paper.figures import (
    CONTINUATION_REVOLUTIONS,
    CONTINUATION_TRANSIENT,
    CONTINUATION_VALUES,
    SERIES_REVOLUTIONS,
    SERIES_WINDOW,
    Diagram,
    Figure,
    Settings,
    diagrams,
    figures,
    load_facts,
)
from rotor_paper.judging import Path as Motion
from rotor_paper.judging import Results, Sweeps

DIRECTIONS: tuple[Literal['up'], Literal['down']] = ('up', 'down')


@dataclass(frozen=True)
class Picture:
    """A figure of one variant: its files and the counts of its points.

    `compute_s` is None if any of its results came from the cache.
    """

    figure: int
    variant: str
    picture: str
    data: str
    points: int
    unconverged: int | None
    lost: int
    compute_s: float | None
    shared_with: tuple[int, ...]
    draw_s: float


@dataclass(frozen=True)
class Reproduction:
    """Everything a run made: pictures, and verdicts by claim and variant."""

    pictures: tuple[Picture, ...]
    verdicts: Mapping[str, Mapping[str, ClaimVerdict]]


class _CountingCache(ResultCache):
    """A cache that counts the results found in it, so that a caption does not give their time."""

    found = 0

    def load(self, key: str) -> dict[str, NDArray[Any]] | None:
        known = super().load(key)
        self.found += known is not None
        return known


@dataclass(frozen=True)
class _Work:
    """What the parts of a run have in common."""

    settings: Settings
    executor: concurrent.futures.Executor
    cache: _CountingCache
    tick: Callable[[int], None]


def make(
    numbers: Sequence[int],
    variants: Sequence[str],
    settings: Settings,
    *,
    out: Path,
    executor: concurrent.futures.Executor,
    cache: ResultCache,
    on_progress: OnProgress,
) -> Reproduction:
    """Compute, draw and judge the figures `numbers` of every variant, into the folder `out`.

    KeyboardInterrupt passes through; what was computed is in `cache` then.
    """
    facts = load_facts()
    every = diagrams(facts)
    judged = claims(facts)
    groups = _groups([figures(facts)[number] for number in numbers], judged)
    total = len(variants) * sum(
        _points(every[key], settings) for group in groups for key in _diagrams(group)
    )
    done = 0

    def tick(more: int) -> None:
        nonlocal done
        done += more
        on_progress(done, total)

    work = _Work(settings, executor, _CountingCache(cache.folder), tick)
    made: list[Picture] = []
    verdicts: dict[str, dict[str, ClaimVerdict]] = {}
    (out / 'data').mkdir(parents=True, exist_ok=True)
    for group in groups:
        for variant in variants:
            began, found = time.perf_counter(), work.cache.found
            results = _compute({key: every[key] for key in _diagrams(group)}, variant, work)
            took = time.perf_counter() - began if work.cache.found == found else None
            made += [
                _picture(figure, results, variant, out=out, took=took, group=group)
                for figure in group
            ]
            for claim in judged:
                verdict = claim.evaluate(results)
                if verdict is not None:
                    verdicts.setdefault(claim.name, {})[variant] = verdict
            del results  # before the next ones are computed
    return Reproduction(tuple(made), verdicts)


def _groups(chosen: Sequence[Figure], judged: Iterable[Claim]) -> list[list[Figure]]:
    """Group the figures that show the same diagrams or that one claim compares."""
    groups = [[figure] for figure in chosen]
    shown = [set(figure.diagrams) for figure in chosen]
    for keys in (*shown, *(set(claim.needs) for claim in judged)):
        linked = [group for group in groups if keys & set(_diagrams(group))]
        if len(linked) > 1:
            at = groups.index(linked[0])
            groups = [group for group in groups if group not in linked]
            groups.insert(at, [figure for group in linked for figure in group])
    return groups


def _diagrams(group: Iterable[Figure]) -> tuple[str, ...]:
    """Return the keys of all diagrams of a group, without repetition."""
    return tuple(dict.fromkeys(key for figure in group for key in figure.diagrams))


def _points(diagram: Diagram, settings: Settings) -> int:
    """Return how many points a diagram has, both continuations included."""
    count = len(diagram.axis(settings.values))
    return count + 2 * _continued(diagram, settings).size if diagram.continued else count


def _continued(diagram: Diagram, settings: Settings) -> NDArray[np.float64]:
    return diagram.axis(min(CONTINUATION_VALUES, settings.values))


def _compute(wanted: Mapping[str, Diagram], variant: str, work: _Work) -> Results:
    surveys = {key: _survey(diagram, variant, work) for key, diagram in wanted.items()}
    continued = [diagram for diagram in wanted.values() if diagram.continued]
    return Results(
        wanted,
        surveys,
        _sweeps(continued, variant, work) if continued else {},
        {key: _paths(diagram, variant, work) for key, diagram in wanted.items() if diagram.series},
    )


def _survey(diagram: Diagram, variant: str, work: _Work) -> Survey:
    before = 0

    def advance(done: int, _total: int) -> None:
        nonlocal before
        work.tick(done - before)
        before = done

    return survey(
        diagram.points(variant, work.settings.values),
        diagram.plan(work.settings),
        executor=work.executor,
        cache=work.cache,
        on_progress=advance,
    )


def _sweeps(continued: Sequence[Diagram], variant: str, work: _Work) -> dict[str, Sweeps]:
    """Return up- and down-sweep of every diagram, side by side; they are coarser than a survey.

    All diagrams run over the same values of the same parameter.
    """
    values = _continued(continued[0], work.settings)
    plan = Plan(CONTINUATION_TRANSIENT, CONTINUATION_REVOLUTIONS)
    sweeps = [
        (diagram.points(variant, values.size), direction)
        for diagram in continued
        for direction in DIRECTIONS
    ]
    key = work.cache.key('continuation', [sweeps, plan])
    kept = work.cache.load(key)
    known = kept
    if known is None:
        found = continuation(sweeps, values, plan)
        known = {'Z': np.array([one.z / one.length_scale_m[:, None] for one in found])}
    with interrupt.held():  # an interrupt must not fall between storing and counting
        if kept is None:
            work.cache.store(key, known)
        work.tick(len(sweeps) * values.size)
    pairs = known['Z'].reshape(len(continued), 2, values.size, -1)
    return {
        diagram.key: Sweeps(values, up, down)
        for diagram, (up, down) in zip(continued, pairs, strict=True)
    }


def _paths(diagram: Diagram, variant: str, work: _Work) -> list[Motion]:
    """Return the motion at every point of a diagram, sample by sample."""
    transient = diagram.plan(work.settings).transient_revolutions
    turn = 2.0 * math.pi
    start = turn * transient
    first = start + SERIES_WINDOW[0] % turn
    window = (first, first + SERIES_WINDOW[1] - SERIES_WINDOW[0])
    made = []
    for point in diagram.points(variant, work.settings.values):
        plan = Plan(transient, SERIES_REVOLUTIONS, check_steps=False)
        section = poincare_section(point, plan)
        y, z = section.orbit_y.values, section.orbit_z.values
        tau = start + turn * np.arange(y.size) / y.shape[1]
        scale = point.parameters.length_scale_m
        made.append(Motion(tau, window, y.ravel() / scale, z.ravel() / scale))
    return made


def _picture(
    figure: Figure,
    results: Results,
    variant: str,
    *,
    out: Path,
    took: float | None,
    group: list[Figure],
) -> Picture:
    began = time.perf_counter()
    name = f'fig{figure.number:02d}_{variant}'
    panels.save(panels.draw(figure, results, variant), out, name)
    np.savez_compressed(out / 'data' / f'{name}.npz', allow_pickle=False, **arrays(figure, results))
    shown = [(results.surveys[key], rows) for key, rows in rows_shown(figure, results).items()]
    checked = all(survey.plan.check_steps for survey, _ in shown)
    return Picture(
        figure.number,
        variant,
        f'{name}.png',
        f'data/{name}.npz',
        sum(len(rows) for _, rows in shown),
        sum(_count(s.converged[rows], s.label[rows]) for s, rows in shown) if checked else None,
        sum(int((s.label[rows] == 'diverged').sum()) for s, rows in shown),
        took,
        tuple(other.number for other in group if other is not figure),
        time.perf_counter() - began,
    )


def _count(converged: NDArray[np.bool_], label: NDArray[Any]) -> int:
    """Return how many points did not converge though they did not diverge."""
    return int((~converged & (label != 'diverged')).sum())
