# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the page says is true: the rules of this run's alarm, its words, the units of its file."""

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb

import view_flight
from rotor_interfaces import messages, topics
from rotor_interfaces.messages import OFFLINE
from rotor_interfaces.waveform import WaveformBlock, encode
from rotor_recording.reading import Recording, waveform_blocks
from rotor_recording.recording import RecordingWriter
from rotor_view import RigView, blueprint, style
from rotor_view.indicators import limits_path, value_path
from rotor_view.offline import convert
from rotor_view.rig_view import LIVE_BATCH_S
from vibration_monitor.monitor import VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig
from view_flight import EPOCH_NS, RATE_HZ, Outgoing
from view_rows import Logged, curve, lines, logged

Shown = tuple[dict[str, Logged], blueprint.Page]


def show(folder: Path, outgoing: Iterable[Outgoing], batch_s: float = LIVE_BATCH_S) -> Shown:
    """Return what a view has logged of these messages, and its page."""
    file = folder / 'view.rrd'
    view = RigView(lambda stream: stream.save(file), batch_s=batch_s)
    for topic, stamp_ns, message in outgoing:
        view.push(topic, stamp_ns, message)
    view.flush()
    view._stream.disconnect()
    assert view._page is not None
    return logged(file), view._page


def config(document: Any) -> Outgoing:
    return topics.CONFIG, 0, messages.string(OFFLINE, json.dumps(document))


def names_of(page: blueprint.Page) -> set[str]:
    """Return the names of the views of a page."""

    def views(container: Any) -> Iterable[str]:
        for item in container.contents:
            if hasattr(item, 'origin'):
                yield item.name
            else:
                yield from views(item)

    return set(views(blueprint.blueprint(page).root_container))


def legend(found: dict[str, Logged], path: str) -> list[str]:
    names: list[str] = found[f'/{path} SeriesLines:names'][1][-1]
    return names


RULES = [
    {'indicator': 'disk_z/amplitude_order_2', 'warn': 2e-6, 'error': 5e-6},
    {'indicator': 'brg1_ay/rms', 'warn': 3.0, 'error': 9.0},
    {'indicator': 'crack_ratio_low', 'warn': 0.01, 'error': 0.03},
]


def test_the_rules_of_the_run_are_drawn_with_their_limits_in_units(tmp_path: Path) -> None:
    told = config({'scenario': {'monitor': {'alarm': {'rules': RULES}}}})
    window = {
        'disk_z/amplitude_order_2': 4e-6,
        'brg1_ay/rms': 5.0,
        'crack_ratio_low': math.nan,
        'disk_z/ratio_2_1': 0.5,
    }
    sent = [view_flight.named(topics.INDICATORS, t, window) for t in (0.1, 0.2)]
    found, page = show(tmp_path, [told, view_flight.block_message(0, 4096), *sent])
    expected = {
        'disk_z/amplitude_order_2': (4.0, [2.0, 5.0], ['WARN 2 um', 'ERROR 5 um']),
        'brg1_ay/rms': (5.0, [3.0, 9.0], ['WARN 3 m/s^2', 'ERROR 9 m/s^2']),
        'crack_ratio_low': (math.nan, [0.01, 0.03], ['WARN 0.01', 'ERROR 0.03']),
    }
    for indicator, (value, limits, words) in expected.items():
        times, values = curve(found, value_path(indicator))
        assert times.tolist() == [100_000_000, 200_000_000]
        np.testing.assert_allclose(values[:, 0], value)
        assert legend(found, value_path(indicator)) == [indicator]
        times, values = curve(found, limits_path(indicator))
        assert times.tolist() == [0, 100_000_000, 200_000_000]
        np.testing.assert_allclose(values, [limits] * 3)
        assert legend(found, limits_path(indicator)) == words
    names = names_of(page)
    assert {
        'disk_z/amplitude_order_2 [um], judged by the alarm',
        'brg1_ay/rms [m/s^2], judged by the alarm',
        'Super-harmonic ratios of disk z [1], not judged',
    } <= names
    assert not any('crack_ratio_low' in name for name in names)  # it never had a value


def test_limits_that_nobody_told_are_not_drawn(tmp_path: Path) -> None:
    sent = view_flight.named(topics.INDICATORS, 0.1, {'crack_ratio_low': 0.1})
    found, _ = show(tmp_path, [view_flight.block_message(0, 4096), sent])
    assert not any(key.startswith(f'/{style.LIMITS}') for key in found)


