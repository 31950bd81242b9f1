# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Convert the columns of a foreign file to waveform blocks and a recording."""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor_common.constants import MIN_SAMPLES_PER_CYCLE, OFFLINE_EPOCH_NS, STANDARD_GRAVITY_M_S2
from rotor_common.versions import versions
from rotor_interfaces import messages, topics
from rotor_interfaces.channels import (
    CHANNEL_COLUMNS,
    COLUMN_UNITS,
    channel_unit,
    is_acceleration,
    is_channel,
)
from rotor_interfaces.messages import OFFLINE, sample_stamp_ns
from rotor_interfaces.topics import ROTOR_FRAME
from rotor_interfaces.waveform import WAVEFORM_DTYPE, WaveformBlock, encode
from rotor_recording.errors import ImportFileError
from rotor_recording.importing.files import open_file
from rotor_recording.importing.foreign import ForeignFile
from rotor_recording.importing.shaft import Shaft, constant_speed, from_tacho
from rotor_recording.importing.table import Decimal
from rotor_recording.recording import RecordingWriter

BLOCK_SAMPLES = 256
RATES_HZ = (1, 1_000_000)
UNKNOWN = 'unknown'
_MUCH_MISSING = 0.05
_FAR_OFF, _FEWEST_OTHERS = 20.0, 10

ACCELERATION_UNITS = {'m/s^2': 1.0, 'mm/s^2': 1e-3, 'g': STANDARD_GRAVITY_M_S2}
"""In m/s^2; g is the standard gravity of ISO 80000-3."""

DISPLACEMENT_UNITS = {'m': 1.0, 'mm': 1e-3, 'um': 1e-6, 'in': 0.0254, 'mil': 25.4e-6}
"""In m."""


@dataclass(frozen=True)
class ImportPlan:
    """How a file is to be converted.

    `channels` maps the names of the rig's columns to those of the file; `units` maps them to units,
    '' to the unit of all others: a name, or the size of the file's unit in m or m/s^2.
    """

    path: Path
    channels: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    rate_hz: float | None = None
    time: str | None = None
    speed_hz: float | None = None
    tacho: str | None = None
    pulses_per_revolution: int = 1
    source: str = ''
    decimal: Decimal | None = None
    first_line: int | None = None


@dataclass(frozen=True, eq=False)
class Imported:
    """A converted file: `rows` of all blocks of `rotor/waveform`, and content of `rotor/config`."""

    rows: NDArray[np.void]
    rate_hz: int
    config: dict[str, Any]
    warnings: tuple[str, ...]

    def blocks(self, epoch_ns: int = OFFLINE_EPOCH_NS) -> Iterator[WaveformBlock]:
        """Yield the blocks of 256 rows, the last one shorter, with stamps from `epoch_ns` on."""
        for first in range(0, len(self.rows), BLOCK_SAMPLES):
            stamp_ns = sample_stamp_ns(epoch_ns, first, self.rate_hz)
            yield WaveformBlock(stamp_ns, self.rows[first : first + BLOCK_SAMPLES], ROTOR_FRAME)


