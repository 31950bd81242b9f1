# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Classes of sensors as data: every number with its source, 'chosen' where it is our own."""

import math
from typing import Any, Literal, NamedTuple

from rotor_common.constants import STANDARD_GRAVITY_M_S2
from rotor_interfaces.channels import ACCELERATION_COLUMNS

Preset = Literal[
    'none',
    'eddy_probe',
    'icp_accelerometer',
    'mems_accelerometer',
    'eddy_keyphasor',
    'airframe_load_sensor',
    'realistic',
]

_RECORDER = 'chosen: recorder of 10 240 samples a second, filter at 0.4 of its rate'
_CLOCK = 'chosen: the clock of an ordinary converter board'
_API = 'API 670: 8 mm eddy probe'
_RUNOUT = (
    'chosen within API 617/670 practice (runout at most 6 um peak to peak); the z probe sees the '
    'surface a quarter turn after the y probe'
)
_TOLERANCE_PROBE = 'chosen within the 5 % that API 670 allows for the incremental scale factor'
_TOLERANCE_ICP = 'chosen within the 10 % of general-purpose industrial ICP sensors'


class Number(NamedTuple):
    """A value of a preset and its source."""

    value: Any
    source: str


Entry = dict[str, Number]
"""Values of one class of sensor by their dotted keys below `sensors`."""


def _runout(amplitudes_m: tuple[float, ...], phases_rad: tuple[float, ...], late: float) -> Any:
    """Return the runout of a probe that sees the surface `late` rad after the y probe."""
    return tuple(
        {
            'order': k,
            'amplitude_m': amplitude,
            'phase_rad': round(math.remainder(phase - k * late, 2.0 * math.pi), 6),
        }
        for k, amplitude, phase in zip((1, 2, 3), amplitudes_m, phases_rad, strict=True)
    )


def _probe(name: str, scale: float, cross: float, runout: Any) -> Entry:
    key = f'proximity.{name}'
    return {
        f'{key}.scale_error': Number(scale, _TOLERANCE_PROBE),
        f'{key}.cross_axis': Number(cross, 'chosen: the probe is turned by about a degree'),
        f'{key}.runout': Number(runout, _RUNOUT),
    }


def _plane(name: str, scale: tuple[float, float], runout: Any) -> Entry:
    amplitudes, phases = runout
    return {
        **_probe(f'{name}_y', scale[0], 0.015, _runout(amplitudes, phases, 0.0)),
        **_probe(f'{name}_z', scale[1], -0.015, _runout(amplitudes, phases, 0.5 * math.pi)),
    }


EDDY_PROBE: Entry = {
    'proximity.noise_density': Number(
        4e-9, 'chosen: 0.25 um rms in 4 kHz, 2 mV at 7.87 mV/um, of the order of good systems'
    ),
    'proximity.bias_walk': Number(2e-8, 'chosen: 0.2 um in 100 s from the temperature'),
    'proximity.bandwidth_hz': Number(4000.0, _RECORDER + '; the probe itself reaches 10 kHz'),
    'proximity.range': Number(1e-3, _API + ' has a linear range of 2 mm'),
    'proximity.bits': Number(16, 'chosen: 31 nm a step'),
    'proximity.jitter_s': Number(1e-7, _CLOCK),
    **_plane('disk', (0.021, -0.013), ((2.0e-6, 0.6e-6, 0.3e-6), (0.9, -2.1, 1.4))),
    **_plane('brg1', (-0.017, 0.024), ((1.5e-6, 0.5e-6, 0.2e-6), (-1.7, 0.4, 2.6))),
    **_plane('brg2', (0.011, -0.026), ((1.7e-6, 0.4e-6, 0.3e-6), (2.4, 1.1, -0.8))),
}


def _accelerometers(
    density: Number, bits: Number, cross: tuple[Number, ...], scale: tuple[Number, ...]
) -> Entry:
    entry = {
        'accelerometers.noise_density': density,
        'accelerometers.bandwidth_hz': Number(4000.0, _RECORDER),
        'accelerometers.range': Number(50.0 * STANDARD_GRAVITY_M_S2, 'data sheets: 50 g'),
        'accelerometers.bits': bits,
        'accelerometers.jitter_s': Number(1e-7, _CLOCK),
    }
    for i, name in enumerate(ACCELERATION_COLUMNS):
        entry[f'accelerometers.{name}.cross_axis'] = cross[i]
        entry[f'accelerometers.{name}.scale_error'] = scale[i]
    return entry


