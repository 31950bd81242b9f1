# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Foreign text is read right or refused with both readings named; what is left out is counted."""

import contextlib
import math
import time
from pathlib import Path

import pytest

from rotor_recording.errors import ImportFileError
from rotor_recording.importing.convert import ImportPlan, convert
from rotor_recording.importing.files import open_file
from rotor_recording.importing.foreign import ForeignFile

COUNT = 20
ACC = [round(1.3 * math.sin(0.3 * n + 0.1), 4) for n in range(COUNT)]


def table(line: str, end: str = '\n') -> str:
    """Return 20 lines; `line` says where number, time and signal stand."""
    return ''.join(line.format(n=n, t=0.001 * n, x=x) + end for n, x in enumerate(ACC))


def comma(text: str) -> str:
    return text.replace('.', ',')


PLAIN = table('{t:.3f},{x:.4f}')
TABS = table('{t:.3f}\t{x:.4f}')
LABVIEW = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t.
***End_of_Header***\t
\t
Channels\t1\t
Samples\t20\t
X0\t0.0\t
***End_of_Header***\t\t
X_Value\tacc\tComment
"""


def opened(tmp_path: Path, text: str | bytes) -> ForeignFile:
    path = tmp_path / 'x.txt'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return open_file(path)


READ: dict[str, tuple[str | bytes, str]] = {
    'settings above': ('Device,DAQ\nSample rate,5120\nSensitivity,100\n' + PLAIN, '2'),
    'settings in a table of their own': ('rate,range\n5120,100\nt,acc\n' + PLAIN, 'acc'),
    'a count above two columns': ('20\n' + PLAIN, '2'),
    'units under names': ('t,acc\ns,g\n' + PLAIN, 'acc'),
    'LabVIEW': (LABVIEW + TABS, 'acc'),
    'LabVIEW with room for remarks': (LABVIEW + table('{t:.3f}\t{x:.4f}\t'), 'acc'),
    'LabVIEW without times': (LABVIEW + table('\t{x:.4f}'), '2'),
    'LabVIEW with decimal commas': (LABVIEW + comma(TABS), 'acc'),
    'semicolons and decimal commas': (comma(table('{t:.3f};{x:.4f}')), '2'),
    'tabs and decimal commas': (comma(TABS), '2'),
    'blanks and decimal commas': (comma(table('{t:.3f}  {x:.4f}')), '2'),
    'quoted decimal commas': (comma(table('"{t:.3f}"|"{x:.4f}"')).replace('|', ','), '2'),
    'dates': ('when;acc\n' + table('2020-01-01 10:00:{n:02d}.5;{x:.4f}'), 'acc'),
    'dates in blanks': (table('01.02.2020 10:00:{n:02d} {x:.4f}'), '3'),
    'delimiters at the end': ('t,acc\n' + table('{t:.3f},{x:.4f},'), 'acc'),
    'comments within': (PLAIN.replace('0.005,', '# more\n% yet more\n0.005,'), '2'),
    'quoted names': ('"Rig 7, run 3"\n"t","acc, g"\n' + PLAIN, 'acc, g'),
    'mark of UTF-8': (b'\xef\xbb\xbf' + f't,acc\n{PLAIN}'.encode(), 'acc'),
    'UTF-16': (f't,acc\n{PLAIN}'.encode('utf-16'), 'acc'),
    'Latin-1': (f't,Größe\n{PLAIN}'.encode('latin-1'), 'Größe'),
    'CR alone': ('t,acc\r' + table('{t:.3f},{x:.4f}', end='\r'), 'acc'),
    'a word in each row': ('t,acc,state\n' + table('{t:.3f},{x:.4f},good'), 'acc'),
    'index without a name': (',acc\n' + table('{n},{x:.4f}'), 'acc'),
}  # fmt: skip


@pytest.mark.parametrize('name', READ)
def test_what_can_be_read_in_one_way_is_read_whole(name: str, tmp_path: Path) -> None:
    text, key = READ[name]
    assert opened(tmp_path, text).column(key).tolist() == ACC


@pytest.mark.parametrize('line', ['{}', '{}x', '{}.{}.', '{},{},', '-{}e', ' ' * 100_000 + '{}'])
def test_a_cell_of_100_000_digits_takes_no_longer_than_it_is_long(
    tmp_path: Path, line: str
) -> None:
    begun_s = time.process_time()
    digits = '9' * 100_000
    with contextlib.suppress(ImportFileError):
        opened(tmp_path, f'acc\n0.5\n{line.format(digits, digits)}\n0.25\n').column('acc')
    assert time.process_time() - begun_s < 1.0


EITHER = 'two columns or one with a decimal comma; .*--decimal point.*--decimal comma'
HEADING = 'can be the first sample or part of the heading.*--first-line 1 .*, 2 for the second'
TWO_WAYS: dict[str, tuple[str, str]] = {
    'decimal comma in one column': (comma(table('{x:.4f}')), EITHER),
    'under a name': ('acc\n' + comma(table('{x:.4f}')), EITHER),
    'under a title with a comma': ('acc, m/s^2\n' + comma(table('{x:.4f}')), EITHER),
    'with exponents': (comma(table('{x:.4e}')), EITHER),
    'some without a comma': ('1,5\n2\n2,5\n3\n', EITHER),
    'counts in two columns': (''.join(f'{500 + n},{510 + n}\n' for n in range(9)), EITHER),
    'decimal commas between commas': (comma(table('{t:.3f}|{x:.4f}')).replace('|', ','),
                                      '4 columns of whole numbers or fewer with decimal commas'),
    'thousands between semicolons': (''.join(f'{n};1,{200 + n}\n' for n in range(9)),
                                     'decimal comma or a comma that divides thousands'),
    'thousands alone': (''.join(f'1,{200 + n}.5\n' for n in range(9)),
                        '2 columns or one with thousands separators'),
    'both decimal signs': ('a;b\n0,5;1.5\n0,6;1.6\n0,7;1.7\n', 'has a comma and .* a point'),
    'settings that are numbers': ('5120,100\n' + PLAIN, HEADING),
    'a count above one column': ('20\n' + table('{x:.4f}'), HEADING),
    'numbers of channels': ('1,2\n' + PLAIN, HEADING),
    'numbers of pandas': (',0,1\n' + table('{n},{t:.3f},{x:.4f}'), HEADING),
    'names inf and nan': ('inf,nan\n' + PLAIN, HEADING),
    'a remark in the first row': ('t\tacc\tComment\n0.0\t1.5\tstart\n' + TABS,
                                  'can be a sample or belong to the heading'),
    'a damaged first row': ('t,acc\n0.0,ERR\n' + PLAIN, 'can be a sample or belong to the heading'),
    'a channel a line': ('\n'.join(','.join(f'{x:.1f}' for x in ACC * 20) for _ in range(3)),
                         '3 lines of 400 numbers can be a sample or a channel a line'),
}  # fmt: skip


@pytest.mark.parametrize('name', TWO_WAYS)
def test_what_can_be_read_in_two_ways_is_refused_with_both(name: str, tmp_path: Path) -> None:
    text, words = TWO_WAYS[name]
    with pytest.raises(ImportFileError, match=f'can be read in two ways: .*{words}') as refused:
        opened(tmp_path, text)
    assert '\n' not in str(refused.value)


def test_the_option_that_a_refusal_names_decides(tmp_path: Path) -> None:
    path = tmp_path / 'x.txt'
    path.write_text(comma(table('{x:.4f}')))
    assert open_file(path, 'comma').column('1').tolist() == ACC
    whole = [int(x) for x in ACC]
    assert open_file(path, 'point').column('1').tolist() == whole
    path.write_text('5120,100\n' + PLAIN)
    assert open_file(path, first_line=2).column('2').tolist() == ACC
    assert open_file(path, first_line=1).column('2').tolist() == [100.0, *ACC]


def test_a_number_that_is_also_the_name_of_another_column_is_refused(tmp_path: Path) -> None:
    file = opened(tmp_path, 'time,1,2\n' + table('{t:.3f},{x:.4f},{n}'))
    assert file.column('3').tolist() == list(range(COUNT))
    with pytest.raises(ImportFileError, match=r"a column 2 and another named '2' \(2, 3\)"):
        file.column('2')


BLOCKS = f't,acc\n{PLAIN}\nt,acc\n{table("{t:.3f},5.5")}'


def test_several_tables_are_refused_and_one_of_them_can_be_named(tmp_path: Path) -> None:
    with pytest.raises(ImportFileError, match='--first-line 2 or 24 reads one'):
        opened(tmp_path, BLOCKS)
    path = tmp_path / 'x.txt'
    first = open_file(path, first_line=2)
    assert first.column('acc').tolist() == ACC
    assert first.layout['lines_left_out_below'] == 21
    assert "the last 21 lines ('t,acc' is the first of them)" in first.warnings[0]
    second = open_file(path, first_line=24)
    assert second.column('acc').tolist() == [5.5] * COUNT
    assert (second.layout['lines_left_out_above'], second.warnings) == (22, ())


@pytest.mark.parametrize(
    ('line', 'words'),
    [(0, 'out of range'), (99, 'has lines 1 to 22'), (1, 'line 1 .* is no row of the numbers')],
)
def test_a_first_line_that_is_no_row_is_refused(line: int, words: str, tmp_path: Path) -> None:
    path = tmp_path / 'x.txt'
    path.write_text('t,acc\n' + PLAIN)
    with pytest.raises(ImportFileError, match=words):
        open_file(path, first_line=line)


def test_lines_below_the_table_are_counted(tmp_path: Path) -> None:
    path = tmp_path / 'x.txt'
    path.write_text('t,acc\n' + PLAIN + '\nEnd of file\nMean,0.5\n')
    imported = convert(ImportPlan(path, {'brg1_ay': 'acc'}, {'': 'g'}, time='t', speed_hz=20.0))
    assert imported.config['import']['layout'] == {
        'delimiter': 'comma',
        'decimal': 'point',
        'first_line': 2,
        'last_line': 21,
        'lines_left_out_above': 1,
        'lines_left_out_below': 2,
    }
    assert len(imported.rows) == COUNT
    assert ['the last 2 lines' in sentence for sentence in imported.warnings] == [True]


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (PLAIN + '0.1,0.2,0.3\n' + PLAIN, r"line 21 .*'0.1,0.2,0.3'\) has 3 cells"),
        (PLAIN + '0.1\n', 'line 21 .* has 1 cells, the rows above 2'),
        ('acc\n' + table('{x:.4f}') + '1.#IND\n' + table('{x:.4f}'), r"line 22 .*'1.#IND'"),
        (table('0x{n:x}'), 'no line of numbers'),
        (table('1_{n}'), 'no line of numbers'),
        (table('{t:.3f}|{x:.4f}'), 'no line of numbers'),
        (PLAIN.encode('utf-16-le').decode('latin-1'), 'is no text'),
    ],
)
def test_damaged_text_ends_in_one_sentence_that_names_the_line(
    text: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(ImportFileError, match=words) as refused:
        opened(tmp_path, text)
    assert '\n' not in str(refused.value)


def test_blank_lines_between_the_samples_are_counted(tmp_path: Path) -> None:
    assert '2 blank lines' in opened(tmp_path, PLAIN + '\n\n' + PLAIN).warnings[0]
    assert opened(tmp_path, PLAIN.replace('\n', '\n\n')).warnings == ()


def test_a_first_sample_far_from_all_others_is_warned_about(tmp_path: Path) -> None:
    path = tmp_path / 'x.txt'
    for first, alone in (('5120.0', True), ('1.5', False)):
        path.write_text(first + '\n' + table('{x:.4f}'))
        imported = convert(ImportPlan(path, {'brg1_ay': '1'}, {'': 'g'}, 5120.0, speed_hz=20.0))
        assert ['first sample of brg1_ay' in each for each in imported.warnings] == [True] * alone


def test_options_of_texts_are_refused_for_matlab(tmp_path: Path) -> None:
    path = tmp_path / 'x.mat'
    path.write_bytes(b'')
    with pytest.raises(ImportFileError, match='are for texts'):
        open_file(path, first_line=1)
