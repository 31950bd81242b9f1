# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Any text ends in plain data or in one DataError; plain data come back as they were written."""

import json
import math
import os
import re
import time
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rotor_common.errors import DataError
from rotor_common.plain_data import DEEPEST, dump_yaml, parse_json, parse_yaml
from rotor_common.text_file import read_text

ABOVE_ANY_READING_S = 60.0
"""Of a busy machine; a text that grows under the reader takes hours."""

PIECES = [
    *'[]{}:,-?&*!|>%@`#"\'\\~=.+_ \n\t\r', '- ', ': ', '? ', '<<: ', '&a ', '*a', '!!str ',
    '!!python/object:os.system ', '!!timestamp ', '---\n', '...\n', '%YAML 1.1\n', '\ufeff', '\x00',
    '\x85', '"\\ud800"', '"\\UFFFFFFFF"', '2024-01-01', '2024-13-45T99:99:99Z', '1:30', '010', '0x',
    '0b', '0o8', '1_0', '1e999', '.nan', '-.inf', 'yes', 'a', 'b', '\n  ', '1' * 5000, '[' * 300,
    '{a: ' * 300, '- ' * 300, '"', 'true', 'null', 'NaN', 'Infinity',
]  # fmt: skip
texts = st.lists(st.sampled_from(PIECES) | st.text(max_size=5), max_size=30).map(''.join)
whole_text = st.text(st.characters(exclude_categories=['Cs']), max_size=20)
# text that a reader could take for something else
looks_like_more = st.from_regex(
    r'[-+]?[0-9_.xob:eE]{1,8}|yes|On|NO|null|~|<<|=|true|\.inf|2024-01-01', fullmatch=True
)
numbers = st.integers(-(10**98), 10**98) | st.floats(allow_nan=False, allow_infinity=False)
scalars = st.none() | st.booleans() | numbers | whole_text | looks_like_more
plain = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(whole_text | looks_like_more, inner, max_size=4)
    ),
    max_leaves=12,
)


def same(first: Any, second: Any) -> bool:
    """Compare with types: 1 is not 1.0 and not true."""
    return repr(first) == repr(second)


@settings(deadline=None)
@given(texts)
def test_any_text_is_data_or_one_error(text: str) -> None:
    for read in (parse_yaml, lambda text: parse_yaml(text, foreign=True), parse_json):
        said = ''
        try:
            read(text)
        except DataError as error:
            said = str(error)
        assert '\n' not in said
        said.encode()


@settings(deadline=None)
@given(plain)
@example({'\x85': 'a\u2028b'})
def test_what_is_dumped_is_read_again(data: Any) -> None:
    assert same(parse_yaml(dump_yaml(data)), data)
    assert same(parse_yaml(dump_yaml(data), foreign=True), data)
    assert same(yaml.safe_load(dump_yaml(data)), data), 'other readers must see the same'


@settings(deadline=None)
@given(plain)
def test_json_is_read_again_and_as_yaml_too(data: Any) -> None:
    assert same(parse_json(json.dumps(data)), data)
    assert same(parse_json(json.dumps(data, ensure_ascii=False)), data)
    if len(json.dumps(data)) < 1000:  # a longer key needs its ? in YAML
        assert same(parse_yaml(json.dumps(data)), data)


# PyYAML writes the texts 1e5, -.5, 0o10 and 08 without quotes, being text to it
pyyaml_texts = whole_text.filter(lambda text: not re.match('[-+.]?[0-9.]', text))
pyyaml_plain = st.recursive(
    st.none() | st.booleans() | numbers | pyyaml_texts,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(pyyaml_texts, inner, max_size=4),
    max_leaves=12,
)