def convert(plan: ImportPlan) -> Imported:
    """Return the waveform of a file.

    Columns: time, sample, angle where it is known, then the channels in SI, float32 as in the
    contract. Columns that the file lacks are absent. A channel without a unit keeps its numbers
    and is called `unknown` in the configuration.

    Raises:
        ImportFileError: the file or an option cannot be used.

    """
    _check_names(plan)
    file = open_file(plan.path, plan.decimal, plan.first_line)
    channels = dict(plan.channels or file.stated.channels)
    if not channels:
        raise ImportFileError(
            f'{plan.path} does not say what its columns are; give --channel NAME=COLUMN, such as '
            '--channel brg1_ay=1'
        )
    unused = sorted(set(plan.units) - set(channels) - {''})
    if unused:
        raise ImportFileError(f'--unit names {unused[0]!r}, which no --channel gives')
    columns = {name: file.column(key) for name, key in channels.items()}
    count = _common_length(plan.path, columns)
    rate_hz, rate_from = _rate(plan, file, count)
    shaft, shaft_from = _shaft(plan, file, count, rate_hz)
    units = {name: _unit(plan, file, name) for name in channels}
    described = {
        name: {'column': key, 'unit': units[name][0], 'si_per_unit': units[name][1]}
        for name, key in channels.items()
    }
    config = {
        'import': {
            'file': plan.path.name,
            'sha256': hashlib.sha256(plan.path.read_bytes()).hexdigest(),
            'format': file.format,
            'layout': dict(file.layout),
            'source': plan.source or UNKNOWN,
            'samples': count,
            'rate_hz': rate_hz,
            'rate_from': rate_from,
            'channels': described,
            'shaft': {'from': shaft_from, **_speeds(shaft)},
            'load': UNKNOWN,
            'file_says': dict(file.facts),
            'note': 'stamps count from an arbitrary epoch; time is since the stamp of its message',
        },
        'versions': versions(),
        'column_units': _column_units(units, with_angle=shaft is not None),
    }
    rows = _rows(columns, units, rate_hz, shaft)
    return Imported(rows, rate_hz, config, _warnings(file, rows, shaft, shaft_from, described))


def write(imported: Imported, out: Path) -> None:
    """Write the recording: `rotor/config`, then `rotor/waveform` in blocks of 256 samples.

    Raises:
        ImportFileError: the name does not end in .mcap.
        RecordingError: the file exists, or cannot be written.

    """
    check_out(out)
    with RecordingWriter.single_file(out, config=imported.config) as writer:
        text = messages.string(OFFLINE, json.dumps(imported.config, sort_keys=True))
        writer.write(topics.CONFIG, messages.to_cdr(text), OFFLINE_EPOCH_NS, OFFLINE_EPOCH_NS)
        for block in imported.blocks():
            message = messages.to_cdr(encode(block, OFFLINE))
            writer.write(topics.WAVEFORM, message, block.stamp_ns, block.stamp_ns)


def check_out(out: Path) -> None:
    """Raise ImportFileError unless the name ends in .mcap; called before the long work."""
    if out.suffix != '.mcap':
        raise ImportFileError(f'--out {out} must end in .mcap')


def _check_names(plan: ImportPlan) -> None:
    for name in plan.channels:
        if not is_channel(name):
            raise ImportFileError(
                f'--channel {name} is no name of a channel; use one of '
                f'{", ".join(CHANNEL_COLUMNS)}, or another that ends in _y or _z (displacement), '
                '_ay or _az (acceleration)'
            )
    if plan.tacho is not None and plan.speed_hz is not None:
        raise ImportFileError('--tacho and --speed-hz both give the shaft speed; leave one out')
    if plan.time is not None and plan.rate_hz is not None:
        raise ImportFileError('--time and --rate-hz both give the sample rate; leave one out')
    if plan.tacho is None and plan.pulses_per_revolution != 1:
        raise ImportFileError('--pulses-per-revolution has no meaning without --tacho')
    if not 1 <= plan.pulses_per_revolution <= 10_000:
        raise ImportFileError(
            f'--pulses-per-revolution {plan.pulses_per_revolution} is out of range; allowed: 1 to '
            '10000'
        )


def _common_length(path: Path, columns: Mapping[str, NDArray[np.float64]]) -> int:
    lengths = {name: len(column) for name, column in columns.items()}
    count = min(lengths.values())
    if max(lengths.values()) != count:
        listed = ', '.join(f'{name} {length}' for name, length in lengths.items())
        raise ImportFileError(f'the columns of {path} differ in length: {listed} samples')
    if count < 2:
        raise ImportFileError(f'{path} holds {count} samples; at least 2 are needed')
    return count


