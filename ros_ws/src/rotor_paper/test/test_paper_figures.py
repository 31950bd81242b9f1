# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Figures 5 to 19 as data: their panels, sweeps and plans; and what is drawn and kept of them."""

import concurrent.futures
import dataclasses
import html
import json
from pathlib import Path

import numpy as np
import pytest

from paper_worlds import DIAGRAMS, FACTS, base, changed, diverged, world
from rotor_dynamics import Survey
from rotor_dynamics.cache import ResultCache
from rotor_dynamics.motion import SHORTEST
from rotor_paper import panels, run
from rotor_paper.claims import claims
from rotor_paper.data import arrays
from rotor_paper.figures import (
    RECONSTRUCTION,
    RECONSTRUCTIONS,
    SERIES_WINDOW,
    VARIANTS,
    Figure,
    Settings,
    figures,
)
from rotor_paper.judging import AGREES, Results, Sweeps
from rotor_paper.paper_command import LIMITS
from rotor_paper.paper_command import VARIANTS as CLI_VARIANTS
from rotor_paper.report import caption, page, report, save
from rotor_paper.run import Picture, Reproduction

FIGURES = figures(FACTS)


@pytest.fixture(scope='module')
def results() -> Results:
    """The world as the paper sees it, with spectra and sweeps for the pictures."""
    made = world(AGREES)

    def with_spectra(survey: Survey) -> Survey:
        if survey.orders.size:  # the claims on spectra rest on those
            return survey
        orders = np.arange(6 * 40 + 1) / 40.0
        spectra = np.zeros((len(survey), orders.size), np.float32)
        spectra[:, 40] = 2e-5
        return dataclasses.replace(
            survey, orders=orders, amplitude_y=spectra, amplitude_z=2.0 * spectra
        )

    values = DIAGRAMS['G_at_352'].axis(20)
    lines = np.linspace(-1.0, 1.0, 20)[:, None] * np.ones(9)
    sweeps = {
        key: Sweeps(values, lines, lines + (0.0 if key == 'G_at_263' else 0.1))  # no jump there
        for key in made.surveys
        if key.startswith('G_at')
    }
    return dataclasses.replace(changed(made, with_spectra), sweeps=sweeps)


def test_every_figure_from_5_to_19_is_there() -> None:
    assert list(FIGURES) == list(range(5, 20))
    assert VARIANTS == CLI_VARIANTS
    assert {claim.figure for claim in claims(FACTS)} <= set(FIGURES)


@pytest.mark.parametrize('figure', FIGURES.values(), ids=lambda figure: str(figure.number))
def test_panels_show_points_that_exist(figure: Figure) -> None:
    assert len(figure.panels) in {2, 4, 8}
    for panel in figure.panels:
        diagram = DIAGRAMS[panel.diagram]
        plan = diagram.plan(Settings())
        assert panel.index < len(diagram.axis(400))
        if panel.kind in {'waterfall', 'spectrum'}:
            assert plan.highest_order > 0
        if panel.kind == 'exponents':
            assert plan.exponent_revolutions == 500
        if panel.kind in {'series', 'portrait'}:
            assert diagram.series


def test_plans_are_the_papers_by_default() -> None:
    for diagram in DIAGRAMS.values():
        plan = diagram.plan(Settings())
        assert (plan.revolutions, plan.steps_per_revolution) == (300, 256)
        assert plan.check_steps
        assert len(diagram.axis(Settings().values)) in {4, 8, 400}


@pytest.mark.parametrize('end', [0, 1])
def test_the_limits_of_the_counts_make_plans(end: int) -> None:
    """The command refuses what a plan would, and too few revolutions for a label."""
    assert LIMITS['revolutions'][0] >= SHORTEST
    values, transient, revolutions = (
        LIMITS[name][end] for name in ('values', 'transient', 'revolutions')
    )
    settings = Settings(values, transient, revolutions)
    for diagram in DIAGRAMS.values():
        assert diagram.plan(settings).revolutions == LIMITS['revolutions'][end]


