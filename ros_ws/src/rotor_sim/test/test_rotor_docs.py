# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/physics.md says what the code says, and its example runs."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from rotor_common.configuration import range_text, unit_of
from rotor_sim import RotorParameters
from rotor_sim.plant.parameters import VARIANTS

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


@pytest.mark.slow
def test_the_error_of_run_ups_is_that_of_the_page(page: str) -> None:
    """The largest and the smallest of `derived`; in a variant that jumps it is far beyond them."""
    (text,) = re.findall(r'default step \(512\), `derived` .* displacements (\S+ to \S+),', page)
    low, high = (float(word) for word in text.split(' to '))
    (jumping,) = re.findall(r'whose stiffness jumps .* displacements (\S+) to', page)
    benchmark = runpy.run_path(str(PAGE.parents[1] / 'benchmarks' / 'run_up.py'))

    def error(variant: str, first: float, last: float) -> float:
        fine, default = (benchmark['states'](variant, first, last, n)[:, :6] for n in (8192, 512))
        return float(np.abs(default - fine).max())

    assert error('derived', 300.0, 360.0) == pytest.approx(high, rel=0.05)
    assert error('derived', 500.0, 800.0) == pytest.approx(low, rel=0.05)
    # after a jump two processors part, too: only how large it is can be said
    assert error('natural', 500.0, 800.0) > 0.1 * float(jumping)
