# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Data sets on disk: the same bytes however they are made, labels that are true, going on."""

import json
import os
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from dataset_worlds import tree, write_tiny
from rotor_bench.dataset import run as dataset_run
from rotor_bench.dataset.folder import COLUMNS, JOURNAL, Folder, read_manifest
from rotor_bench.dataset.run import choose, make_dataset
from rotor_bench.dataset.stream import fly
from rotor_bench.dataset.suite import Flight, plan_suite
from rotor_bench.dataset.suite_config import load_suite
from rotor_bench.dataset.write import Row, file_of, write_flights
from rotor_bench.errors import DatasetError
from rotor_bench.evaluation import suites
from rotor_common import interrupt
from rotor_common.versions import versions
from rotor_dynamics.errors import AnalysisError
from rotor_interfaces import messages, topics
from rotor_interfaces.topics import Topic
from rotor_recording.reading import Recording
from rotor_rig.pipeline import analyze, simulate
from rotor_rig.scenario_model import load_scenario
from vibration_monitor.monitor import VibrationMonitor

OF_A_SIMULATOR = (
    topics.CONFIG,
    topics.MANEUVER_LOAD,
    topics.WAVEFORM,
    topics.SHAFT,
    topics.TRUTH,
)
Sent = dict[str, list[tuple[int, bytes]]]
"""Log times and bytes by the name of the topic."""


@pytest.fixture(scope='module')
def suite(tmp_path_factory: pytest.TempPathFactory) -> str:
    return write_tiny(tmp_path_factory.mktemp('suite'))