def test_ranges_and_points_come_from_the_captions() -> None:
    """Ranges in SI and the operating point of every diagram, as the captions print them."""
    expected = {
        'speed_at_G5': ('speed_rad_s', 20.0, 1000.0, None, 5.0),
        'G_at_431': ('load_factor', 0.0, 10.0, 431.0, None),
        'K': ('crack_stiffness_ratio', 0.0, 0.3, 352.0, 3.0),
        'K_unloaded': ('crack_stiffness_ratio', 0.0, 0.3, 352.0, 0.0),
        'clearance': ('clearance_m', 0.0, 30e-6, 352.0, 3.0),
        'eccentricity': ('eccentricity_m', 0.0, 30e-6, 352.0, 3.0),
    }
    for key, (over, low, high, speed, load) in expected.items():
        points = DIAGRAMS[key].points('figure', 5)
        swept = DIAGRAMS[key].swept(points)
        assert DIAGRAMS[key].over == over
        np.testing.assert_allclose(swept[[0, -1]], [low, high])
        for point in points:
            assert point.parameters.variant == 'figure'
            assert speed is None or point.speed_rad_s == speed
            assert load is None or point.load_factor == load


def test_sections_are_at_the_values_of_the_captions() -> None:
    clearance = DIAGRAMS['clearance_sections']
    np.testing.assert_allclose(
        clearance.axis(400), np.array([2.5, 5, 10, 12.5, 20, 25, 27.5, 30]) * 1e-6
    )
    crack = DIAGRAMS['K_sections'].axis(400)
    np.testing.assert_allclose(crack, [0.1, 0.125, 0.15, 0.2, 0.225, 0.25, 0.275, 0.3])


def test_the_series_start_just_before_the_papers_window() -> None:
    transient = DIAGRAMS['four_speeds'].plan(Settings()).transient_revolutions
    assert 0.0 <= SERIES_WINDOW[0] - 2.0 * np.pi * transient < 2.0 * np.pi


def test_a_waterfall_keeps_every_line_of_a_spectrum(results: Results) -> None:
    """One line anywhere below 1500 rad/s is as high on the grid; above it does not show."""
    survey = results.surveys['four_speeds']
    for column in range(1, survey.orders.size):
        spectra = np.zeros_like(survey.amplitude_z)
        spectra[:, column] = 1e-5
        found = panels.peaks(dataclasses.replace(survey, amplitude_z=spectra), 'z')
        for row, point in enumerate(survey.points):
            frequency = survey.orders[column] * point.speed_rad_s
            height = 1e-5 / survey.length_scale_m[row]
            if frequency <= panels.FREQUENCIES[-1]:
                assert found[row].max() == pytest.approx(height, rel=1e-6)  # float32
                at = panels.FREQUENCIES[found[row].argmax()]
                assert abs(at - frequency) <= 1.5 + 1e-9  # half a bin
            elif frequency > panels.FREQUENCIES[-1] + point.speed_rad_s / 40:  # a line further
                assert found[row].max() == 0.0


