# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Plain data out of YAML and JSON that a user or another program wrote.

Whatever the text is, it ends in plain data or in one DataError, after bounded time and memory.
"""

import json
import math
import re
from collections.abc import Iterator
from typing import Any, NoReturn

import yaml

from rotor_common.errors import DataError

LARGEST_YAML = 1_000_000
"""Characters of a YAML text, and of all data that its aliases repeat."""
LARGEST_JSON = 16_000_000
"""Characters of a JSON text; the log of changes in a run's configuration may be long."""
DEEPEST = 64
"""Nesting of lists and mappings."""
MOST_VALUES = 100_000
"""Values, keys, lists and mappings of a YAML text; a second or two of reading on an idle core."""
LONGEST_NUMBER = 100
"""Characters of a number."""
_TOO_DEEP = f'more than {DEEPEST} lists and mappings inside each other; make it flatter'

_WORDS = {
    **dict.fromkeys(('', '~', 'null', 'Null', 'NULL'), None),
    **dict.fromkeys(('true', 'True', 'TRUE'), True),
    **dict.fromkeys(('false', 'False', 'FALSE'), False),
    **{sign + word: float(sign + 'inf') for sign in ('', '+', '-')
       for word in ('.inf', '.Inf', '.INF')},
    **dict.fromkeys(('.nan', '.NaN', '.NAN'), math.nan),
}  # fmt: skip
_INTEGER = re.compile(r'[-+]?[0-9]+')
_FLOAT = re.compile(r'[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?')
_BASED = re.compile(r'0o[0-7]+|0x[0-9a-fA-F]+')

# What only YAML 1.1 reads as a boolean or a number, or as another number than YAML 1.2.
_OLD_WORDS = {
    spelt: word in ('yes', 'on')
    for word in ('yes', 'no', 'on', 'off')
    for spelt in (word, word.capitalize(), word.upper())
}
_OLD_OCTAL = re.compile(r'[-+]?0[0-9_]+')
_OLD_BASED = re.compile(r'[-+]?0(?:b_*[01][01_]*|x_*[0-9a-fA-F][0-9a-fA-F_]*)')
_OLD_SIXTIES = re.compile(
    r'[-+]?(?:[1-9][0-9_]*(?::[0-5]?[0-9])+|[0-9][0-9_]*(?::[0-5]?[0-9])+\.[0-9_]*)'
)
_OLD_DECIMAL = re.compile(r'[-+]?[0-9][0-9_]*(?:\.[0-9_]*(?:[eE][-+][0-9]+)?)?')


def parse_yaml(text: str, *, foreign: bool = False) -> Any:
    """Return the plain data of one YAML document, None if it is empty; raises DataError.

    Numbers and words are read as YAML 1.2 (core schema) reads them, dates are text. What YAML 1.1
    reads otherwise (`yes`, `010`, `1:30`, `1_000`) is refused with both readings, unless another
    program wrote it (`foreign`): such programs mean YAML 1.2, and any of their keys is text.
    Refused: explicit tags, repeated keys, keys that are not text, a second document. Aliases
    and the merge key `<<` are accepted, as long as they stay within LARGEST_YAML.
    """
    _check_size(text, LARGEST_YAML)
    try:
        return _Document(text, foreign=foreign).value()
    except DataError:
        raise
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = error.problem or error.context or 'it cannot be parsed'
        if mark is None:
            raise DataError(f'it is not valid YAML: {problem}') from None
        if text[mark.index : mark.index + 1] == '\t':
            problem = 'a tab is not allowed here; indent with spaces'
        raise DataError(f'line {mark.line + 1} is not valid YAML: {problem}') from None
    except yaml.reader.ReaderError as error:
        line = text.count('\n', 0, error.position) + 1
        raise DataError(
            f'line {line} is not valid YAML: the character U+{error.character:04X} is only allowed '
            'as an escape in double quotes'
        ) from None
    except (ValueError, OverflowError):  # of an escape such as \UFFFFFFFF
        raise DataError('it is not valid YAML: an escape \\U names no character') from None


