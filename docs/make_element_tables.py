# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Writes what the elements say into docs/plants.md: `python docs/make_element_tables.py`.

What stands above the mark in the page is written by hand, what follows comes from here.
"""

import inspect
from pathlib import Path
from typing import get_args

from pydantic.fields import FieldInfo

from rotor_common.configuration import bounds_of, range_text, unit_of
from rotor_sim.plant.element import Element
from rotor_sim.plant.registry import shipped_elements

PAGE = Path(__file__).with_name('plants.md')
MARK = '<!-- From here on written by make_element_tables.py from the elements. -->'


def _printed(value: object) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def _allowed(field: FieldInfo) -> str:
    if choices := get_args(field.annotation):
        return ', '.join(str(choice) for choice in choices)
    return range_text(field) if bounds_of(field) else ''


def section(kind: str, element: type[Element]) -> str:
    """Return the section of one element."""
    nodes = dict(element.touches)
    lines = [f'### `{kind}`', '', inspect.getdoc(element) or '', '']
    lines += ['| key | default | range | what |', '| --- | --- | --- | --- |']
    for name, field in element.model_fields.items():
        if name in {'kind', 'name'}:
            continue
        default = 'required' if field.is_required() else _printed(field.default)
        unit = unit_of(field)
        if not field.is_required() and unit not in {'', '1'}:
            default += f' {unit}'
        what = field.description or ''
        if name in nodes:
            what = f'node; {", ".join(nodes[name])}'
        if name in element.live:
            what += '; may change during a run'
        lines.append(f'| `{name}` | {default} | {_allowed(field)} | {what} |')
    return '\n'.join(lines)


def tables() -> str:
    """Return the generated part of the page."""
    kinds = sorted(shipped_elements().items())
    lines = [MARK, '', '| element | what |', '| --- | --- |']
    for kind, element in kinds:
        what = (inspect.getdoc(element) or '').partition('\n')[0]
        lines.append(f'| [`{kind}`](#{kind}) | {what} |')
    sections = '\n\n'.join(section(kind, element) for kind, element in kinds)
    return '\n'.join(lines) + f'\n\n{sections}\n'


def main() -> None:
    """Write the page."""
    by_hand = PAGE.read_text('utf-8').partition(MARK)[0]
    PAGE.write_text(by_hand + tables(), 'utf-8')


if __name__ == '__main__':
    main()
