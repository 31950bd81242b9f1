# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Configuration models: frozen and strict, with unit, range and description of each value."""

import difflib
import functools
import json
from collections.abc import Mapping
from typing import Annotated, Any, Self, TypeVar, get_args, get_origin

import pydantic

from rotor_common.errors import ConfigError, DataError
from rotor_common.plain_data import parse_json

_BOUNDS = {
    'greater_than_equal': 'ge',
    'greater_than': 'gt',
    'less_than_equal': 'le',
    'less_than': 'lt',
}


class ConfigModel(pydantic.BaseModel):
    """Base of every configuration: immutable, unknown keys refused, no NaN, no silent casts."""

    model_config = pydantic.ConfigDict(
        frozen=True, extra='forbid', strict=True, allow_inf_nan=False, validate_default=True
    )

    def __init__(self, **values: Any) -> None:
        """Validate `values`; raises ConfigError with one sentence instead of pydantic's list."""
        try:
            super().__init__(**values)
        except pydantic.ValidationError as error:
            raise ConfigError(describe(type(self), error)) from None

    # pydantic's own mark: nested models are validated in place, so that keys keep their path
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], where: str = '') -> Self:
        """Return the model for plain data (YAML or JSON); `where` prefixes keys in errors."""
        try:
            text = json.dumps(data)
        except (TypeError, ValueError, RecursionError) as error:
            raise ConfigError(
                f'{where or cls.__name__} holds a value that is not plain text, number, '
                f'boolean, list or mapping ({error})'
            ) from None
        try:
            return cls.model_validate_json(text)
        except pydantic.ValidationError as error:
            raise ConfigError(describe(cls, error, where)) from None

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the model for a JSON text; raises ConfigError with one sentence."""
        try:
            return cls.from_mapping(parse_json(text))
        except DataError as error:
            raise ConfigError(f'{cls.__name__} is not valid JSON: {error}') from None


Model = TypeVar('Model', bound=ConfigModel)


def quantity(
    default: Any = ...,
    *,
    unit: str,
    description: str,
    ge: float | None = None,
    gt: float | None = None,
    le: float | None = None,
    lt: float | None = None,
) -> Any:
    """Return a model field with unit (SI, '1' for a pure number), range and description."""
    return pydantic.Field(
        default,
        description=description,
        ge=ge,
        gt=gt,
        le=le,
        lt=lt,
        json_schema_extra={'unit': unit},
    )


@functools.cache
def tagged(kind: type[Model]) -> pydantic.TypeAdapter[Model]:
    """Return an adapter for a class that tags its error locations, so `describe` finds fields."""
    tag = f'{kind.__module__}:{kind.__qualname__}'
    chosen: Any = Annotated[kind, pydantic.Tag(tag)] | Annotated[None, pydantic.Tag('')]
    return pydantic.TypeAdapter(Annotated[chosen, pydantic.Discriminator(lambda _: tag)])


def unit_of(field: pydantic.fields.FieldInfo) -> str:
    """Return the unit that `quantity` gave a field, '' where there is none."""
    extra = field.json_schema_extra
    return str(extra.get('unit', '')) if isinstance(extra, dict) else ''


def bounds_of(field: pydantic.fields.FieldInfo) -> dict[str, float]:
    """Return the numeric bounds of a field by their short names: ge, gt, le, lt."""
    return {
        name: float(getattr(item, name))
        for item in field.metadata
        for name in _BOUNDS.values()
        if getattr(item, name, None) is not None
    }


def range_text(field: pydantic.fields.FieldInfo) -> str:
    """Return the allowed range in words, for example `0 to 0.5` or `above 0 kg`."""
    bounds = bounds_of(field)
    unit = unit_of(field)
    suffix = f' {unit}' if unit not in ('', '1') else ''
    low = bounds.get('ge', bounds.get('gt'))
    high = bounds.get('le', bounds.get('lt'))
    if low is None and high is None:
        return f'any finite number{suffix}'
    low_word = 'above ' if 'gt' in bounds else ''
    high_word = 'below ' if 'lt' in bounds else ''
    if high is None:
        return f'{low_word}{low:g}{suffix}' + ('' if low_word else ' or more')
    if low is None:
        return f'{high_word}{high:g}{suffix}' + ('' if high_word else ' or less')
    return f'{low_word}{low:g} to {high_word}{high:g}{suffix}'


def describe(model: type[ConfigModel], error: pydantic.ValidationError, where: str = '') -> str:
    """Return one sentence for a validation error: key, value, what is allowed, and why."""
    errors = error.errors(include_url=False)
    first = errors[0]
    owner, field, path = _locate(model, first['loc'])
    key = '.'.join(part for part in (where, path) if part) or model.__name__
    value = first.get('input')
    kind = first['type']
    if kind == 'extra_forbidden':
        known = sorted(owner.model_fields) if owner else []
        close = difflib.get_close_matches(str(first['loc'][-1]), known, n=1)
        hint = f'did you mean {close[0]!r}?' if close else f'allowed keys: {", ".join(known)}'
        text = f'{key} is not a known key; {hint}'
    elif kind == 'missing':
        text = f'{key} is missing'
        if field is not None and field.description:
            text += f'; it is: {field.description}'
    elif kind == 'value_error':
        text = f'{key}: {first["ctx"]["error"]}' if path else str(first['ctx']['error'])
    elif kind in _BOUNDS or kind == 'finite_number':
        text = f'{key} = {_short(value)} is out of range'
        if field is not None:
            text += f'; allowed: {range_text(field)} ({field.description})'
        else:
            text += f'; {first["msg"]}'
    else:
        message = first['msg'].rstrip('.').replace('Input should be ', 'it must be ')
        message = message.replace('String should ', 'it must ')
        text = f'{key} = {_short(value)} is not allowed; {message}'
        if kind == 'string_pattern_mismatch' and field is not None:
            text += f' ({field.description})'
        if field is not None and bounds_of(field):
            text += f', {range_text(field)}'
    more = len(errors) - 1
    return text + (f' (and {more} more)' if more else '')


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + '...'


def _locate(
    model: type[ConfigModel], loc: tuple[int | str, ...]
) -> tuple[type[ConfigModel] | None, pydantic.fields.FieldInfo | None, str]:
    """Walk an error location; return the owning model, the field and a readable key path."""
    owners: list[type[ConfigModel]] = [model]
    field: pydantic.fields.FieldInfo | None = None
    owner: type[ConfigModel] | None = model
    path = ''
    for step in loc:
        if isinstance(step, int):
            path += f'[{step}]'
            continue
        found = next((o for o in owners if step in o.model_fields), None)
        if found is not None:
            owner, field = found, found.model_fields[step]
            owners = _models_in(field.annotation)
            path += f'.{step}' if path else step
            continue
        # the tag of a discriminated union, the class of a plugin, or an unknown key
        tagged = [o for o in owners if _has_tag(o, step)]
        if tagged:
            owners, owner = tagged, tagged[0]
            continue
        if step != loc[-1] and field is not None and get_origin(field.annotation) is dict:
            path += f'.{step}'  # the key of an entry
        if step == loc[-1]:
            owner = owners[0] if owners else owner
            field = None
            path += f'.{step}' if path else step
    return owner, field, path


def _has_tag(model: type[ConfigModel], tag: str) -> bool:
    is_class = tag == f'{model.__module__}:{model.__qualname__}'
    return is_class or any(tag in get_args(f.annotation) for f in model.model_fields.values())


def _models_in(annotation: Any) -> list[type[ConfigModel]]:
    if isinstance(annotation, type) and issubclass(annotation, ConfigModel):
        return [annotation, *(m for kind in annotation.__subclasses__() for m in _models_in(kind))]
    return [m for part in get_args(annotation) for m in _models_in(part)]
