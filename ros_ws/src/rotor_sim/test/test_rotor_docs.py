# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/physics.md says what the code says, and its example runs."""

import re
from pathlib import Path

import pytest

from rotor_interfaces.config import range_text, unit_of
from rotor_sim import RotorParameters
from rotor_sim.parameters import VARIANTS

PAGE = Path(__file__).parents[4] / 'docs' / 'physics.md'


@pytest.fixture(scope='module')
def page() -> str:
    return PAGE.read_text(encoding='utf-8')


def parameter_rows() -> list[str]:
    """One table row per physical parameter; paste these into the page when they change."""
    rows = []
    for name, field in RotorParameters.model_fields.items():
        if name in {'variant', *VARIANTS['derived']}:
            continue
        unit = unit_of(field)
        default = f'{field.default:.6g}' + (f' {unit}' if unit != '1' else '')
        rows.append(f'| `{name}` | {default} | {range_text(field)} | {field.description} |')
    return rows


def test_parameter_table_is_that_of_the_code(page: str) -> None:
    table = '\n'.join(parameter_rows())
    assert table in page, f'the table must be:\n{table}'


def test_every_variant_is_named(page: str) -> None:
    for variant in VARIANTS:
        assert f'| `{variant}`' in page


def test_example_runs(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r'```python\n(.*?)```', page, re.DOTALL)
    exec(compile(code, str(PAGE), 'exec'), {})  # noqa: S102 - the page's own example
    assert "'crack_stiffness_ratio': 0.15" in capsys.readouterr().out
