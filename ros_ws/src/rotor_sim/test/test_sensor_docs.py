# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/sensors.md says what the presets say and names every key."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from rotor_sim.sensors import PRESETS, SensorConfig
from rotor_sim.sensors.sensor_config import FixedErrors, Housing, Keyphasor, SensorGroup

PAGE = Path(__file__).parents[4] / 'docs' / 'sensors.md'


@pytest.fixture(scope='module')
def page() -> str:
    return PAGE.read_text(encoding='utf-8')


def value_text(value: Any) -> str:
    """A number, or amplitude and phase of each order of a runout."""
    if isinstance(value, tuple):
        orders = (f'{r["amplitude_m"]:.3g} m, {r["phase_rad"]:.4g} rad' for r in value)
        return '; '.join(f'{k}x {text}' for k, text in enumerate(orders, 1))
    return f'{value:.6g}'


def preset_rows(preset: str) -> list[str]:
    """One table row per number; paste these into the page when they change."""
    return [
        f'| `{key}` | {value_text(number.value)} | {number.source} |'
        for key, number in PRESETS[preset].items()
    ]


@pytest.mark.parametrize('preset', [name for name in PRESETS if name not in {'none', 'realistic'}])
def test_preset_table_is_that_of_the_code(page: str, preset: str) -> None:
    table = '\n'.join(preset_rows(preset))
    assert table in page, f'the table of {preset} must be:\n{table}'


def test_every_preset_and_key_is_named(page: str) -> None:
    for preset in PRESETS:
        assert f'`{preset}`' in page
    for model in (SensorGroup, FixedErrors, Keyphasor, Housing):
        for name in model.model_fields:
            assert f'`{name}`' in page, name


def test_example_is_a_configuration(page: str) -> None:
    text = page.split('```yaml\n', 1)[1].split('```', 1)[0]
    SensorConfig.from_mapping(yaml.safe_load(text)['sensors'])