@settings(deadline=None)
@given(pyyaml_plain)
def test_what_pyyaml_dumps_is_read_again(data: Any) -> None:
    assert same(parse_yaml(yaml.safe_dump(data, sort_keys=False)), data)
    assert same(parse_yaml(yaml.safe_dump(data, sort_keys=False), foreign=True), data)


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('1e-05', 1e-5), ('1E5', 1e5), ('1e+3', 1000.0), ('-2.5e-7', -2.5e-7), ('.5', 0.5),
        ('-.5', -0.5), ('5.', 5.0), ('+1', 1), ('0o10', 8), ('0x1F', 31), ('0', 0), ('07', 7),
        ('010.5', 10.5), ('true', True), ('False', False), ('~', None), ('', None),
        ('2024-01-01', '2024-01-01'), ('2024-01-01 12:00:00', '2024-01-01 12:00:00'),
        ('08:30', '08:30'), ('1.2.3', '1.2.3'), ('1e', '1e'), ('0o8', '0o8'), ('y', 'y'),
        ("'010'", '010'), ('"yes"', 'yes'), ("'1:30'", '1:30'), ('a_1', 'a_1'), ('none', 'none'),
        ('"\\ud83d\\ude00"', '\U0001f600'), ('-.inf', -math.inf),
    ],
)  # fmt: skip
def test_values(text: str, value: Any) -> None:
    assert same(parse_yaml(f'a: {text}\n'), {'a': value})
    assert same(parse_yaml(f'a: {text}\n', foreign=True), {'a': value})
    assert same(parse_yaml(f'\ufeff{{a: {text}}}'), {'a': value})


@pytest.mark.parametrize(
    ('text', 'old', 'new', 'write', 'meant'),
    [
        ('010', '8', '10', ['10', '0o10', "'010'"], 10),
        ('-010', '-8', '-10', ['-10', "'-010'"], -10),
        ('08', 'text', '8', ['8', "'08'"], 8),
        ('1:30', '90', 'text', ['90', "'1:30'"], '1:30'),
        ('1:30.5', '90.5', 'text', ['90.5'], '1:30.5'),
        ('1_000', '1000', 'text', ['1000', "'1_000'"], '1_000'),
        ('1_000.5', '1000.5', 'text', ['1000.5'], '1_000.5'),
        ('0b11', '3', 'text', ['3'], '0b11'),
        ('-0x1F', '-31', 'text', ['-31'], '-0x1F'),
        ('yes', 'true', 'text', ['true', "'yes'"], 'yes'),
        ('Off', 'false', 'text', ['false', "'Off'"], 'Off'),
    ],
)
def test_what_reads_in_two_ways(
    text: str, old: str, new: str, write: list[str], meant: Any
) -> None:
    with pytest.raises(DataError) as caught:
        parse_yaml(f'b: 1\na: {text}\n')
    said = str(caught.value)
    assert said.startswith(f"line 2 has '{text}', which is {old} in YAML 1.1 and {new} in YAML 1.2")
    for way in write:
        assert way in said.split('write')[1]
        parse_yaml(f'a: {way}')
    assert same(parse_yaml(f'a: {text}', foreign=True), {'a': meant})


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('a: 1\nb: 2\na: 3', "line 3 repeats the key 'a' of line 1"),
        ('a: 1\n1: 2', "line 2 has the key '1'"),
        ('true: 2', "the key 'true'"),
        ('? [a]\n: 1', 'the key'),
        ('a: 1\n---\nb: 1', 'line 2 begins a second document'),
        ('a:\n  b: !!int 3', 'line 2 has the tag'),
        ('!!python/object/apply:os.system [ls]', 'tags are not taken'),
        ('a: !mine x', "'!mine'"),
        ('a: &x [1, *x]', 'the alias *x inside the value that it names'),
        ('&x a: *y', 'the alias *y'),
        ('a:\n\tb: 1', 'line 2 is not valid YAML: a tab'),
        ('a: [1, 2', 'line 1 is not valid YAML'),
        ('a: \x07', 'line 1 is not valid YAML: the character U+0007'),
        ('a: "\\ud800"', 'half a character'),
        ('a: "\\UFFFFFFFF"', 'escape'),
        ('a: 1e999', 'beyond the range'),
        ('a: ' + '9' * 5000, 'a number of 5000 characters; at most 100'),
        ('[' * 65 + ']' * 65, 'line 1 has more than 64 lists'),
        ('<<: 3', 'line 1 merges'),
        ('a' * 1_000_001, '1000001 characters; at most 1000000'),
        pytest.param(
            '- 1\n' * 100_000,
            'line 100000 is beyond the limit: at most 100000 values',
            marks=pytest.mark.slow,
        ),
    ],
)
def test_refused_yaml(text: str, said: str) -> None:
    with pytest.raises(DataError) as caught:
        parse_yaml(text)
    assert said in str(caught.value)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('{"a": 1, "a": 2}', "the key 'a' twice"),
        ('{"a": NaN}', 'NaN'),
        ('[-Infinity]', '-Infinity'),
        ('1e999', 'beyond the range'),
        ('9' * 5000, 'a number of 5000 characters'),
        ('[' * 65 + ']' * 65, 'more than 64 lists'),
        ('[' * 200_000, 'more than 64 lists'),
        ('{"a":' * 200_000, 'more than 64 lists'),
        ('["\\ud800"]', 'half a character'),
        ('{"\\ud800": 1}', 'half a character'),
        ('{\n"a": }', 'line 2: '),
        ('', 'line 1: '),
        (' ' * 16_000_001, 'at most 16000000'),
    ],
)
def test_refused_json(text: str, said: str) -> None:
    with pytest.raises(DataError) as caught:
        parse_json(text)
    assert said in str(caught.value)


