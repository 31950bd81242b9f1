# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Files of other systems: delimiters, headers, MATLAB variables, and files that are neither."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from rotor_recording.errors import ImportFileError
from rotor_recording.importing.files import open_file
from rotor_recording.importing.foreign import ForeignFile


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    st.lists(
        st.tuples(*[st.floats(-1e12, 1e12, allow_subnormal=False)] * 3), min_size=1, max_size=20
    ),
    st.sampled_from(['\t', ';', ',', ' ', ' , ', '   ']),
    st.sampled_from(['', 'a{0}b{0}c\n', '# a{0}b{0}c\n', 'Rig 7, 3 May\n\n"a"{0}"b"{0}"c"\n']),
)
def test_text_gives_back_what_was_written(
    tmp_path: Path, rows: list[tuple[float, ...]], delimiter: str, header: str
) -> None:
    path = tmp_path / 'x.csv'
    lines = [delimiter.join(repr(value) for value in row) for row in rows]
    path.write_text(header.format(delimiter) + '\n'.join(lines))
    file = open_file(path)
    for number, name in enumerate('abc', 1):
        expected = [row[number - 1] for row in rows]
        assert file.column(str(number)).tolist() == expected
        if header:
            assert file.column(name).tolist() == expected


@pytest.mark.slow
def test_a_small_file_of_very_much_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'zeros.mat'
    savemat(path, {'x': np.zeros(80_000_000)}, do_compression=True)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(ImportFileError, match='takes more memory than 64 times its size'):
        open_file(path)
    savemat(path, {'x': np.zeros(1_000_000)}, do_compression=True)
    assert len(open_file(path).column('x')) == 1_000_000


@pytest.mark.parametrize('text', ['1\n2\n3\n', '1\r\n2\r\n3\r\n', '\ufeff1\n2\n3'])
def test_one_column_needs_no_delimiter(tmp_path: Path, text: str) -> None:
    path = tmp_path / 'x.txt'
    path.write_bytes(text.encode())
    assert open_file(path).column('1').tolist() == [1.0, 2.0, 3.0]


def test_a_column_of_words_stands_beside_numbers(tmp_path: Path) -> None:
    path = tmp_path / 'x.csv'
    path.write_text('clock,x,y\n12:00:00,1.5,2\n12:00:01,nan,4\n')
    file = open_file(path)
    np.testing.assert_array_equal(file.column('x'), [1.5, np.nan])
    assert file.column('3').tolist() == [2.0, 4.0]


@pytest.mark.parametrize(
    ('text', 'key', 'words'),
    [
        ('', '1', 'holds no line of numbers'),
        ('# only\n% comments\n', '1', 'holds no line of numbers'),
        ('one two\nthree four\n', '1', 'holds no line of numbers'),
        ('1 2\n3 4\n', '3', "no column '3'; it has 1 to 2, without names"),
        ('1 2\n3 4\n', '0', "no column '0'"),
        ('1 2\n3 4\n', '-1', "no column '-1'"),
        ('a,b\n1,2\n', 'c', 'it has 1 to 2, named a, b'),
        ('a,a\n1,2\n', 'a', "more than one column of the name 'a'"),
        ('1,2.5\n3,x\n', '2', "column 2 of .* is not all numbers: line 2 holds 'x'"),
        ('1,2.5\n3\n', '2', 'line 2 .* has 1 cells, the rows above 2'),
        ('1,2\n3\n', '2', 'two columns or one with a decimal comma'),
        ('1,2.5\n3,\n', '2', 'written nan'),
    ],
)
def test_text_that_does_not_serve_ends_in_one_sentence(
    tmp_path: Path, text: str, key: str, words: str
) -> None:
    path = tmp_path / 'x.txt'
    path.write_text(text)
    with pytest.raises(ImportFileError, match=words) as refused:
        open_file(path).column(key)
    assert '\n' not in str(refused.value)


def test_other_kinds_of_files_are_refused(tmp_path: Path) -> None:
    binary = tmp_path / 'x.wav'
    binary.write_bytes(b'RIFF\0\0\0\0')
    with pytest.raises(ImportFileError, match='of binary files only'):
        open_file(binary)
    with pytest.raises(ImportFileError, match='is a folder'):
        open_file(tmp_path)
    for name in ('missing.csv', 'missing.mat'):
        with pytest.raises(ImportFileError, match='cannot be read: No such file'):
            open_file(tmp_path / name)


@pytest.fixture(scope='module')
def mat_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp('mat') / 'x.mat'
    run: dict[str, Any] = {'fs': 2000.0, 'data': np.arange(12.0).reshape(6, 2)}
    variables = {
        'X097_DE_time': np.arange(5)[:, np.newaxis],
        'rpm': 1796.0,
        'title': 'drive end',
        'run': run,
        'runs': np.array([{'x': np.arange(3.0)}, {'x': np.arange(4.0)}], dtype=object),
    }
    savemat(path, variables)
    return path


@pytest.fixture(scope='module')
def mat_file(mat_path: Path) -> ForeignFile:
    return open_file(mat_path)