def _rate(plan: ImportPlan, file: ForeignFile, count: int) -> tuple[int, str]:
    """Return the sample rate and its origin."""
    if plan.time is not None:
        time = file.column(plan.time)
        return _rate_of_time(time, plan.time, count), f'time column {plan.time}'
    rate_hz, where = (plan.rate_hz, 'given') if plan.rate_hz else (file.stated.rate_hz, 'file')
    if rate_hz is None:
        raise ImportFileError(
            f'{plan.path} does not say its sample rate; give --rate-hz, or --time COLUMN'
        )
    low, high = RATES_HZ
    if not low <= rate_hz <= high:
        raise ImportFileError(
            f'--rate-hz {rate_hz:g} is out of range; allowed: {low} to {high:,} Hz'
        )
    if not float(rate_hz).is_integer():
        raise ImportFileError(
            f'a sample rate of {rate_hz:.9g} Hz is no whole number, and stamps are counted in '
            f'samples of a whole rate; resample the file to {math.ceil(rate_hz)} Hz first'
        )
    return int(rate_hz), where


def _rate_of_time(time: NDArray[np.float64], name: str, count: int) -> int:
    duration_s = float(time[-1] - time[0])
    if not (len(time) == count and duration_s > 0):
        raise ImportFileError(
            f'the time column {name} does not rise over the {count} samples of the channels'
        )
    rate_hz = max(round((count - 1) / duration_s), 1)
    # NaN anywhere fails this too
    if not float(np.abs((time - time[0]) * rate_hz - np.arange(count)).max()) < 0.5:
        raise ImportFileError(
            f'the time column {name} is not within half a sample of equal steps at a whole rate '
            f'({rate_hz} Hz comes closest); resample the file first, or give --rate-hz'
        )
    if rate_hz > RATES_HZ[1]:
        raise ImportFileError(
            f'the time column {name} gives {rate_hz} Hz; at most {RATES_HZ[1]:,} Hz are allowed, '
            'and time is in s'
        )
    return rate_hz


def _shaft(
    plan: ImportPlan, file: ForeignFile, count: int, rate_hz: int
) -> tuple[Shaft | None, str]:
    """Return the shaft angle and its origin."""
    if plan.tacho is not None:
        signal = file.column(plan.tacho)
        if len(signal) != count:
            raise ImportFileError(
                f'the tacho column {plan.tacho} has {len(signal)} samples, the channels {count}'
            )
        shaft = from_tacho(signal, rate_hz, plan.pulses_per_revolution, plan.tacho)
        pulses = plan.pulses_per_revolution
        how = ', threshold following the height of the pulses' if shaft.follows_height else ''
        return shaft, f'tacho column {plan.tacho}, {pulses} a revolution{how}'
    speed_hz, where = plan.speed_hz, 'constant speed, given'
    if speed_hz is None:
        speed_hz, where = file.stated.speed_hz, 'constant speed, as the file states it'
    if speed_hz is None:
        return None, UNKNOWN
    fastest_hz = rate_hz / MIN_SAMPLES_PER_CYCLE
    if not 0 < speed_hz <= fastest_hz:
        raise ImportFileError(
            f'--speed-hz {speed_hz:g} is out of range; allowed: above 0 and up to a sixth of the '
            f'sample rate, {fastest_hz:g} Hz'
        )
    return constant_speed(count, rate_hz, speed_hz), where


def _speeds(shaft: Shaft | None) -> dict[str, float]:
    if shaft is None:
        return {}
    return {
        'slowest_hz': shaft.slowest_hz,
        'fastest_hz': shaft.fastest_hz,
        'revolutions': shaft.revolutions,
        'samples_without_angle': int(np.count_nonzero(np.isnan(shaft.angle_rad))),
        'doubtful_tacho_intervals': shaft.doubtful_intervals,
    }


