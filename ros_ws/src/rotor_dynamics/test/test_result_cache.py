# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Kept results are what was stored or nothing, and never those of another question."""

import ast
import dataclasses
import errno
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rotor_dynamics import cache as module
from rotor_dynamics.cache import Arrays, ResultCache, code_version
from rotor_dynamics.errors import AnalysisError
from rotor_sim import RotorParameters


@dataclasses.dataclass(frozen=True)
class Asked:
    """Stands for any question: a model, numbers and an array."""

    parameters: RotorParameters = dataclasses.field(default_factory=RotorParameters)
    speed_rad_s: float = 352.0
    revolutions: int = 300
    check: bool = True
    start: Any = None


RESULT: Arrays = {
    'y': np.array([[1.0, np.nan], [-0.0, 5e-324]]),
    'amplitude': np.arange(6, dtype=np.float32).reshape(2, 3),
    'label': np.array(['periodic', 'quasi-periodic']),
    'converged': np.array([True, False]),
    'steps': np.array([256, 512]),
    'nothing': np.zeros((0, 3)),
}


def assert_same(arrays: Arrays | None, wanted: Arrays) -> None:
    assert arrays is not None
    assert list(arrays) == list(wanted)
    for name, array in wanted.items():
        assert arrays[name].dtype == array.dtype
        assert arrays[name].shape == array.shape
        assert arrays[name].tobytes() == array.tobytes()


def test_arrays_come_back_bit_for_bit(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path / 'new' / 'folder')
    assert cache.load('a') is None
    cache.store('a', RESULT)
    assert_same(cache.load('a'), RESULT)
    assert_same(ResultCache(tmp_path / 'new' / 'folder').load('a'), RESULT)
    assert [path.name for path in cache.folder.iterdir()] == ['a.npz']


def test_a_later_result_replaces_an_earlier_one(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path)
    cache.store('a', {'y': np.ones(3)})
    cache.store('a', RESULT)
    assert_same(cache.load('a'), RESULT)


DIFFERENT = [
    Asked(),
    Asked(speed_rad_s=np.nextafter(352.0, 400.0)),
    Asked(revolutions=301),
    Asked(check=False),
    Asked(start=np.zeros(12)),
    Asked(start=np.zeros((2, 6))),
    Asked(start=np.zeros(12, np.float32)),
    Asked(start=[0.0] * 12),
    Asked(parameters=RotorParameters.hou2016('natural')),
    Asked(parameters=RotorParameters(clearance_m=1e-6)),
    Asked(parameters=RotorParameters(crack_stiffness_ratio=0.2)),
]


def test_every_difference_makes_another_key() -> None:
    keys = [ResultCache.key('survey', asked) for asked in DIFFERENT]
    assert len({*keys, ResultCache.key('other', DIFFERENT[0])}) == len(DIFFERENT) + 1
    assert keys == [ResultCache.key('survey', asked) for asked in DIFFERENT]


@given(st.dictionaries(st.text(), st.floats() | st.integers() | st.text() | st.none()))
def test_the_order_of_a_mapping_does_not_matter(payload: dict[str, Any]) -> None:
    reverse = dict(reversed(payload.items()))
    assert ResultCache.key('f', payload) == ResultCache.key('f', reverse)


def test_numpy_scalars_count_as_numbers() -> None:
    assert ResultCache.key('f', [np.float64(0.1), np.int64(3), np.bool_(1)]) == ResultCache.key(
        'f', [0.1, 3, True]
    )


@pytest.mark.parametrize('value', [object(), {1, 2}, np.array([object()]), Asked])
def test_what_has_no_faithful_text_has_no_key(value: Any) -> None:
    with pytest.raises(TypeError, match='cache key'):
        ResultCache.key('f', [value])


