# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The worked example of docs/extending/indicator.md runs as shown; wrong ones are refused."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from rotor_common.errors import ConfigError
from vibration_monitor import MonitorConfig

PAGE = Path(__file__).parents[1] / 'docs' / 'extending' / 'indicator.md'
FAMILY, USE, PRINTED = re.findall(r'```(?:python|text)\n(.*?)```', PAGE.read_text(), re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / 'my_indicators.py').write_text(FAMILY)
    (tmp_path / 'try_it.py').write_text(USE)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_example_prints_what_the_page_says(folder: Path) -> None:
    run = [sys.executable, 'try_it.py']
    found = subprocess.run(run, cwd=folder, capture_output=True, text=True, check=False)
    assert found.stdout == PRINTED, found.stderr
    # 10 um zero-to-peak, sampled 183 times a revolution
    assert {float(line.split()[0]) for line in PRINTED.splitlines()} == {2e-5}


def test_a_recording_does_not_choose_what_is_imported(folder: Path) -> None:
    (folder / 'never.py').write_text('raise SystemExit("imported")')
    config = {'scenario': {'monitor': {'extras': ['never:Family']}}}
    with pytest.raises(ConfigError, match='what a recording names is not imported'):
        MonitorConfig.of_run(config)


@pytest.mark.parametrize(
    ('code', 'sentence'),
    [
        ('class A: pass', 'wrong:A is not a class derived from Family'),
        ('', "indicator family 'wrong:A' cannot be loaded: module 'wrong' has no attribute 'A'"),
        (FAMILY.replace('title =', 'head ='), 'wrong:A does not declare its title'),
        (
            FAMILY.replace("('peak_to_peak'", "('rms'"),
            "wrong:A takes the name 'rms', which is an indicator already",
        ),
    ],
)
def test_a_wrong_family_ends_in_one_sentence(folder: Path, code: str, sentence: str) -> None:
    (folder / 'wrong.py').write_text(code.replace('class PeakToPeak', 'class A'))
    sys.modules.pop('wrong', None)
    with pytest.raises(ConfigError, match=re.escape(sentence)) as error:
        MonitorConfig(extras=('wrong:A',))
    assert '\n' not in str(error.value)
