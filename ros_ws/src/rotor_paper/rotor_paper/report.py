# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The report of a run: report.json, and report.html with the pictures beside the claims."""

import dataclasses
import html
import json
import os
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from rotor_common.plain_data import without_nan
from rotor_paper import judging
from rotor_paper.claim import MOST_UNCONVERGED
from rotor_paper.claims import claims
from rotor_paper.figures import (
    RECONSTRUCTION,
    RECONSTRUCTIONS,
    SLOWEST_SPEED_RAD_S,
    Settings,
    figures,
    load_facts,
)
from rotor_paper.run import Reproduction

SOURCE = (
    'Hou, Chen, Cao, Lu, Nonlinear vibration analysis of a cracked rotor-ball bearing system '
    'during flight maneuvers, Mechanism and Machine Theory 105 (2016) 515-528'
)
VERDICTS = (judging.AGREES, judging.PARTLY, judging.DOES_NOT)
PACKAGES = ('numpy', 'numba', 'matplotlib', 'distributed')
NOTES = (
    f'Diagrams over speed start at {SLOWEST_SPEED_RAD_S:g} rad/s: at speed 0 no revolution ends.',
    (
        'A point has converged when its mean, order amplitudes and exponent stay the same from N '
        'to 2N steps a revolution, within bounds. Points that do not are orange in the pictures. '
        f'A claim of which more than {MOST_UNCONVERGED:.0%} of the points it uses did not converge '
        'agrees partly at best.'
    ),
    (
        'Exponents are those of tangents with saltation: where f jumps (all variants but derived) '
        'the tangent jumps too. The thin line leaves that out, as a program does that does not '
        'look for jumps: it is not the growth of a small deviation, and may have the wrong sign.'
    ),
    (
        'At N = 256 a fixed step over a jump of f makes irregular sections of its own '
        '(figure_chaos, K = 0.2, 352 rad/s, G = 3: K of the 0-1 test is 0.77 at 256 steps and 0.01 '
        'at 4096, the exponent -0.014 with saltation and +0.035 without). So "converged at 2N" '
        'does not show that such a motion is regular; see docs/analyses.md.'
    ),
    (
        'A label holds at N and at 2N steps and does not contradict the exponent; else the motion '
        'is undecided. Such a point is figure at K = 0.225 (352 rad/s, G = 3). With 256 steps it '
        'hops between coexisting motions and has the exponent +0.056 +- 0.006; with 512, 1024, '
        '2048 and 4096 steps it stays with one, and the exponent is -0.009 +- 0.002, -0.010 +- '
        '0.002, -0.0012 +- 0.0011 and 0.0001 +- 0.0007. So it is not chaotic; the Z of its section '
        'then lies between -27 and -22, with 256 steps between -28 and 12.'
    ),
    (
        'Jumps are judged between neighbouring values, so that with fewer of them a steep change '
        'counts as a step sooner: natural at 431 rad/s (Fig. 11c) steps by 8.6 % of the range with '
        '200 values and by 4.8 % with 400, where 5 % make a step.'
    ),
    'Ticks of an axis, read off the print, bound a curve; they do not give its values.',
    (
        f'The variants {" and ".join(RECONSTRUCTIONS)}: {RECONSTRUCTION}. They were picked, after '
        'a search over readings of the equations, because they come nearest to the figures.'
    ),
)

SELECTION = (
    'The claims are a selection: statements of the text, its lists of motions, and the outer ticks '
    'of the axes, as far as a rule judges them from numbers. The authors of this program chose '
    'them and the rules, so the counts below are no measure of how much of the paper agrees. Not '
    'judged:'
)
NOT_JUDGED = (
    (
        'the curves and point clouds themselves: the paper prints pictures and no data, so nothing '
        'is compared point for point; of the sections (Figs 7 to 10, 15, 18) only ranges and labels'
    ),
    (
        'how high the lines and ridges of the spectra are (Figs 6 to 10, 12, 14, 17, 19), and '
        'which of them are marked, except for those named here'
    ),
    'the bifurcations that the text sees beside the jumps in Figs 11 and 14, and where they lie',
    'where the peaks of the exponents lie (Figs 13, 19); only how many there are',
    'what happens between the values listed for Figs 15 and 18',
    'the comparisons with other papers, and the advice drawn from the results',
)


