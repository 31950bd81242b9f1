# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/architecture.png and write the table of imports into docs/architecture.md.

    python docs/make_architecture_figure.py

The packages come from ros_ws/packages.toml, the imports from their modules. An arrow leads from a
package to one that it imports; the picture leaves out arrows that follow from two others.
"""

import ast
import textwrap
import tomllib
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURE = ROOT / 'docs' / 'architecture.md', ROOT / 'docs' / 'images' / 'architecture.png'
MARK = '<!-- From here on written by make_architecture_figure.py from the imports. -->'
DESCRIPTIONS = {
    name: package['description'].strip().partition('.\n')[0]
    for name, package in tomllib.loads((ROOT / 'ros_ws/packages.toml').read_text())[
        'packages'
    ].items()
}
COLOURS = ('#e9ecef', '#e9ecef', '#d0ebff', '#d3f9d8', '#fff3bf')
WIDTH, HEIGHT, STEP_X, STEP_Y = 3.0, 1.15, 3.4, 1.85


def modules(package: str) -> list[str]:
    """Return the text of each module of a package, its tests aside."""
    folder = ROOT / 'ros_ws' / 'src' / package / package
    return [path.read_text('utf-8') for path in sorted(folder.rglob('*.py'))]


def imports(package: str) -> set[str]:
    """Return the packages of the rig that the modules of a package import."""
    found = set()
    for node in (node for text in modules(package) for node in ast.walk(ast.parse(text))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition('.')[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition('.')[0])
    return found & set(DESCRIPTIONS) - {package}


def table() -> str:
    """Return the generated part of the page."""
    rows = [MARK, '', '| package | imports |', '| --- | --- |']
    for package in reversed(DESCRIPTIONS):
        used = imports(package)
        names = ', '.join(f'`{name}`' for name in DESCRIPTIONS if name in used)
        rows.append(f'| `{package}` | {names or "nothing of the rig"} |')
    return '\n'.join(rows) + '\n'


def layers(used: dict[str, set[str]]) -> list[list[str]]:
    """Return the packages in rows from the bottom; each stands above all that it imports."""
    height: dict[str, int] = {}
    for package in DESCRIPTIONS:
        height[package] = 1 + max((height[name] for name in used[package]), default=-1)
    return [[p for p in height if height[p] == k] for k in range(max(height.values()) + 1)]


def arrange(rows: list[list[str]], arrows: set[tuple[str, str]]) -> dict[str, tuple[float, float]]:
    """Return the centre of each box: rows sorted by the mean place of their neighbours."""
    x = dict.fromkeys(DESCRIPTIONS, 0.0)
    for row in (*rows, *reversed(rows)):
        means = {}
        for name in row:
            near = [x[other] for pair in arrows if name in pair for other in pair if other != name]
            means[name] = sum(near) / max(len(near), 1)
        row.sort(key=means.__getitem__)
        x |= {name: (k - (len(row) - 1) / 2) * STEP_X for k, name in enumerate(row)}
    return {name: (x[name], k * STEP_Y) for k, row in enumerate(rows) for name in row}


def draw() -> Figure:
    """Draw boxes and arrows."""
    used = {package: imports(package) for package in DESCRIPTIONS}
    below: dict[str, set[str]] = {}
    for package in DESCRIPTIONS:
        below[package] = used[package].union(*(below[name] for name in used[package]))
    arrows = {
        (package, name)
        for package in DESCRIPTIONS
        for name in used[package]
        if not any(name in below[other] for other in used[package])
    }
    rows = layers(used)
    place = arrange(rows, arrows)
    figure = Figure(figsize=(11.5, 8.2), layout='constrained')
    axes = figure.subplots()
    for upper, lower in arrows:
        ends = []
        for name, side in ((upper, 0), (lower, 1)):
            others = sorted((p[1 - side] for p in arrows if p[side] == name), key=place.__getitem__)
            k = others.index((upper, lower)[1 - side]) - (len(others) - 1) / 2
            x, y = place[name]
            ends.append((x + k * 0.55, y + (side - 0.5) * HEIGHT))
        style = {
            'arrowstyle': '-|>',
            'color': '#495057',
            'linewidth': 1.1,
            'shrinkA': 0,
            'shrinkB': 0,
        }
        axes.annotate('', ends[1], ends[0], arrowprops=style)
    for k, row in enumerate(rows):
        for name in row:
            x, y = place[name]
            corner = (x - WIDTH / 2, y - HEIGHT / 2)
            style = {'boxstyle': 'round,pad=0,rounding_size=0.1', 'edgecolor': '#495057'}
            axes.add_patch(FancyBboxPatch(corner, WIDTH, HEIGHT, facecolor=COLOURS[k % 5], **style))
            axes.text(x, y + 0.36, name, ha='center', va='center', fontsize=11, weight='bold')
            text = textwrap.fill(DESCRIPTIONS[name], 40)
            axes.text(x, y + 0.0, text, ha='center', va='center', fontsize=7.5)
            size = sum(len(text.splitlines()) for text in modules(name))
            axes.text(x, y - 0.42, f'{size / 1000:.1f} k lines', ha='center', va='center',
                      fontsize=7.5, color='#868e96')  # fmt: skip
    half = max(abs(x) for x, _ in place.values()) + WIDTH / 2 + 0.1
    axes.set(
        xlim=(-half, half), ylim=(-HEIGHT / 2 - 0.1, (len(rows) - 1) * STEP_Y + HEIGHT / 2 + 0.1)
    )
    axes.set_axis_off()
    return figure


def main() -> None:
    """Write the picture and the page's table."""
    draw().savefig(PICTURE, dpi=110, metadata={'Software': None})
    PAGE.write_text(PAGE.read_text('utf-8').partition(MARK)[0] + table(), 'utf-8')


if __name__ == '__main__':
    main()