def test_variables_of_a_mat_file_are_found_by_their_path(mat_file: ForeignFile) -> None:
    assert mat_file.column('X097_DE_time').tolist() == [0, 1, 2, 3, 4]
    assert mat_file.column('run.data[2]').tolist() == [1, 3, 5, 7, 9, 11]
    assert mat_file.column('runs[2].x').tolist() == [0, 1, 2, 3]
    assert mat_file.facts == {'rpm': 1796.0, 'title': 'drive end', 'run.fs': 2000.0}
    assert not mat_file.stated.channels


@pytest.mark.parametrize(
    'key', ['run', 'run.data', 'run.data[0]', 'run.data[3]', 'run.fs', 'title', 'none', '', 'a..b',
            '__header__', 'runs[3].x', 'run._fieldnames', 'run.__class__'],
)  # fmt: skip
def test_what_is_no_series_of_numbers_is_refused(mat_file: ForeignFile, key: str) -> None:
    with pytest.raises(ImportFileError, match='no series of numbers') as refused:
        mat_file.column(key)
    assert 'X097_DE_time (5,), run.data (6, 2)' in str(refused.value)
    hint = 'take one of its columns, run.data[:,1], or one of its rows, run.data[1,:]'
    assert (hint in str(refused.value)) == (key == 'run.data')


def test_rows_and_columns_of_a_matrix_are_asked_for_alike(tmp_path: Path) -> None:
    path = tmp_path / 'x.mat'
    wide = np.arange(3 * 40.0).reshape(3, 40)
    cube = np.arange(2 * 30 * 3).reshape(2, 30, 3)
    line = np.arange(9.0)[np.newaxis]
    savemat(path, {'sig': wide, 'cube': cube, 'line': line, 'run': {'x': wide}, 'z': wide * 1j})
    file = open_file(path)
    np.testing.assert_array_equal(file.column('sig[1,:]'), wide[0])
    np.testing.assert_array_equal(file.column('run.x[3, :]'), wide[2])
    np.testing.assert_array_equal(file.column('sig[:,40]'), wide[:, 39])
    np.testing.assert_array_equal(file.column('cube[2,:,3]'), cube[1, :, 2])
    for key in ('line', 'line[1,:]', 'line[:,1]', 'line[:]'):
        np.testing.assert_array_equal(file.column(key), line[0])
    with pytest.raises(ImportFileError, match=r'take one of its rows, sig\[1,:\], or'):
        file.column('sig')
    both = r'can be a row of 40 samples, run\.x\[2,:\], or a column of 3, run\.x\[:,2\]; write'
    with pytest.raises(ImportFileError, match='read in two ways: .*' + both):
        file.column('run.x[2]')
    with pytest.raises(ImportFileError, match=r'colon for the samples, such as cube\[:,1,1\]'):
        file.column('cube')
    with pytest.raises(ImportFileError, match='complex numbers'):
        file.column('z')
    for key in ('sig[4,:]', 'sig[:,0]', 'sig[:,:]', 'sig[1,1]', 'sig[:]', 'line[2,:]', 'sig[1:2]'):
        with pytest.raises(ImportFileError, match='no series of numbers'):
            file.column(key)


def test_the_layout_of_mfpt_is_known(tmp_path: Path) -> None:
    path = tmp_path / 'x.mat'
    bearing = {'sr': 48828, 'gs': np.arange(4.0)[:, np.newaxis], 'load': 25, 'rate': 25}
    savemat(path, {'bearing': bearing})
    stated = open_file(path).stated
    assert stated.channels == {'brg1_ay': 'bearing.gs'}
    assert (stated.unit, stated.rate_hz, stated.speed_hz) == ('g', 48828.0, 25.0)


@pytest.mark.slow
def test_damaged_mat_files_end_in_one_sentence(mat_path: Path, tmp_path: Path) -> None:
    whole = mat_path.read_bytes()
    bad = {
        'empty': b'',
        'text': b'1 2 3\n' * 100,
        'cut': whole[: len(whole) // 2],
        'header': whole[:128] + b'\0' * 64,
        'hdf5': b'MATLAB 7.3 MAT-file'.ljust(124) + b'\x00\x02IM' + b'\0' * 400,
    }
    for name, data in bad.items():
        path = tmp_path / f'{name}.mat'
        path.write_bytes(data)
        with pytest.raises(ImportFileError) as refused:
            open_file(path).column('X097_DE_time')
        assert str(path) in str(refused.value)
        assert '\n' not in str(refused.value)
    assert 'version 7.3' in str(refused.value)


@pytest.mark.parametrize('place', [256, 552])
def test_a_file_on_which_scipy_crashes_ends_in_one_sentence(place: int, tmp_path: Path) -> None:
    path = tmp_path / 'x.mat'
    savemat(path, {'x': {'gs': np.arange(30.0)[:, np.newaxis], 'load': '0'}})
    data = bytearray(path.read_bytes())
    data[place] ^= 0xFF  # found by trying all bytes: scipy 1.18.1 dies of SIGSEGV
    path.write_bytes(data)
    with pytest.raises(ImportFileError, match='damaged'):
        open_file(path)
