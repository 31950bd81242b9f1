# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The detectors (a) and (b) on signals whose verdict is known, and what a detector must offer."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from monitor_signals import RATE_HZ, blocks, signal, steady_angle, table
from rotor_interfaces.waveform import WaveformBlock
from vibration_monitor.detectors import zones
from vibration_monitor.detectors.protocol import (
    Verdict,
    check_detector,
    detector_names,
    detector_target,
    load_detector,
)
from vibration_monitor.detectors.ratios import RatioDetector
from vibration_monitor.detectors.zones import ZoneDetector, rms_velocity
from vibration_monitor.errors import MonitorError
from vibration_monitor.persistence import Persistence

SPEED_RAD_S = 352.0


def shaken(velocity_m_s: float, seconds: float = 8.0, frequency_hz: float = 60.0) -> np.ndarray:
    """Return rows whose four accelerometers shake with a given RMS velocity."""
    angle = steady_angle(seconds, SPEED_RAD_S)
    time = np.arange(len(angle)) / RATE_HZ
    omega = 2 * math.pi * frequency_hz
    shake = math.sqrt(2) * velocity_m_s * omega * np.cos(omega * time)
    return table(angle, dict.fromkeys(('brg1_ay', 'brg1_az', 'brg2_ay', 'brg2_az'), shake))


def last(detector: RatioDetector | ZoneDetector, stream: list[WaveformBlock]) -> Verdict:
    verdict = Verdict(math.nan, '')
    for block in stream:
        verdict = detector.push(block)
    return verdict


@given(
    st.lists(st.floats(-5, 5) | st.just(math.nan), max_size=30),
    st.integers(1, 5),
    st.integers(0, 5),
    st.floats(-5, 5),
)
def test_persistence_reaches_a_limit_exactly_while_so_many_values_do(
    values: list[float], required: int, more: int, limit: float
) -> None:
    out_of = required + more
    persistence = Persistence(required, out_of)
    for number, value in enumerate(values, 1):
        level = persistence.update(value)
        window = values[max(0, number - out_of) : number]
        assert (level >= limit) == (sum(v >= limit for v in window) >= required)
        assert math.isnan(level) == (sum(not math.isnan(v) for v in window) < required)


@pytest.mark.parametrize(('second', 'third', 'score'), [(0.15, 0.1, 0.5), (0.15, 1.0, 2.0)])
def test_ratio_score_is_the_higher_ratio_over_its_limit(
    second: float, third: float, score: float
) -> None:
    angle = steady_angle(4.0, SPEED_RAD_S)
    disk = signal(angle, [(1, 1e-5, 0.0), (2, second * 1e-5, 1.0), (3, third * 1e-5, 2.0)])
    rows = table(angle, {'disk_y': disk, 'disk_z': disk})
    verdict = last(RatioDetector(), blocks(rows, 2048))
    # limits 0.3 and 0.5; the amplitudes are true to 1e-4 (docs/monitor.md)
    assert verdict.score == pytest.approx(score, rel=1e-3)
    assert verdict.evidence.startswith('disk_z/ratio_3_1' if third > 0.5 else 'disk_z/ratio_2_1')


def test_ratios_say_nothing_before_three_windows() -> None:
    angle = steady_angle(4.0, SPEED_RAD_S)
    disk = signal(angle, [(1, 1e-5, 0.0)])
    detector = RatioDetector()
    scores = [detector.push(b).score for b in blocks(table(angle, {'disk_z': disk}), 2048)]
    # three windows end after (64 + 2 * 32) revolutions, 2.285 s, in block 12 of 0.2 s
    assert [math.isnan(score) for score in scores] == [True] * 11 + [False] * 9


