# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Runs and recordings as `xarray.Dataset`, with named dimensions and units.

Every variable says its `units` (SI, '1' for a pure number) and `long_name`. Each kind of data has
a dimension of its own, so take `drop_dims` or a few variables of one before `to_dataframe`:

- `time` (s since the first sample): the columns of the waveform by their names, such as `disk_z`,
  float32 as on the wire; `sample`, the absolute index, and `time_in_block`, s since its block's
  stamp, beside it.
- `block_time` (s): the truth at the first sample of each block, `truth_crack_stiffness_ratio` ...
- `load_time` (s): the load grid, `load_grid_y` and `load_grid_z` in m/s^2.
- `window_time` (s, at the last sample of a window): the indicators, docs/indicators.md. That of a
  window has its name, `crack_ratio`; that of a channel or plane both, `disk_z_rms` for
  `disk_z/rms`, with an underscore for the point of an order, `disk_z_ratio_2_5_1`. The attrs hold
  `indicator`, `source` and `kind`, so that `filter_by_attrs(kind='rms')` finds it in all channels.
  Beside them `window`, `valid`, `reason`, `alarm_level` (0 OK, 1 warning, 2 error, 3 cannot judge)
  and `alarm_reasons`.
"""

import difflib
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from maneuver_gen.load_grid import load_grid
from rotor_common.configuration import unit_of as unit_of_field
from rotor_common.constants import LOAD_STEP_NS, NANOSECONDS
from rotor_common.plain_data import dump_yaml, parse_yaml
from rotor_common.versions import versions
from rotor_dynamics.surveys import ALIASES
from rotor_interfaces.channels import COLUMN_UNITS, channel_unit, is_channel, source_and_kind
from rotor_interfaces.messages import sample_stamp_ns
from rotor_interfaces.waveform import WaveformBlock
from rotor_recording.reading import Recording, waveform_blocks, waveform_name
from rotor_rig import pipeline
from rotor_rig.errors import ScenarioError
from rotor_rig.scenario_model import Scenario, load_scenario
from rotor_sim.plant.parameters import RotorParameters
from rotor_sim.rotor_config import LiveParameters
from vibration_monitor.indicators.registry import find, unit_of
from vibration_monitor.monitor import IndicatorRecord, VibrationMonitor
from vibration_monitor.monitor_config import MonitorConfig

_BESIDE = {
    'sample': ('1', 'absolute index of the sample'),
    'time_in_block': ('s', "time since the stamp of the sample's block"),
}
_SPEED = 'speed_rad_s'


def scenario(name_or_file: str | Path, **changes: Any) -> Scenario:
    """Return a shipped scenario, that of a YAML file, or that of a recording, with changes.

    Args:
        name_or_file: a name such as 'climb_dive', or a path.
        changes: by the name of a key of the scenario (`seed=2`), of a parameter of the rotor or
            its short name (`crack_stiffness_ratio=0.15` or `K=0.15`), or `speed_rad_s`, in SI.

    Raises:
        ScenarioError: no such scenario, or no such name; the sentence suggests another.
        ConfigError: a value that is not allowed.

    """
    keys, rotor = set(Scenario.model_fields), set(RotorParameters.model_fields)
    of_rotor: dict[str, Any] = {}
    of_run: dict[str, Any] = {}
    for given, value in changes.items():
        name = ALIASES.get(given, given)
        if name not in keys | rotor | {_SPEED}:
            known = sorted({*keys, *rotor, _SPEED, *ALIASES} - {'G'})
            close = difflib.get_close_matches(given, known, n=1)
            hint = f'did you mean {close[0]!r}?' if close else f'allowed: {", ".join(known)}'
            raise ScenarioError(f'{given} cannot be changed in a scenario; {hint}')
        (of_run if name in keys else of_rotor)[name] = value
    base = load_scenario(str(name_or_file), **of_run)
    if not of_rotor:
        return base
    plain = _as_asked(base)
    if _SPEED in of_rotor:
        plain['speed'] = {**plain['speed'], 'initial_rad_s': of_rotor.pop(_SPEED)}
    return Scenario.from_mapping({**plain, 'rotor': {**plain['rotor'], **of_rotor}})


def _as_asked(base: Scenario) -> dict[str, Any]:
    """Return plain data without the values of the monitor that follow from the rotor."""
    plain = base.plain()
    monitor = plain['monitor']
    bare = Scenario.from_mapping({**plain, 'monitor': {}}).plain()['monitor']
    crack = {k: v for k, v in monitor['crack'].items() if v != bare['crack'][k]}
    plain['monitor'] = {k: v for k, v in monitor.items() if v != bare[k]} | {'crack': crack}
    return plain


def simulate(
    scenario: Scenario, duration_s: float | None = None, seed: int | None = None
) -> xarray.Dataset:
    """Return an offline run: waveform, truth, load and indicators; dimensions as in the module.

    The waveform's bytes are those of `rotor-rig simulate` and of the live rig. A minute is some
    60 MB; for longer runs take `pipeline.record`. `attrs`: `scenario` (YAML of an equal run),
    `versions` (JSON), `start_ns`, the stamp of time 0 in ns, as text.

    Raises:
        RigError: a run that cannot be computed.

    """
    wanted = {'duration_s': duration_s, 'seed': seed}
    changes = {name: value for name, value in wanted.items() if value is not None}
    if changes:
        scenario = Scenario.from_mapping({**scenario.plain(), **changes})
    steps = list(pipeline.simulate(scenario))
    rate = scenario.rotor_sim().rate_hz
    first = [step.block.first_sample for step in steps]
    stamps = [sample_stamp_ns(scenario.epoch_ns, sample, rate) for sample in first]
    blocks = [WaveformBlock(ns, step.block.rows) for ns, step in zip(stamps, steps, strict=True)]
    run = _waveform(blocks, scenario.epoch_ns, scenario.sensors.column_units)
    truth = {
        f'truth_{name}': (
            'block_time',
            np.array([step.block.truth[name] for step in steps]),
            {'units': _truth_unit(name), 'long_name': f'true {name}'},
        )
        for name in steps[0].block.truth
    }
    points = np.array(load_grid(scenario.maneuver, scenario.duration_s))
    load: dict[str, Any] = {
        f'load_grid_{axis}': (
            'load_time',
            points[:, column],
            {'units': 'm/s^2', 'long_name': f'apparent gravity along {axis} of frame rotor'},
        )
        for column, axis in enumerate('yz')
    }
    times = {
        'block_time': _seconds(
            [ns - scenario.epoch_ns for ns in stamps], 'first sample of a block'
        ),
        'load_time': _seconds(
            [k * LOAD_STEP_NS for k in range(len(points))], 'point of the load grid'
        ),
    }
    coords: dict[str, Any] = {name: (name, *value) for name, value in times.items()}
    found = _indicators((r for step in steps for r in step.records), scenario.epoch_ns)
    attrs = {
        'scenario': scenario.yaml(),
        'versions': json.dumps(versions()),
        'start_ns': str(scenario.epoch_ns),
    }
    rest = xarray.Dataset({**truth, **load}, coords)
    return xarray.merge([run, rest, found]).assign_attrs(attrs)


def recording(path: str | Path, waveform_topic: str | None = None) -> xarray.Dataset:
    """Return the waveform of a recording by its columns, over `time` (s since its first block).

    All of it is held in memory. `attrs`: `start_ns` as text, `scenario` and `versions` where the
    recording has them, `damage`, the sentences about what is lost.

    Raises:
        RecordingInputError: not a recording, or no waveform in it that can be read.

    """
    source = Recording(path, waveform_topic)
    blocks = list(waveform_blocks(source))
    if not blocks:
        raise ScenarioError(f'{path} holds no block of {waveform_name(source)} that can be read')
    start_ns, told = blocks[0].stamp_ns, (source.config() or {}).get('column_units')
    run = _waveform(blocks, start_ns, told if isinstance(told, dict) else {})
    return run.assign_attrs(_attrs(source, start_ns))


def analyze(
    path: str | Path, waveform_topic: str | None = None, config: MonitorConfig | None = None
) -> xarray.Dataset:
    """Return what the monitor says about a recording: indicators over `window_time`.

    As `rotor-rig analyze`, configured as in the recorded run unless `config` says otherwise.
    Nothing but the indicators is held in memory. `attrs` as of `recording`.

    Raises:
        RecordingInputError: not a recording, or no waveform in it.
        ScenarioError: no block of it can be analyzed.

    """
    return _analyzed(Recording(path, waveform_topic), config)


def monitor(
    flight: xarray.Dataset | Recording, config: MonitorConfig | None = None
) -> xarray.Dataset:
    """Return what the monitor says about a waveform: indicators over `window_time`.

    Args:
        flight: result of `simulate` or `recording`, or a part of it
            (`flight.sel(time=slice(2, 4))`); or an open `Recording`.
        config: of the monitor; None: as in the run.

    Raises:
        ScenarioError: there is no waveform in it.
        WireError: its columns or samples are no waveform.

    """
    if isinstance(flight, Recording):
        return _analyzed(flight, config)
    if not {'time', *_BESIDE} <= {*flight.variables} or not flight.sizes['time']:
        raise ScenarioError('no waveform to monitor: time, sample or time_in_block is missing')
    start_ns = int(flight.attrs.get('start_ns', 0))
    if config is None:
        config = MonitorConfig.of_run({'scenario': parse_yaml(flight.attrs.get('scenario', '{}'))})
    watch = VibrationMonitor(config)
    records = (r for block in _blocks(flight, start_ns) for r in watch.push(block))
    return _indicators(records, start_ns).assign_attrs(flight.attrs)


def _analyzed(source: Recording, config: MonitorConfig | None) -> xarray.Dataset:
    start_ns: int | None = None
    records: list[IndicatorRecord] = []
    watch = VibrationMonitor(config or MonitorConfig.of_run(source.config() or {}))
    for block, windows in pipeline.analyze_blocks(source, watch):
        start_ns = block.stamp_ns if start_ns is None else start_ns
        records += windows
    if start_ns is None:
        reasons = '; '.join(source.damage) or 'its topic is empty'
        raise ScenarioError(
            f'{source.path} holds no block of {waveform_name(source)} that can be analyzed '
            f'({reasons})'
        )
    return _indicators(records, start_ns).assign_attrs(_attrs(source, start_ns))


def _attrs(source: Recording, start_ns: int) -> dict[str, str]:
    config = source.config() or {}
    attrs = {'start_ns': str(start_ns), 'damage': '\n'.join(source.damage)}
    if isinstance(config.get('scenario'), dict):
        attrs['scenario'] = dump_yaml(config['scenario'])
    return attrs | {'versions': json.dumps(config.get('versions', {}))}


def _truth_unit(name: str) -> str:
    fields = {**RotorParameters.model_fields, **LiveParameters.model_fields}
    others = {'forcing_n': 'N', _SPEED: 'rad/s'}
    return others.get(name) or (unit_of_field(fields[name]) if name in fields else '') or '1'


def _seconds(ns: Sequence[int], what: str) -> tuple[NDArray[np.float64], dict[str, str]]:
    return np.array(ns, np.float64) / NANOSECONDS, {
        'units': 's',
        'long_name': f'time of the {what}',
    }


def _waveform(
    blocks: Sequence[WaveformBlock], start_ns: int, told: Mapping[str, Any]
) -> xarray.Dataset:
    """Return the columns that all blocks have, one after the other; `told` are units."""
    names = [n for n in blocks[0].columns if all(n in block.columns for block in blocks)]
    arrays = {name: np.concatenate([block.rows[name] for block in blocks]) for name in names}
    offset = arrays.pop('time').astype(np.float64)
    lengths = [len(block.rows) for block in blocks]
    begin = np.repeat([(block.stamp_ns - start_ns) / NANOSECONDS for block in blocks], lengths)
    sample = arrays.pop('sample').astype(np.float64)
    beside = {'sample': sample, 'time_in_block': offset}
    time = begin + offset, {'units': 's', 'long_name': 'time since the first sample'}
    coords: dict[str, Any] = {'time': ('time', *time)}
    for name, (unit, text) in _BESIDE.items():
        coords[name] = 'time', beside[name], {'units': unit, 'long_name': text}
    variables: dict[str, Any] = {
        name: ('time', array, {'units': _column_unit(name, told), 'long_name': name})
        for name, array in arrays.items()
    }
    return xarray.Dataset(variables, coords)


def _column_unit(name: str, told: Mapping[str, Any]) -> str:
    if is_channel(name):
        return channel_unit(name)
    return COLUMN_UNITS.get(name) or str(told.get(name) or '1')


def _blocks(flight: xarray.Dataset, start_ns: int) -> Iterator[WaveformBlock]:
    """Yield the blocks that a waveform was made of; a part of one is a block as well."""
    time, offset = flight['time'].values, flight['time_in_block'].values
    names = [str(n) for n, v in flight.data_vars.items() if v.dims == ('time',)]
    columns = {'time': offset, 'sample': flight['sample'].values}
    columns |= {name: flight[name].values for name in names}
    rows = np.empty(len(time), [(name, array.dtype) for name, array in columns.items()])
    for name, array in columns.items():
        rows[name] = array
    stamps = np.rint((time - offset) * NANOSECONDS).astype(np.int64)
    edges = [0, *(np.flatnonzero(np.diff(stamps)) + 1).tolist(), len(time)]
    for begin, end in itertools.pairwise(edges):
        yield WaveformBlock(start_ns + int(stamps[begin]), rows[begin:end])


def _indicators(records: Iterable[IndicatorRecord], start_ns: int) -> xarray.Dataset:
    records = list(records)
    names = records[0].names if records else ()
    values = np.array([record.values for record in records]).reshape(len(records), len(names))
    variables: dict[str, Any] = {}
    for column, name in enumerate(names):
        source, kind = source_and_kind(name)
        known = find(name)
        about = {
            'units': unit_of(name),
            'long_name': name,
            'description': known.what if known else '',
        }
        about |= {'indicator': name, 'source': source, 'kind': kind}
        plain = name.replace('/', '_').replace('.', '_')
        variables[plain] = 'window_time', values[:, column], about
    told = {
        'window': ('number of the window', [record.window for record in records], np.float64),
        'valid': ('whether the window is valid', [record.valid for record in records], np.bool_),
        'reason': ('why a window is invalid', [record.reason for record in records], np.str_),
        'alarm_level': (
            '0 OK, 1 warning, 2 error, 3 cannot judge',
            [int(record.alarm.level) for record in records],
            np.int8,
        ),
        'alarm_reasons': (
            'why the alarm is not OK',
            ['; '.join(record.alarm.reasons) for record in records],
            np.str_,
        ),
    }
    for name, (text, column_of, dtype) in told.items():
        variables[name] = (
            'window_time',
            np.array(column_of, dtype),
            {'units': '1', 'long_name': text},
        )
    ends = _seconds([record.stamp_ns - start_ns for record in records], 'last sample of a window')
    coords: dict[str, Any] = {'window_time': ('window_time', *ends)}
    return xarray.Dataset(variables, coords)
