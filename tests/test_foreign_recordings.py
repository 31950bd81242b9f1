# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that other programs made: read, dated by their samples, or named in one sentence.

Each is the same flight in another wrapping, so that what is right is known: the plain one's.
"""

import json
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import pytest
import yaml
import zstandard
from mcap.writer import Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from typer.testing import CliRunner

from rig_support import Rig
from rotor_bringup.cli import app
from rotor_common.constants import NANOSECONDS
from rotor_interfaces import messages, topics
from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns, to_cdr, typestore
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_recording.errors import RecordingError
from rotor_recording.reading import Recording
from rotor_view.offline import convert

EPOCH_NS = 1_700_000_000 * NANOSECONDS
RATE_HZ, BLOCK, BLOCKS = 10240, 256, 120
WALL_NS = 1_790_000_000 * NANOSECONDS
LATE_NS = 2_147_480_000 * NANOSECONDS
DECADES_NS = 50 * 365 * 86400 * NANOSECONDS
RULE = {'indicator': 'disk_z/amplitude_order_1', 'warn': 1e-6, 'error': 1.0}
CONFIG = json.dumps({'scenario': {'monitor': {'alarm': {'rules': [RULE]}}}})

Sent = tuple[str, str, int, bytes]
"""Topic, type, log time in ns, bytes."""


def block_of(number: int, *, epoch_ns: int = EPOCH_NS, running_time: bool = False) -> bytes:
    """Return a block of a rotor that turns steadily, with 5 um of order 1."""
    rows = np.zeros(BLOCK, WAVEFORM_DTYPE)
    sample = number * BLOCK + np.arange(BLOCK)
    rows['sample'] = sample
    rows['time'] = (sample if running_time else np.arange(BLOCK)) / RATE_HZ
    rows['angle'] = 352.0 * sample / RATE_HZ
    for name in CHANNEL_COLUMNS:
        rows[name] = 5e-6 * np.cos(rows['angle'])
    stamp_ns = epoch_ns if running_time else stamp_of(number, epoch_ns)
    return to_cdr(encode(WaveformBlock(stamp_ns, rows), OFFLINE))


def stamp_of(number: int, epoch_ns: int = EPOCH_NS) -> int:
    return sample_stamp_ns(epoch_ns, number * BLOCK, RATE_HZ)


def flight(namespace: str = '', blocks: int = BLOCKS, **changes: Any) -> Iterator[Sent]:
    text = to_cdr(messages.string(OFFLINE, CONFIG))
    yield f'{namespace}/rotor/config', topics.CONFIG.type, EPOCH_NS, text
    for number in range(blocks):
        data = block_of(number, **changes)
        yield f'{namespace}/rotor/waveform', topics.WAVEFORM.type, stamp_of(number), data


def health(stamp_ns: int, log_time_ns: int) -> Sent:
    """Return a diagnosis by somebody else."""
    status = messages.diagnostics(OFFLINE, stamp_ns, 'disk', level=1, text='full', values={})
    return '/diagnostics', topics.DIAGNOSTICS.type, log_time_ns, to_cdr(status)


def write(path: Path, sent: Iterator[Sent] | list[Sent]) -> Path:
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=2**16)
        writer.start('ros2')
        channels: dict[tuple[str, str], int] = {}
        for topic, kind, log_time_ns, data in sent:
            if (topic, kind) not in channels:
                schema = writer.register_schema(kind, 'ros2msg', b'')
                channels[topic, kind] = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channels[topic, kind], log_time_ns, data, log_time_ns)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def metadata(folder: Path, names: list[str], **changes: str) -> Path:
    information = {
        'version': 9,
        'storage_identifier': 'mcap',
        'relative_file_paths': names,
        'compression_format': '',
        'compression_mode': '',
        **changes,
    }
    text = yaml.safe_dump({'rosbag2_bagfile_information': information})
    (folder / 'metadata.yaml').write_text(text)
    return folder


def call(*arguments: object) -> tuple[int, str, str]:
    """Return exit code, output and what was said of a command."""
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exc_info
    return done.exit_code, done.stdout, ' '.join(done.stderr.split())


def refuse_constant(name: str) -> None:
    raise AssertionError(f'{name} is not JSON')


def analyzed(path: Path, *options: str) -> tuple[dict[str, Any], str]:
    code, out, said = call('analyze', path, '--json', *options)
    assert code == 0, said
    return json.loads(out, parse_constant=refuse_constant), said


@pytest.fixture(scope='module')
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp('plain') / 'plain.mcap', flight())


@pytest.fixture(scope='module')
def right(plain: Path) -> dict[str, Any]:
    """What is said of the flight: 3 s, an alarm as soon as it is possible."""
    summary, said = analyzed(plain)
    assert said == ''
    assert summary['simulated_s'] == 3.0
    assert summary['windows'] == 7
    # windows of 64 turns every 16, and the alarm wants three of them: 96 turns
    assert summary['first_alarm_s'] == pytest.approx(96 * 2 * np.pi / 352, abs=2 / RATE_HZ)
    return summary


def same(summary: dict[str, Any], right: dict[str, Any]) -> None:
    for name in right.keys() - {'real_time_factor', 'damage'}:
        assert summary[name] == right[name], name


# Times


def at_wall_time(sent: Iterator[Sent]) -> Iterator[Sent]:
    for number, (topic, kind, _, data) in enumerate(sent):
        yield topic, kind, WALL_NS + number * 3_000_000, data


DATES: dict[str, Callable[[], list[Sent]]] = {
    'log times of another recorder': lambda: list(at_wall_time(flight())),
    'log times of 0': lambda: [(t, k, 0, d) for t, k, _, d in flight()],
    'diagnostics of 1970': lambda: [health(12, 12), *flight()],
    'diagnostics of 2038': lambda: [*flight(), health(LATE_NS, LATE_NS)],
    'diagnostics stamped in 1970': lambda: [*flight(), health(12, EPOCH_NS)],
    'config long before': lambda: [
        (t, k, time_ns - DECADES_NS * (t == '/rotor/config'), d) for t, k, time_ns, d in flight()
    ],
    'time column from the start': lambda: list(flight(running_time=True)),
}


@pytest.mark.parametrize('name', DATES)
def test_times_are_those_of_the_samples(tmp_path: Path, right: dict[str, Any], name: str) -> None:
    summary, said = analyzed(write(tmp_path / 'run.mcap', DATES[name]()))
    same(summary, right)
    assert said == ''


@pytest.mark.parametrize('year', ['1970', '2038'])
def test_a_view_leaves_out_what_is_not_of_the_flight(tmp_path: Path, year: str) -> None:
    path = write(tmp_path / 'run.mcap', DATES[f'diagnostics of {year}']())
    (sentence,) = convert(Recording(path), tmp_path / 'view.rrd')
    assert sentence.startswith('1 messages of /diagnostics break the wire contract')
    assert 's off the flight' in sentence


def test_a_second_flight_has_times_of_its_own(tmp_path: Path, right: dict[str, Any]) -> None:
    earlier = EPOCH_NS - 3600 * NANOSECONDS
    second = [
        (t, k, time_ns + 3600 * NANOSECONDS, d) for t, k, time_ns, d in flight(epoch_ns=earlier)
    ]
    summary, said = analyzed(write(tmp_path / 'run.mcap', [*flight(), *second]))
    assert summary['simulated_s'] == 3.0
    assert summary['first_alarm_s'] == right['first_alarm_s']
    assert summary['windows'] == 14
    assert 'another run begins there' in said


# Wrappings


def zstd(data: bytes) -> bytes:
    return zstandard.ZstdCompressor().compress(data)


def zstd_without_size(data: bytes) -> bytes:
    return zstandard.ZstdCompressor(write_content_size=False).compress(data)


def packed_messages(folder: Path, pack: Callable[[bytes], bytes]) -> Path:
    write(folder / 'a_0.mcap', ((t, k, time_ns, pack(d)) for t, k, time_ns, d in flight()))
    return metadata(folder, ['a_0.mcap'], compression_mode='MESSAGE', compression_format='zstd')


def packed_file(folder: Path, pack: Callable[[bytes], bytes], name: str) -> Path:
    (folder / name).write_bytes(pack(write(folder / 'raw', flight()).read_bytes()))
    (folder / 'raw').unlink()
    return folder


def sqlite_bag(folder: Path) -> Path:
    bag = folder / 'bag'
    with Rosbag2Writer(bag, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        known: dict[str, Any] = {}
        for topic, kind, time_ns, data in flight():
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=typestore())
            writer.write(known[topic], time_ns, data)
    return bag


def renamed(folder: Path) -> Path:
    write(folder / 'bench3.mcap', flight())
    return metadata(folder, ['rosbag2_2026_0.mcap'])


def unlisted(folder: Path) -> Path:
    write(folder / 'a_0.mcap', flight())
    return metadata(folder, [])


def elsewhere(folder: Path) -> Path:
    write(folder / 'a_0.mcap', flight())
    return metadata(folder, ['/data/bags/a/a_0.mcap', 'C:\\bags\\a_0.mcap'], version='27')


def split(folder: Path) -> Path:
    sent = list(flight())
    write(folder / 'a_0.mcap', sent[:50])
    write(folder / 'a_1.mcap', sent[50:])
    return metadata(folder, ['a_0.mcap', 'a_1.mcap', 'a_2.mcap'])


def two_storages(folder: Path) -> Path:
    for file in sqlite_bag(folder).iterdir():
        shutil.move(file, folder / file.name)
    write(folder / 'other.mcap', flight(blocks=3))
    return folder


def twice_without_metadata(folder: Path) -> Path:
    write(folder / 'a_0.mcap', flight())
    (folder / 'a_0.mcap.zstd').write_bytes(zstd((folder / 'a_0.mcap').read_bytes()))
    (folder / 'a_0.db3').write_bytes(b'not looked at')
    return folder


WRAPPINGS: dict[str, tuple[Callable[[Path], Path], str]] = {
    'messages in zstd': (lambda f: packed_messages(f, zstd), ''),
    'messages in zstd, sizes unknown': (lambda f: packed_messages(f, zstd_without_size), ''),
    'messages in lz4': (lambda f: packed_messages(f, lz4.frame.compress), ''),
    'messages in zstd, the file alone': (lambda f: packed_messages(f, zstd) / 'a_0.mcap', ''),
    'file in zstd': (lambda f: metadata(packed_file(f, zstd, 'a.mcap.zstd'), ['a.mcap.zstd']), ''),
    'file in lz4': (lambda f: packed_file(f, lz4.frame.compress, 'a.mcap.lz4'), ''),
    'file in zstd, alone': (lambda f: packed_file(f, zstd, 'a.mcap.zst') / 'a.mcap.zst', ''),
    'sqlite3': (sqlite_bag, ''),
    'sqlite3, the file alone': (lambda f: sqlite_bag(f) / 'bag.db3', ''),
    'renamed': (renamed, 'metadata.yaml names rosbag2_2026_0.mcap, which is not there; read'),
    'no file named': (unlisted, 'metadata.yaml names no file'),
    'files in other folders': (elsewhere, ''),
    'a part missing': (split, 'a_2.mcap of metadata.yaml is missing'),
    'mcap beside sqlite3': (two_storages, 'other.mcap is left out, since it is not in metadata'),
    'copies': (twice_without_metadata, 'a_0.db3 is left out, since it is beside a_0.mcap'),
}


@pytest.mark.parametrize('name', WRAPPINGS)
def test_the_flight_is_the_same_in_every_wrapping(
    tmp_path: Path, right: dict[str, Any], name: str
) -> None:
    make, words = WRAPPINGS[name]
    summary, said = analyzed(make(tmp_path))
    same(summary, right)
    assert words in said
    assert bool(said) == bool(words)


def test_unpacked_files_go_with_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / 'bag'
    folder.mkdir()
    path = packed_file(folder, zstd, 'a.mcap.zstd')
    monkeypatch.setattr('tempfile.tempdir', str(tmp_path))
    recording = Recording(path)
    assert len(list(tmp_path.glob('rotor-rig-bag-*/a.mcap'))) == 1
    assert recording.message_counts['/rotor/waveform'] == BLOCKS
    del recording
    assert list(tmp_path.glob('rotor-rig-bag-*')) == []


def test_a_cut_compressed_file_gives_what_is_there(tmp_path: Path) -> None:
    path = packed_file(tmp_path, zstd, 'a.mcap.zstd') / 'a.mcap.zstd'
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    recording = Recording(path)
    assert 0 < recording.message_counts['/rotor/waveform'] < BLOCKS
    assert 'a.mcap: it was not finalised, or is cut' in ' '.join(recording.damage)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(RecordingError) as refused:
        Recording(path)
    assert str(refused.value).startswith(f'{path} ')


def test_a_damaged_sqlite_bag_ends_in_a_sentence(tmp_path: Path) -> None:
    path = sqlite_bag(tmp_path) / 'bag.db3'
    content = bytearray(path.read_bytes())
    content[len(content) // 2 : len(content) // 2 + 8192] = bytes(8192)
    path.write_bytes(content)
    code, _, said = call('analyze', path, '--json')
    assert code in (0, 2)
    assert 'bag.db3' in said
    path.write_bytes(path.read_bytes()[:4000])
    code, _, said = call('analyze', path)
    assert code == 2
    assert 'cannot be read as a SQLite bag' in said


def test_what_a_killed_sqlite_recorder_left_is_named(tmp_path: Path) -> None:
    path = sqlite_bag(tmp_path) / 'bag.db3'
    with sqlite3.connect(path) as database:
        assert database.execute('SELECT count(*) FROM messages').fetchone() == (BLOCKS + 1,)
    database.close()
    path.with_name('bag.db3-wal').write_bytes(b'pages')
    assert 'what is still in bag.db3-wal is left out' in ' '.join(Recording(path).damage)


def test_messages_in_an_unknown_compression_are_refused(tmp_path: Path) -> None:
    path = packed_messages(tmp_path, lambda data: data[::-1])
    metadata(path, ['a_0.mcap'], compression_mode='MESSAGE', compression_format='brotli')
    for verb in (['analyze'], ['replay'], ['view', '--save', tmp_path / 'x.rrd']):
        code, _, said = call(verb[0], path, *verb[1:])
        assert code == 2
        assert "are compressed one by one with 'brotli'" in said


# Foreign blocks


def cloud(number: int, columns: list[tuple[str, str]], *, rows: int = 8, big: bool = False) -> Sent:
    message = encode(WaveformBlock(stamp_of(number), np.zeros(rows, columns)), OFFLINE)
    message.is_bigendian = big
    return '/rotor/waveform', topics.WAVEFORM.type, stamp_of(number) + 1, to_cdr(message)


XYZ = [(name, '<f4') for name in ('x', 'y', 'z', 'intensity')]
TEXT = to_cdr(messages.string(OFFLINE, 'hello'))
FOREIGN: dict[str, tuple[list[Sent], str]] = {
    'other columns': ([cloud(50, XYZ)], 'left out: 1 (the first is stamped'),
    'no rows': ([cloud(50, WAVEFORM_DTYPE.descr, rows=0)], 'left out: 1 (the first is stamped'),
    'a standing time': ([cloud(50, WAVEFORM_DTYPE.descr)], 'left out: 1 (the first is stamped'),
    'first of all': ([cloud(-1, XYZ), cloud(-2, XYZ)], 'left out: 2 (the first is stamped'),
    'big-endian': ([cloud(k, XYZ, big=True) for k in range(100)], 'left out: 100 (the first at'),
    'another type': (
        [('/rotor/waveform', topics.CONFIG.type, stamp_of(k), TEXT) for k in range(500)],
        'messages of /rotor/waveform left out: 500 (the first at log time',
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize('name', FOREIGN)
def test_foreign_blocks_are_counted_in_one_line(
    tmp_path: Path, right: dict[str, Any], name: str
) -> None:
    foreign, words = FOREIGN[name]
    path = write(tmp_path / 'run.mcap', sorted([*flight(), *foreign], key=lambda sent: sent[2]))
    summary, said = analyzed(path)
    same(summary, right)
    assert words in said
    assert said.count('warning:') == 1
    assert len(convert(Recording(path), tmp_path / 'view.rrd')) == 1


@pytest.mark.parametrize('name', ['other columns', 'big-endian'])
def test_only_foreign_blocks_end_in_a_sentence_with_their_number(tmp_path: Path, name: str) -> None:
    path = write(tmp_path / 'run.mcap', FOREIGN[name][0])
    for verb in (['analyze'], ['view', '--save', tmp_path / 'x.rrd']):
        code, _, said = call(verb[0], path, *verb[1:])
        assert code == 2
        assert 'holds no block of /rotor/waveform that can be' in said
        assert str(len(FOREIGN[name][0])) in said
    assert not (tmp_path / 'x.rrd').exists()


# Several rigs, other names


@pytest.fixture
def two_rigs(tmp_path: Path) -> Path:
    sent = [*flight('/rig_a'), *flight('/rig_b', blocks=60)]
    return write(tmp_path / 'two.mcap', sorted(sent, key=lambda message: message[2]))


def test_one_of_two_rigs_can_be_asked_for(two_rigs: Path, right: dict[str, Any]) -> None:
    summary, said = analyzed(two_rigs, '--waveform-topic', '/rig_a/rotor/waveform')
    same(summary, right)
    assert said == ''
    summary, _ = analyzed(two_rigs, '--waveform-topic', 'rig_b/rotor/waveform')
    assert summary['simulated_s'] == 1.5


def test_two_rigs_are_named_with_the_option(two_rigs: Path) -> None:
    for verb in (['analyze'], ['view', '--save', two_rigs.with_suffix('.rrd')]):
        code, _, said = call(verb[0], two_rigs, *verb[1:])
        assert code == 2
        assert '/rig_a/rotor/waveform' in said
        assert '--waveform-topic' in said
    code, _, said = call('scenario', 'show', two_rigs)
    assert code == 2
    assert '/rig_b/rotor/config' in said


def test_a_rig_without_namespace_is_no_default_beside_another(tmp_path: Path) -> None:
    path = write(tmp_path / 'two.mcap', [*flight(blocks=3), *flight('/rig_b', blocks=3)])
    code, _, said = call('analyze', path)
    assert code == 2
    assert '(/rotor/waveform, /rig_b/rotor/waveform)' in said
    chosen = Recording(path, '/rotor/waveform')
    assert chosen.find(topics.CONFIG) == '/rotor/config'
    assert Recording(path, '/rig_b/rotor/waveform').find(topics.CONFIG) == '/rig_b/rotor/config'


def test_the_waveform_may_have_another_name(tmp_path: Path, right: dict[str, Any]) -> None:
    sent = [(t.replace('rotor/waveform', 'bench/probes'), *rest) for t, *rest in flight()]
    path = write(tmp_path / 'run.mcap', sent)  # type: ignore[arg-type]
    code, _, said = call('analyze', path)
    assert code == 2
    assert 'its topics are: /rotor/config, /bench/probes' in said
    assert '--waveform-topic' in said
    summary, said = analyzed(path, '--waveform-topic', '/bench/probes')
    same(summary, right)
    for name, words in (('/bench/none', 'holds no /bench/none'), ('/rotor/config', 'has type')):
        code, _, said = call('analyze', path, '--waveform-topic', name)
        assert code == 2
        assert words in said


@pytest.mark.slow
@pytest.mark.parametrize(
    'arguments',
    [['--topic', '/nothing'], ['--start', '100'], ['--start', '-1'], ['--topic', '/clock']],
    ids=' '.join,
)
def test_a_replay_refuses_bad_input_with_the_code_of_bad_input(
    rig: Rig, plain: Path, arguments: list[str]
) -> None:
    done = rig('replay', str(plain), *arguments)
    assert done.code == 2
    assert done.err.startswith('error: ')
    assert done.err.count('\n') == 1