def dump_yaml(data: Any) -> str:
    """Return plain data as a YAML text that `parse_yaml`, and YAML 1.1, reads back as the same."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True)


def parse_json(text: str) -> Any:
    """Return the plain data of a JSON text; raises DataError.

    Refused: repeated keys, NaN and Infinity, which JSON does not know, and numbers beyond the
    range of a float64.
    """
    _check_size(text, LARGEST_JSON)
    try:
        data = json.loads(
            text.removeprefix('\ufeff'),
            object_pairs_hook=_object,
            parse_int=_json_integer,
            parse_float=_finite,
            parse_constant=_no_constant,
        )
        _check_json(data)
    except DataError as error:
        raise DataError(f'it has {error}') from None
    except json.JSONDecodeError as error:
        raise DataError(f'line {error.lineno}: {error.msg}') from None
    except RecursionError:
        raise DataError(f'it has {_TOO_DEEP}') from None
    return data


class _Document:
    """One YAML document, built from the parser's events, so that every limit is checked."""

    def __init__(self, text: str, *, foreign: bool) -> None:
        self._events: Iterator[Any] = yaml.parse(text, Loader=yaml.SafeLoader)
        self._foreign = foreign
        self._repeated = 0  # characters that aliases have repeated so far
        self._values = 0
        # value and length of what an anchor names, None until it has been read to its end
        self._anchors: dict[str, tuple[Any, int] | None] = {}

    def value(self) -> Any:
        next(self._events)  # start of the stream
        if isinstance(next(self._events), yaml.StreamEndEvent):
            return None
        value = self._node(next(self._events), 0)
        next(self._events)  # end of the document
        after = next(self._events)
        if not isinstance(after, yaml.StreamEndEvent):
            _refuse(after, 'begins a second document; keep one in a file')
        return value

    def _node(self, event: Any, depth: int, *, is_key: bool = False) -> Any:
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event)
        self._values += 1
        if self._values > MOST_VALUES:
            _refuse(event, f'is beyond the limit: at most {MOST_VALUES} values are read')
        if event.tag is not None:
            _refuse(event, f'has the tag {_short(event.tag)}, and tags are not taken; leave it out')
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        before, end = self._repeated, event.end_mark
        value: Any
        if isinstance(event, yaml.ScalarEvent):
            value = self._scalar(event, is_key=is_key)
        elif depth == DEEPEST:
            _refuse(event, f'has {_TOO_DEEP}')
        elif isinstance(event, yaml.SequenceStartEvent):
            value, end = self._sequence(depth + 1)
        else:
            value, end = self._mapping(depth + 1)
        if event.anchor is not None:
            length = 1 + end.index - event.start_mark.index + self._repeated - before
            self._anchors[event.anchor] = (value, length)
        return value

    def _alias(self, event: Any) -> Any:
        name = event.anchor[:40]
        if event.anchor not in self._anchors:
            _refuse(event, f'has the alias *{name}, but nothing above it is marked &{name}')
        named = self._anchors[event.anchor]
        if named is None:
            _refuse(event, f'has the alias *{name} inside the value that it names')
        value, length = named
        self._repeated += length
        if self._repeated > LARGEST_YAML:
            _refuse(
                event,
                f'has one alias too many: together they may repeat {LARGEST_YAML} characters; '
                'write the data out',
            )
        return value

    def _sequence(self, depth: int) -> tuple[list[Any], Any]:
        values = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            values.append(self._node(event, depth))
        return values, event.end_mark

    def _mapping(self, depth: int) -> tuple[dict[str, Any], Any]:
        own: dict[str, Any] = {}
        lines: dict[str, int] = {}
        merged: dict[str, Any] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            key = self._node(event, depth, is_key=True)
            if not isinstance(key, str):
                shown = _short(getattr(event, 'value', None) or key)
                _refuse(event, f'has the key {shown} in a mapping, which is not text; quote it')
            line = event.start_mark.line + 1
            if lines.setdefault(key, line) != line or key in own:
                _refuse(event, f'repeats the key {_short(key)} of line {lines[key]}; keep one')
            value = self._node(next(self._events), depth)
            if key == '<<' and getattr(event, 'implicit', (False,))[0]:
                merged = self._merged(event, value)
            else:
                own[key] = value
        return {**merged, **own}, event.end_mark

    @staticmethod
    def _merged(event: Any, value: Any) -> dict[str, Any]:
        """Return what the key `<<` brings in: a mapping, or a list with the first one winning."""
        mappings = value if isinstance(value, list) else [value]
        merged: dict[str, Any] = {}
        for mapping in mappings:
            if not isinstance(mapping, dict):
                _refuse(event, 'merges by << what is no mapping; name mappings, as << : *anchor')
            merged = {**mapping, **merged}
        return merged

    def _scalar(self, event: Any, *, is_key: bool) -> Any:
        text = event.value
        try:
            if event.implicit[0] and not (is_key and (self._foreign or text == '<<')):
                return _plain(text, foreign=self._foreign)
            return _joined(text)
        except DataError as error:
            _refuse(event, f'has {error}')


def _plain(text: str, *, foreign: bool) -> Any:
    """Return the value of a scalar without quotes; raises DataError if it is ambiguous."""
    if text in _WORDS:
        return _WORDS[text]
    value = _core_number(text)
    if not foreign:
        _check_old_reading(text, value)
    return _joined(text) if value is None else value


