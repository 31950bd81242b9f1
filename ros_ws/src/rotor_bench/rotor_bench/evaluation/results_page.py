# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Makes the results in docs/evaluation.md from evaluation.json.

`python -m rotor_bench.evaluation.results_page EVALUATION.json [--docs DIR]`, the pictures beside
it. What stands between the two marks of the page is replaced, the rest of it stays.
"""

import argparse
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rotor_bench.errors import DatasetError
from rotor_bench.evaluation.report import (
    FILE,
    area_text,
    cells,
    columns_of,
    number_text,
    rate_text,
    smallest_text,
)

BEGIN, END = '<!-- results: begin -->', '<!-- results: end -->'
PICTURES = {
    'roc.png': 'ROC of the detectors',
    'auc_by_crack.png': 'Area under the curve by depth of the crack',
    'scores.png': 'Score of every flight by maneuver',
    'growth.png': 'Depth at which growing cracks were found',
    'false_alarms.png': 'False alarms per hour by maneuver',
}
FACTORS = {
    'crack_stiffness_ratio': 'depth of the crack K',
    'maneuver': 'maneuver (all flights)',
    'confounder': 'what has changed since the reference flights',
    'speed_program': 'course of the speed',
    'speed_band': 'speed of the machine',
    'held_out_family': 'family of maneuvers in the train split',
    'encoder': 'source of the angle',
    'noise': 'noise of the sensors',
}

Content = Mapping[str, Any]


def main() -> None:
    """Write the results into the page and copy file and pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('report', type=Path, help='evaluation.json of a run')
    parser.add_argument('--docs', type=Path, default=Path('docs'), help='folder of the page')
    arguments = parser.parse_args()
    content = json.loads(arguments.report.read_text('utf-8'))
    file = arguments.docs / 'evaluation.md'
    file.write_text(filled(file.read_text('utf-8'), content), 'utf-8')
    images = arguments.docs / 'images' / 'evaluation'
    images.mkdir(parents=True, exist_ok=True)
    for name in PICTURES:
        shutil.copyfile(arguments.report.parent / name, images / name)
    shutil.copyfile(arguments.report, arguments.docs / FILE)


def filled(text: str, content: Content) -> str:
    """Return a page with the results between its marks; raises DatasetError if it has no marks."""
    if BEGIN not in text or END not in text:
        raise DatasetError(f'the page has no place for results, {BEGIN} to {END}')
    before, after = text.split(BEGIN, maxsplit=1)[0], text.split(END)[1]
    return f'{before}{BEGIN}\n\n{tables(content)}\n{END}{after}'


def tables(content: Content) -> str:
    """Return all tables and pictures in Markdown."""
    detectors = content['detectors']
    made = content['made']
    packages = ', '.join(f'{name} {number}' for name, number in made['versions'].items())
    shown = {name: cells(numbers) for name, numbers in detectors.items()}
    measures = list(next(iter(shown.values())))
    kept = content['kept_flights']
    earlier = f' without {kept} flights kept from an earlier run' if kept else ''
    run = (
        f'Suite `{content["suite"]}`, seed {content["seed"]}, {content["split"]} split: '
        f'{content["machines"]} machines, {content["flight_hours"]:.1f} flight hours under test; '
        f'isolation: {content["isolation"]}. {made["at"]}, {made["cores"]} cores '
        f'({made["machine"]}), Python {made["python"]}, {packages}; '
        f'{content["wall_s"] / 60:.0f} minutes{earlier}. Everything: [{FILE}]({FILE}).'
    )
    lines = [
        run,
        '',
        *_table('', detectors, [(m, [cell[m] for cell in shown.values()]) for m in measures]),
    ]
    for name, words in PICTURES.items():
        lines += [f'![{words}](images/evaluation/{name})', '']
    for factor, words in FACTORS.items():
        lines += _by(detectors, factor, words)
    lines += _false_alarms(detectors)
    lines += _smallest(detectors)
    lines += _growth(detectors)
    return '\n'.join(lines)


def _table(
    corner: str, columns: Sequence[str] | Content, rows: Sequence[tuple[str, Sequence[str]]]
) -> list[str]:
    head = ' | '.join(f'`{name}`' for name in columns)
    return [
        f'| {corner} | {head} |',
        f'| --- |{" --- |" * len(columns)}',
        *(f'| {name} | {" | ".join(values)} |' for name, values in rows),
        '',
    ]


def _by(detectors: Content, factor: str, words: str) -> list[str]:
    levels = columns_of(detectors, factor)
    is_depth = factor == 'crack_stiffness_ratio'
    ranked = sorted(levels, key=float) if is_depth else sorted(levels)
    rows = [
        (level, [area_text(numbers['auc_by'][factor].get(level)) for numbers in detectors.values()])
        for level in ranked
    ]
    return [f'### AUC by {words}', '', *_table(words, detectors, rows)]


def _false_alarms(detectors: Content) -> list[str]:
    names = list(next(iter(detectors.values()))['false_alarms'])
    rows = [
        (name, [rate_text(numbers['false_alarms'][name]) for numbers in detectors.values()])
        for name in names
    ]
    for factor in ('maneuver', 'confounder'):
        levels = sorted({name for n in detectors.values() for name in n['false_alarms_by'][factor]})
        rows += [
            (
                f'{factor}: {level}',
                [rate_text(n['false_alarms_by'][factor][level]) for n in detectors.values()],
            )
            for level in levels
        ]
    return ['### False alarms per hour', '', *_table('healthy flights', detectors, rows)]


def _smallest(detectors: Content) -> list[str]:
    rows = []
    for level in next(iter(detectors.values()))['smallest_crack']:
        texts = []
        for numbers in detectors.values():
            found = numbers['smallest_crack'][level]
            parts = ', '.join(f'{k:g}: {part:.0%}' for k, _, part in found['found'])
            smallest = smallest_text(found)
            texts.append(f'**{smallest}** ({parts})' if parts else smallest)
        rows.append((level, texts))
    title = '### Smallest crack found (there and above in at least 90 % of the flights)'
    return [title, '', *_table('threshold', detectors, rows)]


def _growth(detectors: Content) -> list[str]:
    rows = []
    for level in next(iter(detectors.values()))['growth']:
        texts = []
        for numbers in detectors.values():
            found = numbers['growth'][level]
            depth, time_s = found['crack_stiffness_ratio'], found['time_s']
            if not depth['flights']:
                texts.append('-')
                continue
            texts.append(
                f'{depth["reached"]} of {depth["flights"]} found, half by '
                f'K = {number_text(depth["median"])} ({number_text(time_s["median"])} s), '
                f'90 % by K = {number_text(depth["quantile_90"])}; alarm in '
                f'{found["decoys"]["alarmed"]} of {found["decoys"]["flights"]} decoys'
            )
        rows.append((level, texts))
    return ['### Growing cracks', '', *_table('threshold', detectors, rows)]


if __name__ == '__main__':
    main()