def _unit(plan: ImportPlan, file: ForeignFile, channel: str) -> tuple[str, float]:
    """Return the unit of a channel in the file, and its size in m or m/s^2."""
    text = plan.units.get(channel, plan.units.get('', file.stated.unit or ''))
    if not text:
        return UNKNOWN, 1.0
    known, other = ACCELERATION_UNITS, DISPLACEMENT_UNITS
    if not is_acceleration(channel):
        known, other = other, known
    try:
        factor = known[text] if text in known else float(text)
    except ValueError:
        kind = 'an acceleration' if is_acceleration(channel) else 'a displacement'
        why = f'but {channel} is {kind}' if text in other else 'which is not known'
        raise ImportFileError(
            f'--unit {text} is given for {channel}, {why}; allowed: {", ".join(known)}, or the '
            f"size of the file's unit in {channel_unit(channel)}"
        ) from None
    if not (math.isfinite(factor) and factor != 0):
        raise ImportFileError(f'--unit {text} is no factor; allowed: a number other than 0')
    return text, factor


def _column_units(units: Mapping[str, tuple[str, float]], *, with_angle: bool) -> dict[str, str]:
    names = ('time', 'sample', 'angle') if with_angle else ('time', 'sample')
    return {name: COLUMN_UNITS[name] for name in names} | {
        name: UNKNOWN if unit == UNKNOWN else channel_unit(name)
        for name, (unit, _) in units.items()
    }


def _rows(
    columns: Mapping[str, NDArray[np.float64]],
    units: Mapping[str, tuple[str, float]],
    rate_hz: int,
    shaft: Shaft | None,
) -> NDArray[np.void]:
    heads = ('time', 'sample') if shaft is None else ('time', 'sample', 'angle')
    count = len(next(iter(columns.values())))
    kinds = [(name, WAVEFORM_DTYPE[name]) for name in heads]
    rows = np.empty(count, [*kinds, *((name, '<f4') for name in columns)])
    rows['sample'] = np.arange(count)
    rows['time'] = rows['sample'] % BLOCK_SAMPLES / rate_hz  # since the stamp of its message
    if shaft is not None:
        rows['angle'] = shaft.angle_rad
    for name, values in columns.items():
        with np.errstate(over='ignore'):  # beyond float32: infinite, which no indicator takes
            rows[name] = values * units[name][1]
    return rows


def _stands_alone(values: NDArray[np.float32]) -> bool:
    """Say whether the first value lies far from all others, as a setting above the samples does."""
    others = values[1:][np.isfinite(values[1:])].astype(np.float64)
    if len(others) < _FEWEST_OTHERS:
        return False
    middle = float(np.median(others))
    reach = float(np.abs(others - middle).max())
    return bool(abs(float(values[0]) - middle) > _FAR_OFF * reach > 0)


def _warnings(
    file: ForeignFile,
    rows: NDArray[np.void],
    shaft: Shaft | None,
    shaft_from: str,
    described: Mapping[str, Mapping[str, Any]],
) -> tuple[str, ...]:
    found = list(file.warnings)
    if shaft is None:
        found.append(
            'the shaft angle is not known, so there are no orders; give --speed-hz or --tacho'
        )
    elif file.stated.speed_hz is not None and 'states' in shaft_from:
        found.append(
            f'the shaft speed of {shaft.slowest_hz:g} Hz is what the file states; orders above 1 '
            'need the measured one, --speed-hz'
        )
    if shaft is not None and shaft.doubtful_intervals:
        found.append(
            f'{shaft.doubtful_intervals} intervals of the tacho are doubtful; the angle is missing '
            'there'
        )
    missing = int(np.count_nonzero(np.isnan(shaft.angle_rad))) if shaft is not None else 0
    if missing > _MUCH_MISSING * len(rows):
        found.append(
            f'the angle is missing in {missing} of {len(rows)} samples ({missing / len(rows):.0%}):'
            ' there are no pulses of the tacho there, or they are too small or too uneven to count'
        )
    for name, description in described.items():
        if description['unit'] == UNKNOWN:
            found.append(f'the unit of {name} is not known, so its numbers stay as they are')
        lost = int(np.count_nonzero(~np.isfinite(rows[name])))
        if lost:
            found.append(f'{name} has {lost} samples without a number')
        if _stands_alone(rows[name]):
            found.append(
                f'the first sample of {name} lies {_FAR_OFF:g} times farther off than any other; '
                'if it is a setting and no sample, take it out of the file'
            )
    return tuple(found)