def test_another_process_makes_the_same_key() -> None:
    code = (
        'from rotor_sim import RotorParameters; from rotor_dynamics.cache import ResultCache; '
        'print(ResultCache.key("f", [RotorParameters(), 0.1]))'
    )
    done = subprocess.run(
        [sys.executable, '-c', code],
        env={**os.environ, 'PYTHONHASHSEED': '7'},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == ResultCache.key('f', [RotorParameters(), 0.1])


def test_a_change_of_the_model_makes_other_keys(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = [tmp_path / package / name.replace('*', 'one')
               for package, names in module._MODEL_SOURCES.items() for name in names]  # fmt: skip
    unrelated = tmp_path / 'rotor_dynamics' / 'diagrams.py'
    for path in (*sources, unrelated):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('x = 1\n')
    monkeypatch.setattr(module, '_folder', lambda package: tmp_path / package)

    def version() -> str:
        code_version.cache_clear()
        return code_version()

    try:
        versions = [version()]
        for path in sources:
            path.write_text('x = 2\n')
            versions.append(version())
        assert len(set(versions)) == len(versions) == 7
        unrelated.write_text('x = 2\n')
        assert version() == versions[-1]
    finally:
        code_version.cache_clear()


def test_the_version_covers_what_the_kernels_import() -> None:
    covered = set()
    for package, names in module._MODEL_SOURCES.items():
        folder = module._folder(package)
        for path in (path for name in names for path in folder.glob(name)):
            parts = path.relative_to(folder).with_suffix('').parts
            covered.add('.'.join([package, *parts]))
    for name in ('ensemble', 'lyapunov', 'surveys', 'continuations'):
        file = module._folder('rotor_dynamics') / f'{name}.py'
        imported = {
            f'{node.module}.{alias.name}' if node.module == 'rotor_dynamics' else node.module
            for node in ast.walk(ast.parse(file.read_text()))
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        numeric = {m for m in imported if m and m.startswith(('rotor_sim', 'rotor_dynamics'))}
        assert numeric - covered <= {'rotor_dynamics.cache', 'rotor_dynamics.errors',
                                     'rotor_dynamics.labels', 'rotor_sim.errors'}  # fmt: skip


def test_each_byte_of_the_directory_counts(tmp_path: Path) -> None:
    # a file that says its comment begins earlier would lose all arrays but the first
    cache = ResultCache(tmp_path)
    cache.store('a', RESULT)
    path = tmp_path / 'a.npz'
    content = path.read_bytes()
    for place in range(len(content) - 400, len(content)):
        path.write_bytes(content[:place] + bytes([content[place] ^ 2]) + content[place + 1 :])
        assert cache.load('a') is None


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_changed_byte_is_noticed(tmp_path: Path, data: st.DataObject) -> None:
    cache = ResultCache(tmp_path)
    cache.store('a', RESULT)
    path = tmp_path / 'a.npz'
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    content[place] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    assert cache.load('a') is None


@pytest.mark.parametrize('part', [0.0, 0.1, 0.5, 0.99])
def test_a_cut_file_counts_as_absent_and_is_made_again(tmp_path: Path, part: float) -> None:
    cache = ResultCache(tmp_path)
    cache.store('a', RESULT)
    path = tmp_path / 'a.npz'
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    assert cache.load('a') is None
    cache.store('a', RESULT)
    assert_same(cache.load('a'), RESULT)


def test_a_reader_beside_writers_sees_whole_results(tmp_path: Path) -> None:
    cache = ResultCache(tmp_path)
    cache.store('a', RESULT)

    def write() -> None:
        for _ in range(30):
            cache.store('a', RESULT)

    writers = [threading.Thread(target=write) for _ in range(2)]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert_same(cache.load('a'), RESULT)
    assert [path.name for path in tmp_path.iterdir()] == ['a.npz']


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(AnalysisError, match=r'cache folder .*file/sub cannot be made: Not a dir'):
        ResultCache(tmp_path / 'file' / 'sub')


def test_a_folder_that_cannot_be_written_to_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, 'access', lambda *_: False)  # root may write anywhere
    with pytest.raises(AnalysisError, match='cannot be written to'):
        ResultCache(tmp_path)


def test_a_full_disk_is_one_sentence_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = ResultCache(tmp_path)

    def full(file: Any, **_: Any) -> None:
        file.write(b'half')
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(np, 'savez', full)
    with pytest.raises(AnalysisError, match='No space left'):
        cache.store('a', RESULT)
    assert not list(tmp_path.iterdir())