@pytest.mark.slow
@pytest.mark.parametrize('number', FIGURES)
def test_every_figure_is_drawn_and_its_data_kept(
    number: int, results: Results, tmp_path: Path
) -> None:
    figure = FIGURES[number]
    canvas = panels.draw(figure, results, 'figure_chaos')
    assert RECONSTRUCTION in canvas.get_suptitle()
    assert len(canvas.axes) == len(figure.panels)
    panels.save(canvas, tmp_path, 'it')
    assert (tmp_path / 'it.png').stat().st_size > 10_000
    # what has many points is an image in the SVG: the file stays small
    assert 10_000 < (tmp_path / 'it.svg').stat().st_size < 3_000_000
    kept = arrays(figure, results)
    np.savez_compressed(tmp_path / 'it.npz', allow_pickle=False, **kept)
    with np.load(tmp_path / 'it.npz', allow_pickle=False) as again:
        assert set(again) == set(kept)
    for key in figure.diagrams:
        rows = {len(values) for name, values in kept.items() if name == f'{key}/label'}
        assert rows == {len(kept[f'{key}/{DIAGRAMS[key].over}'])}


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    'number', [5, *(pytest.param(n, marks=SLOW) for n in (6, 7, 11, 13, 14, 15))]
)
def test_a_figure_of_diverged_points_is_drawn(number: int, results: Results) -> None:
    nothing = changed(results, lambda survey: diverged(survey, slice(None)))
    canvas = panels.draw(FIGURES[number], nothing, 'natural')
    canvas.canvas.draw()
    assert RECONSTRUCTION not in canvas.get_suptitle()


def outcome(results: Results) -> Reproduction:
    verdicts = {
        claim.name: {variant: claim.evaluate(results) for variant in ('natural', 'figure')}
        for claim in claims(FACTS)
    }
    pictures = [
        Picture(5, variant, 'a.png', 'a.npz', 10, 2, 1, 1.0, (6,), 0.5)
        for variant in ('natural', 'figure')
    ]
    return Reproduction(tuple(pictures), verdicts)  # type: ignore[arg-type]


def test_the_report_holds_every_claim_and_names_the_reconstructions(
    results: Results, tmp_path: Path
) -> None:
    content = report(outcome(results), Settings(), ['natural', 'figure'], wall_s=12.0, cached=False)
    save(content, tmp_path)
    again = json.loads((tmp_path / 'report.json').read_text('utf-8'))
    assert again == content
    assert {row['name'] for row in again['claims']} == {claim.name for claim in claims(FACTS)}
    assert again['summary']['natural']['agrees'] == len(again['claims'])
    assert again['variants']['figure'] == RECONSTRUCTION
    shown = html.unescape(page(again))
    for row in again['claims']:
        assert f'id="{row["name"]}"' in shown
    assert shown.count(RECONSTRUCTION) >= len(RECONSTRUCTIONS)
    assert 'src="a.png"' in shown


def test_a_caption_times_no_results_of_the_cache() -> None:
    made = Picture(5, 'natural', 'a.png', 'a.npz', 10, 2, 1, 31.0, (6,), 0.0)
    variants = {'natural': 'reading of the print'}
    timed = caption(dataclasses.asdict(made), variants)
    assert 'computed in 31 s together with Figs 6' in timed
    cached = caption(dataclasses.asdict(dataclasses.replace(made, compute_s=None)), variants)
    assert 'from the cache together with Figs 6' in cached
    assert 'computed' not in cached


@pytest.mark.slow
def test_results_found_in_the_cache_are_not_timed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def survey(*_: object, cache: ResultCache, **__: object) -> Survey:
        if cache.load('key') is None:
            cache.store('key', {'a': np.zeros(1)})
        return base(DIAGRAMS['K_sections'])

    def make() -> Picture:
        outcome = run.make(
            [15],
            ['derived'],
            Settings(),
            out=tmp_path,
            executor=concurrent.futures.ThreadPoolExecutor(1),
            cache=ResultCache(tmp_path / 'cache'),
            on_progress=lambda _done, _total: None,
        )
        return outcome.pictures[0]

    monkeypatch.setattr(run, 'survey', survey)
    assert make().compute_s is not None
    assert make().compute_s is None


def test_nan_is_null_in_the_report(results: Results, tmp_path: Path) -> None:
    nothing = changed(results, lambda survey: diverged(survey, slice(0, 2)))
    content = report(outcome(nothing), Settings(), ['natural', 'figure'], wall_s=1.0, cached=True)
    save(content, tmp_path)
    assert 'NaN' not in (tmp_path / 'report.json').read_text('utf-8')
