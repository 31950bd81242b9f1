# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The package's names load when used, and what does not need scipy does not load it."""

import subprocess
import sys

import pytest

import vibration_monitor


@pytest.mark.parametrize('name', vibration_monitor.__all__)
def test_every_public_name_loads(name: str) -> None:
    assert getattr(vibration_monitor, name).__name__ == name


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match='no_such_name'):
        _ = vibration_monitor.no_such_name


def test_configuration_and_recordings_need_no_scipy() -> None:
    code = (
        'import sys, vibration_monitor.monitor_config, rotor_recording.reading, '
        'rotor_recording.recording; '
        'sys.exit(any(name.startswith("scipy") for name in sys.modules))'
    )
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0