def test_an_alarm_says_its_level_and_its_words_and_news_are_logged(tmp_path: Path) -> None:
    said = [
        (3, 'cannot judge: no window yet'),
        (3, 'cannot judge: 3 of the 10 s to settle are over'),
        (3, 'cannot judge: 4 of the 10 s to settle are over'),
        (0, 'OK'),
        (2, 'crack_ratio_low = 0.031: 3 of the last 5 windows reach the ERROR limit 0.02'),
        (2, 'crack_ratio_low = 3.5e-02: 5 of the last 5 windows reach the ERROR limit 0.02'),
        (7, 'a level that nobody knows'),
    ]
    sent = [
        view_flight.status(topics.ALARM, k / 20, level, text)
        for k, (level, text) in enumerate(said)
    ]
    found, _ = show(tmp_path, [view_flight.block_message(0, 4096), *sent])
    assert lines(found) == [said[k][1] for k in (0, 1, 3, 4, 6)]
    _, states = found['/alarm/level StateChange:state']
    assert states == [['STALE'], ['OK'], ['ERROR'], ['STALE']]
    _, sentences = found['/alarm/sentence TextDocument:text']
    names = ['STALE', 'STALE', 'STALE', 'OK', 'ERROR', 'ERROR', 'STALE']
    assert [sentence for (sentence,) in sentences] == [
        text if text == name else f'{name}: {text}'
        for name, (_, text) in zip(names, said, strict=True)
    ]


def test_what_cannot_be_judged_is_never_green() -> None:
    colours = dict(zip(style.LEVELS, style.LEVEL_COLOURS, strict=True))
    red, green, blue = colours['STALE']
    assert not green > 1.1 * max(red, blue)
    assert len(set(colours.values())) == len(colours)


def test_the_crack_is_told_in_a_flight_shorter_than_a_batch(tmp_path: Path) -> None:
    found, _ = show(tmp_path, view_flight.flight(1.0), batch_s=10.0)
    _, labels = found['/rig/text Points3D:labels']
    assert labels
    assert all(label.endswith('crack K = 0.1') for (label,) in labels)


def test_a_load_that_is_not_known_is_no_number(tmp_path: Path) -> None:
    rows = view_flight.rows_of(0, 4096)
    rows['load_y'] = np.nan
    block = topics.WAVEFORM, EPOCH_NS, encode(WaveformBlock(EPOCH_NS, rows), OFFLINE)
    found, page = show(tmp_path, [config({'scenario': {}}), block])
    _, labels = found['/rig/text Points3D:labels']
    assert labels
    assert all('n = -;' in label and 'nan' not in label for (label,) in labels)
    assert blueprint.LOAD_VIEW not in names_of(page)


def test_what_a_foreign_clock_stamps_does_not_stretch_the_time(tmp_path: Path) -> None:
    sent = []
    for stamp_ns in (12 * 10**9, 2_147_480_000 * 10**9):
        text = f'stamped {stamp_ns}'
        message = messages.diagnostics(
            OFFLINE, stamp_ns, f'node {stamp_ns}', level=1, text=text, values={}
        )
        sent.append((topics.DIAGNOSTICS, stamp_ns, message))
    found, _ = show(tmp_path, [*sent, view_flight.block_message(0, 4096)])
    # both are left out, which is said once
    assert len(lines(found)) == 1
    times = np.concatenate([times for times, _ in found.values()])
    assert times.min() >= 0
    assert times.max() <= 4096 / RATE_HZ * 1e9


# A recording that holds only what its sensors said


ANGLE_RAD_S = 250.0


def foreign(folder: Path, document: Any, **units: str) -> Path:
    """Write 3 s of an accelerometer and a probe pair of another machine, nothing else."""
    path = folder / 'foreign.mcap'
    rng = np.random.default_rng(1)
    names = ('brg1_ay', 'plate_y', 'plate_z')
    with RecordingWriter.single_file(path, config={**document, 'column_units': units}) as writer:
        for first in range(0, 3 * RATE_HZ, 256):
            sample = first + np.arange(256)
            angle = ANGLE_RAD_S * sample / RATE_HZ
            kinds = [('time', '<f8'), ('sample', '<f8'), ('angle', '<f8')]
            rows = np.empty(256, kinds + [(name, '<f4') for name in names])
            rows['time'], rows['sample'] = np.arange(256) / RATE_HZ, sample
            rows['angle'] = angle
            noise = rng.normal(0.0, 0.01, 256)
            rows['brg1_ay'] = 2.0 * np.cos(angle) + np.cos(2.0 * angle) + noise
            rows['plate_y'], rows['plate_z'] = 3e-6 * np.cos(angle), 4e-6 * np.sin(angle)
            stamp = EPOCH_NS + round(first * 1e9 / RATE_HZ)
            block = encode(WaveformBlock(stamp, rows), OFFLINE)
            writer.write(topics.WAVEFORM, messages.to_cdr(block), stamp, stamp)
    return path