_HOUSING: Entry = {
    'housing.mass_kg': Number(10.0, 'chosen: 2.5 times the mass at each bearing'),
    'housing.natural_frequency_hz': Number(
        1000.0, 'chosen: stiffness 3.9e8 N/m, some 5 times that of the balls under 1 g'
    ),
    'housing.damping_ratio': Number(0.03, 'chosen: bolted metal'),
}

ICP_ACCELEROMETER: Entry = {
    **_accelerometers(
        Number(
            6e-6 * STANDARD_GRAVITY_M_S2,
            'data sheets of 100 mV/g industrial ICP sensors: 4 to 8 ug/sqrt(Hz) above 10 Hz',
        ),
        Number(24, 'chosen: sigma-delta converter, 0.06 mm/s^2 a step'),
        tuple(
            Number(c, 'chosen within the 5 to 7 % of data sheets')
            for c in (0.03, -0.02, 0.02, 0.04)
        ),
        tuple(Number(s, _TOLERANCE_ICP) for s in (0.04, -0.03, 0.02, -0.05)),
    ),
    **_HOUSING,
}

MEMS_ACCELEROMETER: Entry = {
    **_accelerometers(
        Number(
            25e-6 * STANDARD_GRAVITY_M_S2,
            'data sheet class of wide-band 50 g MEMS sensors: 25 ug/sqrt(Hz)',
        ),
        Number(16, 'chosen: 1.5 mg a step'),
        tuple(Number(c, 'data sheet class: 1 %') for c in (0.01, -0.01, 0.01, 0.01)),
        tuple(Number(s, 'chosen within 5 %') for s in (0.02, -0.015, 0.01, -0.025)),
    ),
    'accelerometers.bias_walk': Number(2e-3, 'chosen: 2 mg in 100 s from the temperature'),
    **_HOUSING,
}

EDDY_KEYPHASOR: Entry = {
    'keyphasor.noise_density': Number(4e-5, 'chosen: 2.5 mV rms in 4 kHz'),
    'keyphasor.bandwidth_hz': Number(4000.0, _RECORDER),
    'keyphasor.range': Number(10.0, 'chosen: converter input of 10 V'),
    'keyphasor.bits': Number(16, 'chosen'),
    'keyphasor.jitter_s': Number(1e-7, _CLOCK),
    'keyphasor.bias': Number(0.05, 'chosen'),
}

AIRFRAME_LOAD_SENSOR: Entry = {
    'load.noise_density': Number(1e-3 * STANDARD_GRAVITY_M_S2, 'chosen: 10 mg rms in 100 Hz'),
    'load.bias_walk': Number(1e-3, 'chosen'),
    'load.bandwidth_hz': Number(100.0, 'chosen: servo accelerometer'),
    'load.range': Number(16.0 * STANDARD_GRAVITY_M_S2, 'chosen: holds the 12 g of the rig'),
    'load.bits': Number(13, '14 CFR 121 App. M asks for 0.004 g'),
    'load.load_y.bias': Number(0.1, 'chosen: 10 mg'),
    'load.load_y.scale_error': Number(0.005, 'chosen within the 1 % of 14 CFR 121 App. M'),
    'load.load_y.cross_axis': Number(0.01, 'chosen'),
}

PRESETS: dict[str, Entry] = {
    'none': {},
    'eddy_probe': EDDY_PROBE,
    'icp_accelerometer': ICP_ACCELEROMETER,
    'mems_accelerometer': MEMS_ACCELEROMETER,
    'eddy_keyphasor': EDDY_KEYPHASOR,
    'airframe_load_sensor': AIRFRAME_LOAD_SENSOR,
    'realistic': {
        **EDDY_PROBE,
        **ICP_ACCELEROMETER,
        **EDDY_KEYPHASOR,
        **AIRFRAME_LOAD_SENSOR,
    },
}


def values_of(preset: Any) -> dict[str, Any]:
    """Return a preset's values as nested mappings; {} for an unknown name."""
    nested: dict[str, Any] = {}
    for path, number in PRESETS.get(str(preset), {}).items():
        *parents, leaf = path.split('.')
        owner = nested
        for parent in parents:
            owner = owner.setdefault(parent, {})
        owner[leaf] = number.value
    return nested