def report(
    outcome: Reproduction,
    settings: Settings,
    variants: Sequence[str],
    *,
    wall_s: float,
    cached: bool,
) -> dict[str, Any]:
    """Return everything about a run in JSON types; `cached`: the cache had results before it."""
    facts = load_facts()
    titles = {number: figure.title for number, figure in figures(facts).items()}
    rows = [
        {
            'name': claim.name,
            'figure': claim.figure,
            'paper': claim.paper,
            'rule': claim.rule,
            'verdicts': {
                variant: dataclasses.asdict(outcome.verdicts[claim.name][variant])
                for variant in variants
                if variant in outcome.verdicts.get(claim.name, {})
            },
        }
        for claim in claims(facts)
    ]
    content: dict[str, Any] = without_nan(
        {
            'paper': SOURCE,
            'notes': list(NOTES),
            'selection': SELECTION,
            'not_judged': list(NOT_JUDGED),
            'made': _made(),
            'settings': {**dataclasses.asdict(settings), 'start': 'the same at every point'},
            'wall_s': wall_s,
            'results_in_cache_before': cached,
            'variants': {
                variant: RECONSTRUCTION if variant in RECONSTRUCTIONS else 'reading of the print'
                for variant in variants
            },
            'summary': {variant: _summary(rows, variant) for variant in variants},
            'pictures': [
                {'title': titles[picture.figure], **dataclasses.asdict(picture)}
                for picture in outcome.pictures
            ],
            'claims': [row for row in rows if row['verdicts']],
            'not_computed': [row['name'] for row in rows if not row['verdicts']],
        }
    )
    return content


def _made() -> dict[str, Any]:
    return {
        'at': datetime.now(UTC).isoformat(timespec='seconds'),
        'version': _version('rotor_bringup'),
        'python': platform.python_version(),
        'packages': {name: _version(name) for name in PACKAGES},
        'machine': f'{platform.system()} {platform.machine()}, {_processor()}',
        'cores': os.cpu_count(),
    }


def _version(name: str) -> str:
    """Return the version of an installed package; a colcon or source tree may have none."""
    try:
        return version(name)
    except PackageNotFoundError:
        return 'from source'


