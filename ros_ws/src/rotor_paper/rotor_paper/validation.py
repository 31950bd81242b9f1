# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Generates docs/validation.md and its pictures from the report of a run.

`python -m rotor_paper.validation REPORT.json [--docs DIR]`, the pictures of the run beside
the report. One picture a figure: `natural` beside the other variant with most agreement.
"""

import argparse
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from rotor_paper.judging import AGREES, DOES_NOT, PARTLY
from rotor_paper.report import cache_text, caption, settings_text

WIDTH = 1100
"""Width of one variant's picture in pixels; two are side by side."""

COLOURS = 96
"""Colours of a picture: enough for plots, and a quarter of the bytes."""

POINTS = {AGREES: 2, PARTLY: 1, DOES_NOT: 0}
"""Points of a verdict when variants are compared."""

HEAD = """# Validation against the paper

`rotor-rig paper` reproduces figures 5 to 19 of {paper}, and judges how far the results
agree with the paper's statements. `python -m rotor_paper.validation REPORT.json` generates this
page from the report of the run described below; do not edit it. Computing times:
[performance](performance.md).

{notes}

## What was run

rotor-rig {version} on {machine}, {cores} cores, Python {python}, {packages}; {at}. {settings}.
It took {wall_s:.0f} s{cache}. The report itself: [validation.json](validation.json).

## What is judged

{selection}

{not_judged}

| variant | what it is | agrees | partly | does not |
| --- | --- | --- | --- | --- |
{summary}
"""


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('report', type=Path, help='report.json of a run')
    parser.add_argument('--docs', type=Path, default=Path('docs'), help='folder of the page')
    arguments = parser.parse_args()
    content = json.loads(arguments.report.read_text('utf-8'))
    images = arguments.docs / 'images' / 'paper'
    images.mkdir(parents=True, exist_ok=True)
    for number in numbers(content):
        chosen = [row['picture'] for row in side_by_side(content, number)]
        picture([arguments.report.parent / name for name in chosen]).save(
            images / f'fig{number:02d}.png', optimize=True
        )
    shutil.copyfile(arguments.report, arguments.docs / 'validation.json')
    (arguments.docs / 'validation.md').write_text(page(content), 'utf-8')


def numbers(content: Mapping[str, Any]) -> list[int]:
    """Return the figures of a report."""
    return sorted({row['figure'] for row in content['pictures']})


def side_by_side(content: Mapping[str, Any], number: int) -> list[Mapping[str, Any]]:
    """Return the pictures to show of a figure: the first variant and the best of the others.

    The best is the one with most agreement on the claims about the figure, then on all claims.
    """
    pictures = [row for row in content['pictures'] if row['figure'] == number]
    about = [row for row in content['claims'] if row['figure'] == number]

    def agreement(picture: Mapping[str, Any]) -> tuple[int, int]:
        variant = picture['variant']
        return _points(about, variant), _points(content['claims'], variant)

    return [pictures[0], *sorted(pictures[1:], key=agreement, reverse=True)[:1]]


def _points(claims: Sequence[Mapping[str, Any]], variant: str) -> int:
    found = [row['verdicts'][variant] for row in claims if variant in row['verdicts']]
    return sum(POINTS[verdict['verdict']] for verdict in found)


def picture(paths: Sequence[Path]) -> Image.Image:
    """Return pictures of equal size side by side, scaled down, with few colours."""
    parts = []
    for path in paths:
        with Image.open(path) as image:
            height = round(image.height * WIDTH / image.width)
            parts.append(image.convert('RGB').resize((WIDTH, height), Image.Resampling.LANCZOS))
    made = Image.new('RGB', (WIDTH * len(parts), parts[0].height), 'white')
    for index, part in enumerate(parts):
        made.paste(part, (WIDTH * index, 0))
    return made.quantize(COLOURS)


def page(content: Mapping[str, Any]) -> str:
    """Return the page in Markdown."""
    made, variants = content['made'], content['variants']
    summary = '\n'.join(
        f'| `{name}` | {what} | {" | ".join(map(str, content["summary"][name].values()))} |'
        for name, what in variants.items()
    )
    head = HEAD.format(
        paper=content['paper'],
        notes='\n'.join(f'- {note}' for note in content['notes']),
        version=made['version'],
        machine=made['machine'],
        cores=made['cores'],
        python=made['python'],
        packages=', '.join(f'{name} {number}' for name, number in made['packages'].items()),
        at=made['at'],
        settings=_capital(settings_text(content['settings'])),
        wall_s=content['wall_s'],
        cache=cache_text(content),
        selection=content['selection'],
        not_judged='\n'.join(f'- {what}' for what in content['not_judged']),
        summary=summary,
    )
    return '\n'.join([head, *(_figure(content, number) for number in numbers(content))])


def _figure(content: Mapping[str, Any], number: int) -> str:
    variants = content['variants']
    shown = side_by_side(content, number)
    rows = [row for row in content['pictures'] if row['figure'] == number]
    about = [row for row in content['claims'] if row['figure'] == number]
    names = ' and '.join(f'{row["variant"]} ({variants[row["variant"]]})' for row in shown)
    lines = [
        f'## Figure {number}: {rows[0]["title"]}',
        '',
        f'![Figure {number}, variants {names}](images/paper/fig{number:02d}.png)',
        '',
        f'Shown: {names}.',
        '',
        *(f'- {caption(row, variants)}' for row in rows),
        '',
    ]
    if about:
        lines += [
            f'| paper | {" | ".join(f"`{name}`" for name in variants)} |',
            f'| --- |{" --- |" * len(variants)}',
            *(_claim(row, list(variants)) for row in about),
            '',
        ]
    return '\n'.join(lines)


def _claim(row: Mapping[str, Any], variants: Sequence[str]) -> str:
    cells = [f'{row["paper"]}<br><sub>{row["rule"]}</sub>']
    for variant in variants:
        found = row['verdicts'].get(variant)
        cells.append(f'**{found["verdict"]}**: {found["why"]}' if found else 'not computed')
    return f'| {" | ".join(cell.replace("|", "/") for cell in cells)} |'


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


if __name__ == '__main__':
    main()
