# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What the view logs, read back: every sample at its true time, and nothing made up."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

import view_flight
from rotor_common.constants import NANOSECONDS
from rotor_interfaces import messages, topics
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.messages import OFFLINE
from rotor_interfaces.waveform import WaveformBlock, encode
from rotor_view import RigView, style
from rotor_view.blueprint import blueprint
from view_flight import EPOCH_NS, RATE_HZ, Outgoing
from view_pictures import EXPECTED
from view_rows import Logged, curve, lines, logged

TRUE_TIME_NS = np.rint(np.arange(40_000) * NANOSECONDS / RATE_HZ).astype(np.int64)


class Files:
    """Connects each run of a view to a file of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.count = 0

    def __call__(self, stream: rr.RecordingStream) -> None:
        stream.save(self.folder / f'run_{self.count}.rrd')
        self.count += 1

    def read(self, run: int = 0) -> dict[str, Logged]:
        return logged(self.folder / f'run_{run}.rrd')


@pytest.fixture
def files(tmp_path: Path) -> Files:
    return Files(tmp_path)


def show(files: Files, outgoing: Iterable[Outgoing], batch_s: float = 0.25) -> RigView:
    view = RigView(files, batch_s=batch_s)
    for topic, stamp_ns, message in outgoing:
        view.push(topic, stamp_ns, message)
    view.flush()
    view._stream.disconnect()
    return view


def blocks(spans: Iterable[tuple[int, int]]) -> list[Outgoing]:
    return [view_flight.block_message(first, count) for first, count in spans]


def config(**document: Any) -> Outgoing:
    """Return a `rotor/config`, by default of a rig that tells nothing but that it is one."""
    text = json.dumps(document or {'scenario': {}})
    return topics.CONFIG, 0, messages.string(OFFLINE, text)


def changed(outgoing: Outgoing, **columns: Any) -> Outgoing:
    """Return a block of the test flight with columns replaced (None: left out)."""
    topic, stamp_ns, _ = outgoing
    first = round((stamp_ns - EPOCH_NS) * RATE_HZ / NANOSECONDS)
    rows = view_flight.rows_of(first, view_flight.BLOCK)
    for name, value in columns.items():
        if value is not None:
            rows[name] = value
    kept = [name for name in rows.dtype.names or () if columns.get(name, 0) is not None]
    table = np.empty(len(rows), [(name, rows.dtype[name]) for name in kept])
    for name in kept:
        table[name] = rows[name]
    return topic, stamp_ns, encode(WaveformBlock(stamp_ns, table), OFFLINE)


@pytest.mark.parametrize('batch_s', [0.25, 1.0])
@pytest.mark.parametrize('size', [64, 205, 1000])
def test_every_sample_stands_at_its_true_time_whatever_the_blocks(
    files: Files, size: int, batch_s: float
) -> None:
    total = 5000
    spans = [(first, min(size, total - first)) for first in range(0, total, size)]
    show(files, blocks(spans), batch_s)
    times, values = curve(files.read(), style.DISPLACEMENT)
    # a block's stamp and the time within it are rounded to a nanosecond each
    assert np.abs(times - TRUE_TIME_NS[:total]).max() <= 1
    rows = view_flight.rows_of(0, total)
    expected = np.stack([rows['disk_y'], rows['disk_z']], axis=1) * 1e6
    # float32 on the wire and once more after the factor: two roundings of 6e-8 each
    np.testing.assert_allclose(values, expected, rtol=2e-7)


def test_all_curves_arrive_with_their_numbers(files: Files) -> None:
    show(files, view_flight.flight(2.0))
    found = files.read()
    times, values = curve(found, style.LOAD)
    np.testing.assert_array_equal(times, np.arange(201) * 10_000_000)
    np.testing.assert_allclose(values[:, 0], view_flight.load_factor(times / 1e9), rtol=1e-12)
    assert not values[:, 1].any()
    times, values = curve(found, style.LOAD_SENSOR)
    # the mean over 0.1 s of n(t) differs from n at its middle by at most n'' T^2 / 24 = 1.1e-3,
    # and it is rounded to 1e-4
    np.testing.assert_allclose(values[:, 0], view_flight.load_factor(times / 1e9), atol=1.2e-3)
    times, values = curve(found, style.ACCELERATION)
    rows = view_flight.rows_of(0, len(times))
    np.testing.assert_array_equal(values, np.stack([rows['brg1_ay'], rows['brg1_az']], axis=1))
    assert (curve(found, style.SPEED)[1] == view_flight.SPEED_RAD_S).all()
    assert (curve(found, style.CRACK_TRUTH)[1] == 0.1).all()
    times, values = curve(found, style.ratios('disk_z'))
    np.testing.assert_allclose(values, np.outer(times / 1e9, [0.1, 2.0, 0.05, 0.02]))
    _, states = found['/alarm/level StateChange:state']
    assert states == [['STALE'], ['OK'], ['WARN'], ['ERROR']]
    assert lines(found)[-1] == 'crack_ratio_low = 0.02: above the ERROR limit'


def test_spectrum_stands_in_decibels_above_a_nanometre(files: Files) -> None:
    show(files, view_flight.flight(1.0))
    _, values = files.read()['/spectrum BarChart:values']
    bars = np.array(values[0][0]['buffer'] if isinstance(values[0][0], dict) else values[0])
    assert bars.max() == pytest.approx(20 * np.log10(20e-6 / 1e-9), abs=1e-3)


def test_messages_ahead_of_the_waveform_wait_for_it(files: Files) -> None:
    view = RigView(files)
    for topic, stamp_ns, message in view_flight.flight(2.0):
        if topic != topics.WAVEFORM or stamp_ns < EPOCH_NS + NANOSECONDS:
            view.push(topic, stamp_ns, message)
    view._stream.disconnect()
    found = files.read()
    newest = curve(found, style.DISPLACEMENT)[0][-1]
    assert 0.7e9 < newest < 1.0e9
    assert all(times.max(initial=0) <= newest for times, _ in found.values())


def test_a_viewer_that_joins_late_has_the_same_flight_time(files: Files) -> None:
    show(files, [m for m in view_flight.flight(2.0) if m[1] >= EPOCH_NS + NANOSECONDS])
    found = files.read()
    times, _ = curve(found, style.DISPLACEMENT)
    assert np.abs(times - TRUE_TIME_NS[RATE_HZ : 2 * RATE_HZ]).max() <= 1
    times, values = curve(found, style.LOAD)
    np.testing.assert_allclose(values[:, 0], view_flight.load_factor(times / 1e9), rtol=1e-12)


def test_a_gap_breaks_the_curves_and_is_told(files: Files) -> None:
    spans = [(first, 256) for first in range(0, 10240, 256) if first not in (2560, 2816)]
    view = show(files, blocks(spans))
    assert view.lost_samples == 512
    times, values = curve(files.read(), style.DISPLACEMENT)
    broken = np.flatnonzero(np.isnan(values).all(axis=1))
    assert len(broken) == 1
    assert times[broken[0] - 1] < times[broken[0]] < times[broken[0] + 1]
    assert times[broken[0] + 1] == TRUE_TIME_NS[3072]
    assert lines(files.read()) == ['samples are missing here (so far 512)']


@pytest.mark.slow
def test_a_sample_index_that_jumps_back_is_another_recording(files: Files) -> None:
    once = list(view_flight.flight(1.0))
    show(files, [*once, *once])
    assert files.count == 2
    runs = [curve(files.read(run), style.DISPLACEMENT) for run in (0, 1)]
    np.testing.assert_array_equal(runs[0][0], runs[1][0])
    np.testing.assert_array_equal(runs[0][1], runs[1][1])
    names = {
        store.recording_id
        for run in (0, 1)
        for store in RrdReader(str(files.folder / f'run_{run}.rrd')).recordings()
    }
    assert len(names) == 2


def test_a_missing_value_is_missing_in_the_view(files: Files) -> None:
    spoiled = np.zeros(256)
    spoiled[100:110] = np.nan
    first = changed(view_flight.block_message(0), disk_z=spoiled, load_y=np.nan)
    show(files, [config(), first, *blocks((k, 256) for k in range(256, 5120, 256))])
    found = files.read()
    _, values = curve(found, style.DISPLACEMENT)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(values[:, 1])), np.arange(100, 110))
    assert not np.isnan(values[:, 0]).any()
    poses = np.array([pose[0] for pose in found['/rig/disk Transform3D:translation'][1]])
    assert np.isfinite(poses).all()
    assert len(poses) == 5120 // 8 - 1  # of the poses, only that of sample 104 is lost


def test_a_source_with_fewer_columns_is_shown_as_far_as_it_goes(files: Files) -> None:
    leave_out = dict.fromkeys(
        ('angle', 'keyphasor', 'load_y', 'disk_y', 'brg2_y', 'brg2_z', 'brg1_ay', 'brg1_az')
    )
    outgoing = [changed(message, **leave_out) for message in blocks([(0, 256), (256, 256)])]
    view = show(files, outgoing)
    assert view.refusals == []
    _, values = curve(files.read(), style.DISPLACEMENT)
    assert values.shape == (512, 1)
    assert f'/{style.ACCELERATION} Scalars:scalars' not in files.read()


@pytest.mark.parametrize(
    ('columns', 'reason'),
    [
        ({'time': None}, 'no `time` column'),
        ({'time': np.nan}, 'does not count seconds upwards'),
        ({'time': 0.0}, 'does not count seconds upwards'),
        ({'time': np.linspace(0, 1e300, 256)}, 'does not count seconds upwards'),
        ({'sample': None}, 'no `sample` column'),
        ({'sample': 0.5}, 'is not a whole number'),
    ],
)
def test_a_block_without_a_place_is_left_out_and_told(
    files: Files, columns: dict[str, Any], reason: str
) -> None:
    good = view_flight.block_message(256)
    view = show(files, [changed(view_flight.block_message(0), **columns), good])
    assert len(view.refusals) == 1
    assert reason in view.refusals[0]
    assert reason in lines(files.read())[0]
    assert curve(files.read(), style.DISPLACEMENT)[0][0] == TRUE_TIME_NS[256]


def test_numbers_without_names_are_left_out_and_told(files: Files) -> None:
    topic, stamp_ns, message = view_flight.named(topics.TRUTH, 0.0, {'crack_stiffness_ratio': 0.1})
    message.name.append('one too many')
    view = show(files, [(topic, stamp_ns, message), view_flight.block_message(0)])
    told = '1 messages of rotor/truth break the wire contract and are not shown '
    assert view.refusals == [f'{told}(2 names for 1 numbers)']


def test_the_crack_is_marked_only_where_the_truth_tells_one(files: Files) -> None:
    def truth(time_s: float, ratio: float) -> Outgoing:
        return view_flight.named(topics.TRUTH, time_s, {'crack_stiffness_ratio': ratio})

    told = [truth(0.0, 0.0), truth(0.1, 0.0), truth(0.2, 0.05)]
    show(files, [config(), *told, *blocks([(0, 4096)])])
    found = files.read()
    times, _ = found['/rig/disk/crack Mesh3D:vertex_positions']
    assert times.tolist() == [200_000_000]
    times, _ = found['/rig/disk/crack Clear:is_recursive']
    assert times.tolist() == [0]


def test_the_crack_stands_where_the_configuration_says(files: Files) -> None:
    show(files, view_flight.flight(0.5))
    corners = np.array(files.read()['/rig/disk/crack Mesh3D:vertex_positions'][1][0])
    rim = corners[np.hypot(corners[:, 1], corners[:, 2]) > 0.15]
    angles = np.arctan2(rim[:, 2], rim[:, 1])
    # crack angle 1 rad in the flight's configuration, default half angle 30 degrees
    assert angles.min() == pytest.approx(1.0 - np.pi / 6, abs=1e-6)
    assert angles.max() == pytest.approx(1.0 + np.pi / 6, abs=1e-6)


@pytest.mark.parametrize(
    'text',
    [
        'no json',
        '{"ball_count": 1000000000}',
        '{"inner_radius_m": 5.0}',
        '{"crack_angle_rad": NaN}',
    ],
)
def test_an_unusable_configuration_is_told_and_changes_nothing(files: Files, text: str) -> None:
    message = messages.string(OFFLINE, text)
    show(files, [(topics.CONFIG, 0, message), view_flight.block_message(0)])
    assert lines(files.read())[0].startswith('rotor/config cannot be used')


def test_health_is_told_when_it_turns_bad_and_when_it_recovers(files: Files) -> None:
    levels = [0, 0, 1, 1, 0]
    sent = [
        view_flight.status(topics.DIAGNOSTICS, k / 10, v, f's{k}') for k, v in enumerate(levels)
    ]
    show(files, [*sent, *blocks([(0, 5120)])])
    assert lines(files.read()) == ['monitor: crack: s2', 'monitor: crack: s4']


def test_what_never_gets_a_waveform_is_bounded_and_shown_in_the_end(files: Files) -> None:
    view = RigView(files)
    for k in range(9000):
        stamp = view_flight.stamp_of(k / 100)
        view.push(topics.MANEUVER_LOAD, stamp, messages.load(OFFLINE, stamp, 9.81, 0.0))
    assert len(view._waiting) <= 8192
    view.flush()
    view._stream.disconnect()
    assert len(curve(files.read(), style.LOAD)[0]) == 9000


def test_every_view_of_the_layout_is_fed(files: Files) -> None:
    """A view whose entity nobody logs would stay empty for ever."""
    view = show(files, view_flight.flight(1.0))
    entities = {key.split(' ')[0] for key in files.read()}
    views = list(views_of(view))
    assert {view.name for view in views} == set(EXPECTED)
    for view in views:
        wanted = view.contents if isinstance(view.contents, list) else [f'+ {view.origin}/**']
        for entry in wanted:
            path = entry.removeprefix('+ ').removesuffix('/**')
            assert any(e == path or e.startswith(f'{path}/') for e in entities), (view.name, path)


def views_of(view: RigView) -> Iterable[Any]:
    assert view._page is not None
    return _views(blueprint(view._page).root_container)


def _views(container: Any) -> Iterable[Any]:
    for item in container.contents:
        if hasattr(item, 'contents') and not hasattr(item, 'origin'):
            yield from _views(item)
        else:
            yield item


def test_names_and_colours_are_declared_for_all_channels() -> None:
    for name in CHANNEL_COLUMNS:
        assert style.series_of(style.WAVEFORM, [name])[0].name != name
