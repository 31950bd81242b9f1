# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""docs/extending/detector.md as a reader follows it; the suite is flown in rotor_bench's tests."""

import re
import sys
from pathlib import Path

import pytest

from extending_support import RIG, blocks, installed, page, run


@pytest.mark.slow
def test_the_script_prints_what_the_page_says(tmp_path: Path) -> None:
    for name, code in zip(('my_detector', 'try_it'), blocks('detector', 'python'), strict=True):
        (tmp_path / f'{name}.py').write_text(code, 'utf-8')
    (printed,) = blocks('detector', 'text')
    for line in re.findall('^rotor-rig (simulate .*)$', page('detector'), re.MULTILINE):
        run(*RIG, *line.split(), cwd=tmp_path)
    said = run(sys.executable, 'try_it.py', cwd=tmp_path)
    number = re.compile(r'is (\S+) times')
    assert number.sub('', said) == number.sub('', printed)
    sound, cracked = (float(score) for score in number.findall(said))
    assert sound == 1.0, 'the flight that it was fitted on'
    assert cracked == pytest.approx(float(number.findall(printed)[1]), rel=0.01)


def test_installed_it_has_a_name(tmp_path: Path) -> None:
    site = installed('detector', 'my_detector', tmp_path)
    code = (
        'from vibration_monitor.detectors import protocol as p;'
        'made = p.load_detector(p.detector_target("second_order"))();'
        'p.check_detector(made, "second_order"); print(p.detector_names(), made.alarm_score)'
    )
    said = run(sys.executable, '-P', '-c', code, path=site)
    assert said == "['baseline', 'ratios', 'second_order', 'zones'] 2.0\n"