def _processor() -> str:
    """Return the name of the processor, as far as the system tells it."""
    try:
        lines = Path('/proc/cpuinfo').read_text('utf-8').splitlines()
    except OSError:
        lines = []
    names = [line.partition(':')[2].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.processor() or 'unknown processor'


def _summary(rows: Sequence[Mapping[str, Any]], variant: str) -> dict[str, int]:
    found = [row['verdicts'][variant]['verdict'] for row in rows if variant in row['verdicts']]
    return {verdict: found.count(verdict) for verdict in VERDICTS}


def save(content: Mapping[str, Any], out: Path) -> None:
    """Write report.json and report.html into the folder `out`."""
    text = json.dumps(content, indent=2, allow_nan=False)
    (out / 'report.json').write_text(text + '\n', 'utf-8')
    (out / 'report.html').write_text(page(content), 'utf-8')


_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1500px; padding: 0 1em }
table { border-collapse: collapse; width: 100%; font-size: 13px }
th, td { border: 1px solid #ddd; padding: 4px 8px; text-align: left; vertical-align: top }
th { background: #f4f4f4 }
.agrees { background: #dff2e3 } .partly { background: #fdf3d3 } .does-not { background: #fbe1dd }
.pictures { display: flex; flex-wrap: wrap; gap: 1em } figure { margin: 0; flex: 1 1 600px }
img { max-width: 100% } figcaption, .rule { color: #666; font-size: 12px }
"""


def page(content: Mapping[str, Any]) -> str:
    """Return the report as one HTML page that refers to the pictures beside it."""
    variants = list(content['variants'])
    made, settings = content['made'], content['settings']
    numbers = sorted({picture['figure'] for picture in content['pictures']})
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width">',
        f'<title>Figures 5 to 19</title><style>{_STYLE}</style></head><body>',
        '<h1>What agrees with the paper</h1>',
        f'<p>{_text(content["paper"])}</p><ul>',
        *(f'<li>{_text(note)}</li>' for note in content['notes']),
        '</ul><h2>What was run</h2>',
        (
            f'<p>rotor-rig {_text(made["version"])} on {_text(made["machine"])}, {made["cores"]} '
            f'cores, Python {_text(made["python"])}, '
            f'{_text(", ".join(f"{name} {number}" for name, number in made["packages"].items()))}; '
            f'{_text(made["at"])}; {_text(settings_text(settings))}; {content["wall_s"]:.0f} s'
            f'{_text(cache_text(content))}.</p>'
        ),
        _table(
            ('variant', 'what it is', *VERDICTS),
            [
                (_text(name), _text(what), *map(str, content['summary'][name].values()))
                for name, what in content['variants'].items()
            ],
        ),
        f'<h2>Every claim</h2><p>{_text(content["selection"])}</p><ul>',
        *(f'<li>{_text(what)}</li>' for what in content['not_judged']),
        '</ul>',
        _claims(content['claims'], variants),
    ]
    shown = [_figure(number, content) for number in numbers]
    return '\n'.join([*parts, *shown, '</body></html>\n'])


def settings_text(settings: Mapping[str, Any]) -> str:
    """Return the settings of a run in words."""
    check = 'checked at 2N steps' if settings['check_steps'] else 'not checked at 2N steps'
    return (
        f'{settings["values"]} values a diagram, {settings["transient"]} revolutions left out, '
        f'{settings["revolutions"]} recorded, {settings["exponent_revolutions"]} for an exponent, '
        f'{check}, start the same at every point'
    )


def cache_text(content: Mapping[str, Any]) -> str:
    """Return a remark on the wall time if the cache was not empty, else ''."""
    return ', with results of an earlier run' if content['results_in_cache_before'] else ''


def _claims(rows: Sequence[Mapping[str, Any]], variants: Sequence[str]) -> str:
    body = []
    for row in rows:
        cells = [
            f'<td>{row["figure"]}</td>',
            f'<td>{_text(row["paper"])}<div class="rule">{_text(row["rule"])}</div></td>',
        ]
        for variant in variants:
            found = row['verdicts'].get(variant)
            if found is None:
                cells.append('<td>not computed</td>')
            else:
                name = found['verdict']
                cells.append(
                    f'<td class="{name.replace(" ", "-")}"><b>{name}</b>: '
                    f'{_text(found["why"])}</td>'
                )
        body.append(f'<tr id="{_text(row["name"])}">{"".join(cells)}</tr>')
    head = ''.join(
        f'<th>{_text(name)}{f"<div class=rule>{RECONSTRUCTION}</div>" if mark else ""}</th>'
        for name, mark in (
            ('Fig.', False),
            ('paper', False),
            *((variant, variant in RECONSTRUCTIONS) for variant in variants),
        )
    )
    return f'<table><tr>{head}</tr>{"".join(body)}</table>'


def _figure(number: int, content: Mapping[str, Any]) -> str:
    pictures = [row for row in content['pictures'] if row['figure'] == number]
    shown = ''.join(
        f'<figure><a href="{_text(row["picture"])}"><img loading="lazy" '
        f'src="{_text(row["picture"])}" '
        f'alt="Fig. {number}, variant {_text(row["variant"])}"></a>'
        f'<figcaption>{_text(caption(row, content["variants"]))} '
        f'<a href="{_text(row["data"])}">data</a></figcaption></figure>'
        for row in pictures
    )
    title = _text(pictures[0]['title'])
    return f'<h2>Figure {number}: {title}</h2><div class="pictures">{shown}</div>'


def caption(row: Mapping[str, Any], variants: Mapping[str, str]) -> str:
    """Return the counts of a picture's points and, unless they were cached, their time."""
    unconverged = (
        'convergence not checked'
        if row['unconverged'] is None
        else f'{row["unconverged"]} not converged at 2N steps'
    )
    shared = ', '.join(str(number) for number in row['shared_with'])
    seconds = row['compute_s']
    computed = (
        'in part or all from the cache' if seconds is None else f'computed in {seconds:.0f} s'
    )
    return (
        f'{row["variant"]} ({variants[row["variant"]]}): {row["points"]} points, {unconverged}, '
        f'{row["lost"]} diverged; {computed}{f" together with Figs {shared}" if shared else ""}, '
        f'drawn in {row["draw_s"]:.0f} s.'
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    top = ''.join(f'<th>{_text(cell)}</th>' for cell in head)
    body = ''.join('<tr>' + ''.join(f'<td>{cell}</td>' for cell in row) + '</tr>' for row in rows)
    return f'<table><tr>{top}</tr>{body}</table>'


def _text(value: str) -> str:
    return html.escape(value)