def test_the_deepest_that_is_taken() -> None:
    deepest = '[' * DEEPEST + ']' * DEEPEST
    assert same(parse_yaml(deepest), parse_json(deepest))


def test_aliases_and_merge_keys() -> None:
    text = '{a: &x {p: 1, q: 2}, b: *x, c: {p: 3, <<: *x}, d: {<<: [{q: 4, r: 5}, *x]}}'
    assert parse_yaml(text) == {
        'a': {'p': 1, 'q': 2},
        'b': {'p': 1, 'q': 2},
        'c': {'p': 3, 'q': 2},
        'd': {'p': 1, 'q': 4, 'r': 5},
    }


@pytest.mark.parametrize(
    'text',
    [
        'a: &a0 [x, x, x, x]\n'
        + ''.join(f'b{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 10)}]\n' for i in range(1, 15)),
        f'a: &a {"x" * 300_000}\nb: [{"*a, " * 1000}]',
        'a: &a {p: 1}\n' + ''.join(f'- {{<<: [{"*a, " * 1000}]}}\n' for _ in range(100)),
    ],
    ids=['lists of lists', 'one long text', 'merged'],
)
def test_a_bomb_of_aliases_takes_little(text: str) -> None:
    began = time.perf_counter()
    tracemalloc.start()
    try:
        with pytest.raises(DataError):
            parse_yaml(text)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 50e6
    assert time.perf_counter() - began < ABOVE_ANY_READING_S


@pytest.mark.parametrize(
    'name', ['/dev/zero', '/dev/null', '.', 'pipe', 'absent', 'a\0b', 'x' * 5000]
)
def test_only_an_ordinary_file_is_read(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / 'pipe')
    with pytest.raises(DataError):
        read_text(tmp_path / name, 10)


def test_a_text_file(tmp_path: Path) -> None:
    file = tmp_path / 'a.yaml'
    file.write_bytes(b'\xef\xbb\xbfa: \xc3\xa9\r\n')
    assert read_text(file, 10) == 'a: é\r\n'
    with pytest.raises(DataError, match='more than 9e-06 MB'):
        read_text(file, 9)
    file.write_bytes(b'\xff\xfea\x00')
    with pytest.raises(DataError, match='not a UTF-8 text file'):
        read_text(file, 10)
    with file.open('wb') as sparse:
        sparse.truncate(10**12)
    with pytest.raises(DataError, match='more than 1 MB'):
        read_text(file, 1_000_000)
