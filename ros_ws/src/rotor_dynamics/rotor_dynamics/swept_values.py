# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Parses and checks the values of --over, --against and --set."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_dynamics.errors import AnalysisError


def values_of(start: str, stop: str, count: str, *, option: str = '--over') -> NDArray[np.float64]:
    """Return the values of a range; AnalysisError unless it is an ascending range."""
    first, last = _finite(option, 'START', start), _finite(option, 'STOP', stop)
    how_many = _number(count)
    if not isinstance(how_many, int) or isinstance(how_many, bool) or not 1 <= how_many <= 10**6:
        raise AnalysisError(f'{option}: COUNT = {count} is out of range; allowed: 1 to 1000000')
    if how_many > 1 and not first < last:
        raise AnalysisError(
            f'{option}: the range from {start} to {stop} is empty; START must be below STOP'
        )
    return np.linspace(first, last, how_many)


def _finite(option: str, name: str, text: str) -> float:
    number = _number(text)
    if isinstance(number, str) or not math.isfinite(number):
        raise AnalysisError(f'{option}: {name} = {text} is not a finite number')
    return float(number)


def change_of(text: str, aliases: Mapping[str, str]) -> tuple[str, Any]:
    """Return name and value of a --set; AnalysisError for what is not NAME=VALUE."""
    short, equals, value = text.partition('=')
    name = aliases.get(short, short)
    if not equals or not short or not value:
        raise AnalysisError(f'--set {text} is not NAME=VALUE, for example --set K=0.2')
    instead = {'variant': '--variant', 'speed_rad_s': '--speed', 'load_factor': '--load'}
    if name in instead:
        raise AnalysisError(f'--set {short}: use {instead[name]}')
    return name, _number(value)


def _number(text: str) -> float | str:
    """Return a number or truth value as such, any other text as it is."""
    if text in {'true', 'false'}:
        return text == 'true'
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def unless_swept(option: str, given: float | None, default: float, *, swept: bool) -> float | None:
    """Return the value of an option that is not `swept`; None if it is."""
    if swept and given is not None:
        raise AnalysisError(f'{option} has no meaning, since --over sweeps it')
    return None if swept else (default if given is None else given)