@pytest.mark.parametrize('frequency_hz', [10.0, 37.3, 60.0, 999.0])
def test_velocity_is_acceleration_over_angular_frequency(frequency_hz: float) -> None:
    time = np.arange(RATE_HZ) / RATE_HZ
    omega = 2 * math.pi * frequency_hz
    shake = 2.0 * np.cos(omega * time + 0.4)
    found = rms_velocity(shake[np.newaxis], RATE_HZ)[0]
    # at the edges of the band half of the main lobe is outside
    inside = 12.0 < frequency_hz < 997.0
    assert found == pytest.approx(2.0 / omega / math.sqrt(2), rel=2e-3 if inside else 0.5)


@pytest.mark.parametrize('frequency_hz', [0.0, 5.0, 1050.0, 3000.0])
def test_nothing_outside_the_band_counts(frequency_hz: float) -> None:
    time = np.arange(RATE_HZ) / RATE_HZ
    shake = 5.0 + 2.0 * np.cos(2 * math.pi * frequency_hz * time)
    assert rms_velocity(shake[np.newaxis], RATE_HZ)[0] < 1e-9


@pytest.mark.parametrize(
    ('multiple', 'zone'), [(0.9, 'A'), (1.4, 'B'), (1.6, 'B'), (3.0, 'C'), (4.0, 'D')]
)
def test_zones_are_multiples_of_the_reference(multiple: float, zone: str) -> None:
    detector = ZoneDetector()
    detector.fit([blocks(shaken(0.5e-3), 2048), blocks(shaken(1e-3), 2048)])
    verdict = last(detector, blocks(shaken(multiple * 1e-3), 2048))
    assert verdict.score == pytest.approx(multiple / zones.ALARM, rel=1e-3)
    assert (verdict.score >= detector.alarm_score) == (multiple > 1.5)
    assert verdict.evidence.endswith(f'zone {zone}')


def test_zones_do_not_depend_on_the_block_size() -> None:
    rows = shaken(2e-3)
    found = []
    for size in (256, 2048, 3000):
        detector = ZoneDetector()
        detector.fit([blocks(shaken(1e-3), size)])
        found.append(last(detector, blocks(rows, size)))
    assert found[0] == found[1] == found[2]


def test_a_gap_or_a_missing_sample_makes_no_number() -> None:
    detector = ZoneDetector()
    detector.fit([blocks(shaken(1e-3), 2048)])
    stream = blocks(shaken(9e-3), 2048)
    with_gaps = [block for number, block in enumerate(stream) if number % 3]
    assert math.isnan(last(detector, with_gaps).score)
    broken = shaken(9e-3)
    for name in ('brg1_ay', 'brg1_az', 'brg2_ay'):
        broken[name][::5000] = math.nan
    verdict = last(detector, blocks(broken, 2048))
    assert verdict.evidence.startswith('brg2_az')


def test_zones_without_reference_say_nothing() -> None:
    assert math.isnan(last(ZoneDetector(), blocks(shaken(1e-3), 2048)).score)


def test_detectors_are_found_by_name_and_by_module() -> None:
    assert {'ratios', 'zones', 'baseline'} <= set(detector_names())
    target = detector_target('ratios')
    assert load_detector(target) is RatioDetector
    assert detector_target('package.module:Class') == 'package.module:Class'
    with pytest.raises(MonitorError, match="'ratio' is not known"):
        detector_target('ratio')
    with pytest.raises(MonitorError, match='cannot be loaded'):
        load_detector('vibration_monitor.detectors.ratios:Nothing')


def test_what_is_no_detector_is_refused_in_a_sentence() -> None:
    class Half:
        alarm_score = 1.0

        def fit(self, flights: object) -> None:
            """Learn nothing."""

    with pytest.raises(MonitorError, match='has no method push'):
        check_detector(Half(), 'm:Half')
    detector = RatioDetector()
    detector.alarm_score = math.nan
    with pytest.raises(MonitorError, match='alarm_score'):
        check_detector(detector, 'm:Ratio')
    assert check_detector(ZoneDetector(), 'm:Zone').alarm_score == 1.0