@pytest.fixture(scope='module')
def made(suite: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('data') / 'set'
    result = make_dataset(suite, folder, jobs=1)
    assert result.flights == result.written == 9
    assert result.flight_hours == pytest.approx((7 * 10.1 + 2 * 12.0) / 3600.0)
    return folder


def test_what_is_noted_is_counted_whenever_ctrl_c_comes(
    suite: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    note, done = Folder.add, []

    def add(folder: Folder, written: list[Row]) -> None:
        note(folder, written)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Folder, 'add', add)
    with pytest.raises(interrupt.Interrupted), interrupt.interruptible(signal.SIGINT):
        make_dataset(suite, tmp_path, jobs=1, on_progress=lambda now, _: done.append(now))
    noted = (tmp_path / JOURNAL).read_text('utf-8').splitlines()
    assert done == [0, len(noted)]
    assert noted


def name_of(topic: Topic) -> str:
    return f'/{topic.name.lstrip("/")}'


def sent_by_the_pipeline(flight: Flight) -> Sent:
    sent: Sent = {name_of(topic): [] for topic in OF_A_SIMULATOR}
    for step in simulate(flight.scenario):
        for topic, stamp_ns, message in step.messages:
            if name_of(topic) in sent:
                sent[name_of(topic)].append((stamp_ns, messages.to_cdr(message)))
    return sent


def recorded(path: Path) -> Sent:
    sent: Sent = {}
    for message in Recording(path).messages():
        assert message.publish_time_ns == message.log_time_ns
        sent.setdefault(message.topic, []).append((message.log_time_ns, message.data))
    return sent


@pytest.mark.parametrize('number', [0, 1])
def test_a_file_holds_what_the_simulator_says_byte_for_byte(
    suite: str, tmp_path: Path, number: int
) -> None:
    flight = plan_suite(suite)[0].flights[number]
    (row,) = write_flights([flight], tmp_path, versions())
    wanted = sent_by_the_pipeline(flight)
    found = recorded(tmp_path / row['file'])
    assert set(found) == set(wanted)
    for name, sent in wanted.items():
        assert found[name] == sent, name
    dense = {messages.from_cdr(data, topics.WAVEFORM.type).is_dense
             for _, data in found[name_of(topics.WAVEFORM)]}  # fmt: skip
    # the test flight loses samples of its probes now and then; without encoder nothing is dense
    has_gaps = not flight.rotor.encoder or number > 0
    assert (False in dense) == has_gaps


def test_lanes_and_blocks_change_no_byte(suite: str) -> None:
    flights = [machine.flights[1] for machine in plan_suite(suite)[:2]]
    together = [b'', b'']
    for blocks in fly(flights, 2048):
        for i, block in enumerate(blocks):
            together[i] += block.rows.tobytes()
    for i, flight in enumerate(flights):
        alone = [block.rows for (block,) in fly([flight], 5000)]
        rows, blocks_of = np.concatenate(alone), np.frombuffer(together[i], alone[0].dtype)
        for name in rows.dtype.names or ():
            if name != 'time':  # counts from the start of its block
                assert rows[name].tobytes() == blocks_of[name].tobytes(), name


def test_flights_of_two_lengths_do_not_fly_together(suite: str) -> None:
    machines = plan_suite(suite)
    with pytest.raises(DatasetError, match='2 lengths'):
        next(fly([machines[0].flights[0], machines[2].flights[1]], 2048))


@pytest.mark.slow
def test_processes_change_no_byte(suite: str, made: Path, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    result = make_dataset(
        suite, tmp_path / 'set', jobs=2, on_progress=lambda *numbers: seen.append(numbers)
    )
    assert result.times_real_time is not None
    assert tree(tmp_path / 'set') == tree(made)
    assert seen[0] == (0, 9)
    assert seen[-1] == (9, 9)
    assert seen == sorted(seen)


def test_the_folder_is_what_its_files_say(suite: str, made: Path) -> None:
    rows = read_manifest(made)
    assert [tuple(row) for row in rows] == [tuple(COLUMNS)] * 9
    flights = [flight for machine in plan_suite(suite) for flight in machine.flights]
    names = sorted(str(path.relative_to(made)) for path in made.glob('flights/*'))
    assert sorted(row['file'] for row in rows) == names
    assert {path.name for path in made.iterdir()} == {
        'flights', 'manifest.parquet', 'suite.json', 'README.txt',
    }  # fmt: skip
    for row, flight in zip(rows, flights, strict=True):
        assert row['file'] == file_of(flight)
        assert row['size_bytes'] == (made / row['file']).stat().st_size
        assert row['sha256'] == tree(made)[row['file']]
        assert {name: row[name] for name in flight.labels} == flight.labels
        assert (row['machine'], row['number']) == (flight.machine, flight.number)
    metadata = parquet.read_schema(made / 'manifest.parquet').metadata
    assert json.loads(metadata[b'suite']) == load_suite(suite).plain()
    readme = (made / 'README.txt').read_text()
    assert all(f'  {name} ' in readme for name in COLUMNS)


def test_labels_are_what_the_recording_says_of_itself(suite: str, made: Path) -> None:
    flights = [flight for machine in plan_suite(suite) for flight in machine.flights]
    for row, flight in zip(read_manifest(made), flights, strict=True):
        path = made / row['file']
        assert load_scenario(str(path)) == flight.scenario
        sent = recorded(path)
        states = [
            messages.from_cdr(data, topics.TRUTH.type) for _, data in sent[name_of(topics.TRUTH)]
        ]
        truth = [dict(zip(state.name, state.position, strict=True)) for state in states]
        assert truth[0]['eccentricity_m'] == row['eccentricity_m']
        assert truth[0]['clearance_m'] == row['clearance_m']
        assert truth[0]['forcing_n'] == row['forcing_n']
        depths = [now['crack_stiffness_ratio'] for now in truth]
        if row['crack'] == 'growing':
            assert depths[0] == 0.0
            # the last block starts 0.2 s before the end of 12 s
            assert depths[-1] == pytest.approx(row['crack_stiffness_ratio'], rel=0.02)
        else:
            assert set(depths) == {row['crack_stiffness_ratio']}
        loads = [now['load_factor'] for now in truth]
        assert row['load_factor_min'] - 1e-9 <= min(loads)
        assert max(loads) <= row['load_factor_max'] + 1e-9
        assert str(row['crack_stiffness_ratio']) not in path.name


def test_the_monitor_reads_a_flight(made: Path) -> None:
    path = made / read_manifest(made)[0]['file']
    monitor = VibrationMonitor(load_scenario(str(path)).monitor)
    windows = list(analyze(Recording(path), monitor))
    assert len(windows) > 3
    assert monitor.status()['lost samples [1]'] == 0


@pytest.mark.slow
def test_a_second_run_mends_what_is_missing_or_damaged(
    suite: str, made: Path, tmp_path: Path
) -> None:
    folder = tmp_path / 'set'
    shutil.copytree(made, folder)
    rows = read_manifest(folder)
    (folder / rows[0]['file']).unlink()
    damaged = folder / rows[4]['file']
    data = bytearray(damaged.read_bytes())
    data[len(data) // 2] ^= 1
    damaged.write_bytes(data)
    (folder / rows[5]['file']).write_bytes(b'half')
    left = folder / '.unfinished' / 'tmpabc'
    left.mkdir(parents=True)
    (left / 'x.mcap.active').write_bytes(b'')
    assert make_dataset(suite, folder, jobs=1).written == 3
    assert tree(folder) == tree(made)
    assert not (folder / '.unfinished').exists()
    nothing = make_dataset(suite, folder, jobs=1)
    assert nothing.written == 0
    assert nothing.times_real_time is None
    assert tree(folder) == tree(made)


@pytest.mark.slow
def test_a_run_goes_on_after_the_journal_of_one_that_was_killed(
    suite: str, made: Path, tmp_path: Path
) -> None:
    folder = tmp_path / 'set'
    shutil.copytree(made, folder)
    rows = read_manifest(folder)
    (folder / 'manifest.parquet').unlink()
    lines = [json.dumps(row) for row in rows[:5]]
    (folder / 'finished.jsonl').write_text('\n'.join([*lines, lines[0][:40]]))
    assert make_dataset(suite, folder, jobs=1).written == 4
    assert tree(folder) == tree(made)


@pytest.mark.slow
def test_a_part_of_a_suite_grows_into_the_whole(suite: str, made: Path, tmp_path: Path) -> None:
    folder = tmp_path / 'set'
    first = make_dataset(suite, folder, jobs=1, split='test')
    assert first.flights == 3
    assert make_dataset(suite, folder, jobs=1, machines=1).flights == 3 + 3
    assert make_dataset(suite, folder, jobs=1).written == 3
    assert tree(folder) == tree(made)


def test_machines_are_chosen_evenly() -> None:
    machines = plan_suite('standard')
    chosen = choose(machines, count=7)
    assert [machine.number for machine in chosen] == [0, 12, 24, 36, 48, 60, 72]
    assert all(machine.split == 'train' for machine in choose(machines, split='train'))
    assert choose(machines, count=len(machines)) == list(machines)


def test_a_folder_of_something_else_is_left_alone(
    suite: str, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dataset_run, '_workers', lambda *_: pytest.fail('it computed'))
    before = tree(made)
    with pytest.raises(DatasetError, match='holds a data set of another seed'):
        make_dataset(suite, made, seed=1)
    with pytest.raises(DatasetError, match='holds a data set of another suite'):
        make_dataset('smoke', made)
    monkeypatch.setattr(dataset_run, 'versions', lambda: {'rotor_sim': '99'})
    with pytest.raises(DatasetError, match='holds a data set of other versions'):
        make_dataset(suite, made)
    assert tree(made) == before
    (tmp_path / 'letter.txt').write_text('dear')
    with pytest.raises(DatasetError, match='not empty and holds no data set'):
        make_dataset(suite, tmp_path)
    with pytest.raises(DatasetError, match='cannot be written'):
        make_dataset(suite, tmp_path / 'letter.txt')
    assert tree(tmp_path).keys() == {'letter.txt'}


def test_arguments_that_do_not_serve_are_refused_before_a_folder_is_made(
    suite: str, tmp_path: Path
) -> None:
    folder = tmp_path / 'set'
    with pytest.raises(AnalysisError, match='--jobs 0'):
        make_dataset(suite, folder, jobs=0)
    with pytest.raises(DatasetError, match='--machines 4 is out of range; allowed: 1 to 3'):
        make_dataset(suite, folder, machines=4)
    with pytest.raises(DatasetError, match='seed = -5'):
        make_dataset(suite, folder, seed=-5)
    assert not folder.exists()


def test_no_manifest_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r'manifest\.parquet cannot be read'):
        read_manifest(tmp_path)


def test_a_data_set_of_the_old_spelling_is_read_and_mended(
    suite: str, made: Path, tmp_path: Path
) -> None:
    """Suite, manifest, journal and YAML once said `manoeuvre`."""
    folder = tmp_path / 'set'
    shutil.copytree(made, folder)
    text = (folder / 'suite.json').read_text()
    assert '"maneuver": {' in text
    (folder / 'suite.json').write_text(text.replace('"maneuver": {', '"manoeuvre": {'))
    table = parquet.read_table(folder / 'manifest.parquet')
    old = ['manoeuvre' if name == 'maneuver' else name for name in table.column_names]
    parquet.write_table(table.rename_columns(old), folder / 'manifest.parquet')
    assert read_manifest(folder) == read_manifest(made)
    assert suites.load(str(folder), seed=0, split='test', limit=None).config == load_suite(suite)
    assert make_dataset(suite, folder, jobs=1).written == 0
    assert tree(folder) == tree(made)
    file = tmp_path / 'old.yaml'
    file.write_text('base: smoke\nmanoeuvre: {blend_s: 0.7}\n')
    smoke = load_suite('smoke')
    assert load_suite(str(file)).maneuver == smoke.maneuver.model_copy(update={'blend_s': 0.7})