def test_a_foreign_recording_shows_what_the_monitor_says_and_no_rotor(tmp_path: Path) -> None:
    path = foreign(tmp_path, {'import': {'file': 'x.csv'}})
    file = tmp_path / 'view.rrd'
    assert convert(Recording(path), file) == []
    found = logged(file)
    monitor = VibrationMonitor(MonitorConfig())
    records = [r for block in waveform_blocks(Recording(path)) for r in monitor.push(block)]
    assert len(records) > 3
    for channel in ('brg1_ay', 'plate_y', 'plate_z'):
        times, values = curve(found, style.ratios(channel))
        assert times.tolist() == [r.stamp_ns - EPOCH_NS for r in records]
        kinds = ('ratio_2_1', 'ratio_3_1', 'ratio_4_1', 'ratio_2.5_1')
        wanted = [[r.value(f'{channel}/{kind}') for kind in kinds] for r in records]
        np.testing.assert_array_equal(values, wanted)
    _, values = curve(found, style.WINDOW_SPEED)
    np.testing.assert_array_equal(values[:, 0], [r.value('speed_rad_s') for r in records])
    _, sentences = found['/alarm/sentence TextDocument:text']
    assert sentences[-1] == [f'STALE: {"; ".join(records[-1].alarm.reasons)}']
    assert '/spectrum BarChart:values' in found
    assert not any(key.startswith(('/rig', '/load', '/shaft', '/truth')) for key in found)
    times, values = curve(found, f'{style.WAVEFORM}/plate')
    assert times[-1] == pytest.approx(3e9 - 1e9 / RATE_HZ, abs=1)
    np.testing.assert_allclose(np.abs(values).max(axis=0), [3.0, 4.0], rtol=1e-3)


@pytest.mark.parametrize(('told', 'unit'), [({}, 'um'), ({'plate_y': 'unknown'}, 'unit unknown')])
def test_the_page_of_a_foreign_recording_names_what_it_holds(
    tmp_path: Path, told: dict[str, str], unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages: list[blueprint.Page] = []

    def laid_out(page: blueprint.Page) -> rrb.Blueprint:
        pages.append(page)
        return blueprint.blueprint(page)

    monkeypatch.setattr('rotor_view.rig_view.blueprint', laid_out)
    convert(Recording(foreign(tmp_path, {'import': {}}, **told)), tmp_path / 'view.rrd')
    assert names_of(pages[-1]) == {
        'Bearing 1 acceleration [m/s^2]',
        'Bearing 1 acceleration [m/s^2], latest 0.1 s',
        f'plate_y, plate_z [{unit}], latest 0.1 s',
        f'Orbit of plate [{unit}], 4 revolutions',
        'Order spectrum of bearing 1 y [dB re 1 mm/s^2]',
        'Spectrogram of bearing 1 y: order over flight time',
        'Super-harmonic ratios of bearing 1 y [1], not judged',
        'Amplitudes of bearing 1 y [m/s^2]',
        blueprint.ALARM_VIEW,
        blueprint.SENTENCE_VIEW,
        blueprint.LOG_VIEW,
        blueprint.SPEED_VIEW,
    }


def test_what_was_recorded_is_shown_as_recorded(tmp_path: Path) -> None:
    path = tmp_path / 'flight.mcap'
    with RecordingWriter.single_file(path) as writer:
        for topic, stamp_ns, message in view_flight.flight(3.0):
            time_ns = stamp_ns or EPOCH_NS
            writer.write(topic, messages.to_cdr(message), time_ns, time_ns)
    file = tmp_path / 'view.rrd'
    convert(Recording(path), file)
    found = logged(file)
    times, values = curve(found, value_path('crack_ratio_low'))
    np.testing.assert_allclose(values[:, 0], 0.01 * times / 1e9)
    assert lines(found)[-1] == 'crack_ratio_low = 0.02: above the ERROR limit'
    assert not any('computed' in line for line in lines(found))


def test_the_rules_of_a_recorded_scenario_judge_what_is_computed(tmp_path: Path) -> None:
    rules = [{'indicator': 'brg1_ay/ratio_2_1', 'warn': 0.3, 'error': 0.4}]
    path = foreign(tmp_path, {'scenario': {'monitor': {'alarm': {'rules': rules}, 'extras': []}}})
    file = tmp_path / 'view.rrd'
    convert(Recording(path), file)
    found = logged(file)
    _, values = curve(found, value_path('brg1_ay/ratio_2_1'))
    np.testing.assert_allclose(values, 0.5, rtol=1e-2)
    assert legend(found, limits_path('brg1_ay/ratio_2_1')) == ['WARN 0.3', 'ERROR 0.4']
    assert found['/alarm/level StateChange:state'][1][-1] == ['ERROR']
    # a scenario of a rig, but its disk was not measured
    assert not any(key.startswith('/rig') for key in found)