def _core_number(text: str) -> int | float | None:
    """Return the number that YAML 1.2 reads, None for text."""
    if _INTEGER.fullmatch(text):
        _check_length(text)
        return int(text)
    if _BASED.fullmatch(text):
        _check_length(text)
        return int(text, 0)
    return _finite(text) if _FLOAT.fullmatch(text) else None


def _check_old_reading(text: str, value: float | None) -> None:
    """Raise DataError if YAML 1.1 reads something else than `value` (None: text).

    Some readers of YAML 1.1 take numbers such as 1e-05 and 0o10 for text, and dates for dates;
    these readings are ignored here.
    """
    old = _old_value(text)
    if old is None or old == (text if value is None else value):
        return
    ways = [] if value is None else [str(value)]
    if not isinstance(old, str):
        is_octal = value is not None and isinstance(old, int) and old > 0
        ways.append(f'0o{old:o}' if is_octal else _said(old))
    raise DataError(
        f'{_short(text)}, which is {_said(old)} in YAML 1.1 and '
        f'{"text" if value is None else value} in YAML 1.2; write {", ".join(ways)} or {text!r}'
    )


def _said(old: float | str) -> str:
    if isinstance(old, str):
        return 'text'
    return f'{old:.15g}' if isinstance(old, float) else str(old).lower()


def _old_value(text: str) -> float | str | None:
    """Return what YAML 1.1 reads if it has its own rule for the text, else None."""
    if text in _OLD_WORDS:
        return _OLD_WORDS[text]
    kinds = (_OLD_OCTAL, _OLD_BASED, _OLD_SIXTIES, _OLD_DECIMAL)
    kind = next((kind for kind in kinds if kind.fullmatch(text)), None)
    if kind is None:
        return None
    _check_length(text)
    digits = text.replace('_', '')
    if kind is _OLD_OCTAL:
        return text if re.search('[89]', digits) else int(digits, 8)
    if kind is _OLD_BASED:
        return int(digits, 0)
    if kind is _OLD_SIXTIES:
        total = 0.0
        for part in digits.lstrip('+-').split(':'):
            total = 60.0 * total + float(part)
        total = -total if digits[0] == '-' else total
        return total if '.' in digits else int(total)
    return float(digits) if '.' in digits else int(digits)


def _finite(text: str) -> float:
    _check_length(text)
    value = float(text)
    if math.isinf(value):
        raise DataError(f'{_short(text)}, which is beyond the range of a number (1.8e308)')
    return value


def _check_length(text: str) -> None:
    if len(text) > LONGEST_NUMBER:
        raise DataError(
            f'{_short(text)}, a number of {len(text)} characters; at most {LONGEST_NUMBER} are read'
        )


def _joined(text: str) -> str:
    r"""Return text with surrogate pairs, from escapes such as \ud83d\ude00, joined."""
    if text.isascii():
        return text
    try:
        return text.encode('utf-16-le', 'surrogatepass').decode('utf-16-le')
    except UnicodeDecodeError:
        raise DataError(f'{_short(text)}, which holds half a character (U+D800 to DFFF)') from None


def _json_integer(text: str) -> int:
    _check_length(text)
    return int(text)


def _no_constant(text: str) -> NoReturn:
    raise DataError(f'{text}, which JSON does not know; write a number or null')


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise DataError(f'the key {_short(key)} twice; keep one')
        found[key] = value
    return found


def _check_json(data: Any) -> None:
    """Raise DataError for what json.loads lets pass: great depth, and single surrogates."""
    waiting = [(data, 0)]
    while waiting:
        value, depth = waiting.pop()
        if isinstance(value, str):
            _joined(value)
        elif isinstance(value, dict | list):
            if depth == DEEPEST:
                raise DataError(_TOO_DEEP)
            waiting += [(item, depth + 1) for item in value]
            if isinstance(value, dict):
                waiting += [(item, depth + 1) for item in value.values()]


def _check_size(text: str, largest: int) -> None:
    if len(text) > largest:
        raise DataError(f'it has {len(text)} characters; at most {largest} are read')


def _refuse(event: Any, why: str) -> NoReturn:
    raise DataError(f'line {event.start_mark.line + 1} {why}')


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else text[:37] + '...'


class _Dumper(yaml.SafeDumper):
    """Writes repeated values out, and quotes every text that could be read as something else."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002
        return True

    def represent_text(self, text: str) -> yaml.ScalarNode:
        try:
            is_plain = _plain(text, foreign=False) == text
        except DataError:
            is_plain = False
        # line breaks in YAML 1.1, which only an escape preserves
        style = '"' if set(text) & set('\x85\u2028\u2029') else None if is_plain else "'"
        return self.represent_scalar('tag:yaml.org,2002:str', text, style)


_Dumper.add_representer(str, _Dumper.represent_text)


def without_nan(value: Any) -> Any:
    """Return `value` with NaN and infinity as None: JSON has neither."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
