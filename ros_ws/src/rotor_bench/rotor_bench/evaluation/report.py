# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The result of an evaluation as plain data, as a file, and as a table for the terminal."""

import json
import math
import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.table import Table

from rotor_bench.evaluation.outcome import Evaluated, FlightResult
from rotor_bench.evaluation.summary import GOAL_CRACK, GOAL_GROWTH, summary
from rotor_common.console import folding_table
from rotor_common.durable_file import write_whole
from rotor_common.plain_data import without_nan
from rotor_common.versions import versions

FILE = 'evaluation.json'
DIGITS = 6
"""Significant digits of the scores of single flights."""


def report(
    done: Evaluated,
    *,
    suite: str,
    seed: int,
    split: str,
    stored: bool,
    wall_s: float,
    kept: int = 0,
) -> dict[str, Any]:
    """Return everything about an evaluation as plain data: origin, statistics, flights.

    `wall_s` is the time of the last run, which took `kept` flights from earlier ones.
    """
    return {
        'suite': suite,
        'seed': seed,
        'split': split,
        'stored': stored,
        'isolation': done.isolation,
        'flight_hours': sum(flight.duration_s for flight in done.flights) / 3600,
        'machines': len({flight.machine for flight in done.flights}),
        'wall_s': wall_s,
        'kept_flights': kept,
        'made': {
            'at': f'{datetime.now(UTC):%Y-%m-%d %H:%M} UTC',
            'machine': platform.machine(),
            'cores': os.cpu_count(),
            'python': platform.python_version(),
            'versions': versions(),
        },
        'detectors': summary(done.flights, done.alarm_scores, seed=seed),
        'flights': [_flight(flight) for flight in done.flights],
    }


def _flight(flight: FlightResult) -> dict[str, Any]:
    """Return a flight as plain data; only growing cracks need the course of the score."""
    plain = flight.plain()
    for outcome in plain['outcomes'].values():
        if flight.labels['crack'] != 'growing':
            outcome['rises'] = ()
    rounded = _rounded(plain)
    assert isinstance(rounded, dict)  # noqa: S101 - as it was
    return rounded


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return float(f'{value:.{DIGITS}g}') if isinstance(value, float) else value


def save(content: Mapping[str, Any], folder: Path) -> None:
    """Write evaluation.json, one line a flight, as a whole or not at all."""
    head = {key: value for key, value in content.items() if key != 'flights'}
    lines = [json.dumps(without_nan(flight), allow_nan=False) for flight in content['flights']]
    text = json.dumps(without_nan(head), indent=1, allow_nan=False)
    flights = ',\n  '.join(lines)
    whole = f'{text[:-2]},\n "flights": [\n  {flights}\n ]\n}}\n'
    write_whole(folder / FILE, whole.encode())


def tables(content: Mapping[str, Any]) -> list[Table]:
    """Return tables of the main results."""
    found: Mapping[str, Mapping[str, Any]] = content['detectors']
    head = folding_table('', *found)
    columns = [cells(numbers) for numbers in found.values()]
    for row in columns[0]:
        head.add_row(row, *(column[row] for column in columns))
    by_depth = folding_table(
        '', *found, title='AUC by depth of the crack, where the load factor varies'
    )
    depths = sorted(
        {k for n in found.values() for k in n['auc_by']['crack_stiffness_ratio']}, key=float
    )
    for depth in depths:
        areas = [n['auc_by']['crack_stiffness_ratio'].get(depth) for n in found.values()]
        by_depth.add_row(f'K = {depth}', *(area_text(area) for area in areas))
    return [head, by_depth] if depths else [head]


def columns_of(detectors: Mapping[str, Mapping[str, Any]], factor: str) -> set[str]:
    """Return the levels of a factor that any detector has an area for."""
    return {level for numbers in detectors.values() for level in numbers['auc_by'][factor]}


def cells(numbers: Mapping[str, Any]) -> dict[str, str]:
    """Return the main numbers of a detector as texts, by name."""
    smallest = numbers['smallest_crack']['0 false alarms per hour']
    growth = numbers['growth']['own alarm']
    found = f'{growth["found_before_goal"]} of {growth["time_s"]["flights"]}'
    decoys = growth['decoys']
    return {
        f'AUC, K >= {GOAL_CRACK:g}, load factor varies': area_text(numbers['auc']['goal']),
        f'AUC, K >= {GOAL_CRACK:g}, steady': area_text(numbers['auc']['steady level flight']),
        'false alarms per hour': rate_text(numbers['false_alarms']['all']),
        'smallest crack found, no false alarm': smallest_text(smallest),
        f'growing crack found before K = {GOAL_GROWTH:g}': found,
        'healthy flights as long with an alarm': f'{decoys["alarmed"]} of {decoys["flights"]}',
        'flights that it failed on': f'{numbers["failed"]} of {numbers["flights"]}',
    }


def is_missing(value: float | None) -> bool:
    """Say whether a number is missing: NaN, or None as JSON has it."""
    return value is None or math.isnan(value)


def number_text(value: float | None, instead: str = '-', before: str = '') -> str:
    """Return a number in words, `instead` where there is none."""
    return instead if is_missing(value) else f'{before}{value:.3g}'


def smallest_text(smallest: Mapping[str, Any]) -> str:
    """Return the smallest crack found, '-' where there was no threshold or no crack."""
    instead = 'none' if smallest['found'] else '-'
    return number_text(smallest['crack_stiffness_ratio'], instead, 'K = ')


def area_text(area: Mapping[str, Any] | None) -> str:
    """Return an area under the curve with its interval and the number of flights."""
    if area is None or is_missing(area['value']):
        return '-'
    interval = f'[{area["low"]:.3f}, {area["high"]:.3f}]'
    return f'{area["value"]:.3f} {interval} ({area["positives"]} / {area["negatives"]})'


def rate_text(rate: Mapping[str, Any]) -> str:
    """Return a rate with its upper bound."""
    if is_missing(rate['per_hour']):
        return '-'
    return (
        f'{rate["per_hour"]:.2g}, below {rate["upper_per_hour"]:.2g} '
        f'({rate["events"]} in {rate["hours"]:.1f} h judged of {rate["flown_hours"]:.1f} h flown)'
    )
