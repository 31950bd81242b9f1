# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Writes what the registry says into docs/indicators.md: `python docs/make_indicator_tables.py`.

What stands above the mark in the page is written by hand, what follows comes from here.
"""

import inspect
from pathlib import Path

from vibration_monitor import MonitorConfig
from vibration_monitor.indicators import FAMILIES, Family

PAGE = Path(__file__).with_name('indicators.md')
MARK = '<!-- From here on written by make_indicator_tables.py from the registry. -->'
_OF = {'window': 'the window', 'channel': 'each channel', 'plane': 'each plane'}


def section(family: type[Family]) -> str:
    """Return the section of one family."""
    head = family.title if family.is_always_on else f'{family.title} (`{family.key}`)'
    lines = [f'## {head}', '', inspect.getdoc(family) or '', '']
    if family.indicators:
        lines += ['| name | unit | what |', '| --- | --- | --- |']
        names = [(each, each.name.replace('{order}', 'X')) for each in family.indicators]
        lines += [f'| `{name}` | {each.unit} | {each.what} |' for each, name in names]
        lines.append('')
        if family.orders:
            lines += [f'X is {", ".join(f"{order:g}" for order in family.orders)}.', '']
    lines += [f'- Of: {_OF[family.of]}.', f'- Needs: {family.needs}']
    lines.append(f'- Fooled by: {family.fooled_by}')
    if family.source:
        lines.append(f'- Source: {family.source}')
    return '\n'.join(lines)


def tables() -> str:
    """Return the generated part of the page."""
    default = MonitorConfig().extras
    lines = [MARK, '', '| extra | by default | what |', '| --- | --- | --- |']
    for family in FAMILIES:
        what = (inspect.getdoc(family) or '').partition('\n')[0]
        key = '(always)' if family.is_always_on else f'`{family.key}`'
        is_on = 'yes' if family.is_always_on or family.key in default else ''
        lines.append(f'| {key} | {is_on} | {family.title}: {what} |')
    sections = '\n\n'.join(section(family) for family in FAMILIES)
    return '\n'.join(lines) + f'\n\n{sections}\n'


def main() -> None:
    """Write the page."""
    by_hand = PAGE.read_text('utf-8').partition(MARK)[0]
    PAGE.write_text(by_hand + tables(), 'utf-8')


if __name__ == '__main__':
    main()
