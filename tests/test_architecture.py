# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/architecture.md is about the packages that there are, and about their real imports."""

import functools
import runpy
from pathlib import Path

import pytest

from test_workspace import PACKAGES, SOURCES
from test_workspace import imports_of as uncached

DOCS = Path(__file__).parents[1] / 'docs'
PAGE = (DOCS / 'architecture.md').read_text('utf-8')
imports_of = functools.cache(uncached)


@pytest.mark.parametrize('package', PACKAGES)
def test_a_package_has_a_paragraph_that_names_files_of_it(package: str) -> None:
    (paragraph,) = (text for text in PAGE.split('\n\n') if text.startswith(f'**`{package}`**'))
    flat = ' '.join(paragraph.split())
    looked_at = flat.partition('Look first at ')[2].split('`')[1::2]
    files = [word for word in looked_at if word.endswith('.py')]
    assert files
    assert all((SOURCES / package / package / file).is_file() for file in files)


@pytest.mark.parametrize('package', PACKAGES)
def test_the_table_has_the_real_imports(package: str) -> None:
    used = [f'`{name}`' for name in PACKAGES if name in imports_of(package)]
    row = f'| `{package}` | {", ".join(used) or "nothing of the rig"} |'
    assert row in PAGE, 'run docs/make_architecture_figure.py'


def test_every_arrow_points_down_and_none_is_missing() -> None:
    """The layers of the picture: each package stands above all that it imports."""
    made = runpy.run_path(str(DOCS / 'make_architecture_figure.py'))
    used = {package: imports_of(package) & set(PACKAGES) for package in PACKAGES}
    assert used == {package: made['imports'](package) for package in PACKAGES}
    height = {name: k for k, row in enumerate(made['layers'](used)) for name in row}
    assert set(height) == set(PACKAGES)
    assert all(height[name] < height[package] for package in PACKAGES for name in used[package])
    made['draw']()


def test_what_moved_is_where_the_page_says() -> None:
    """The right column of the table names modules that there are."""
    page = (DOCS / 'migration.md').read_text('utf-8').partition('| module before')[2]
    rows = [line.split(' | ') for line in page.splitlines() if line.startswith('| `')]
    assert len(rows) > 50
    for row in rows:
        for module in row[1].split('`')[1::2]:
            package, *parts = module.removesuffix('.*').split('.')
            path = SOURCES.joinpath(package, package, *parts)
            assert path.with_suffix('.py').is_file() or path.is_dir(), module
