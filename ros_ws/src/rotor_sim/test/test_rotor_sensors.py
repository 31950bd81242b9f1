# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors: off is identity, blocks do not matter, one effect leaves the others alone; the IMU."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from rotor_common.errors import ConfigError
from rotor_interfaces import messages, topics
from rotor_sim import LoadGrid, RotorSimConfig, RotorSimulator
from rotor_sim.messages import block_messages
from rotor_sim.sensors import PRESETS, ImuDecimator, SensorConfig, _kernels
from rotor_sim.sensors._noiseless_kernels import COLUMNS
from rotor_sim.sensors.chain import KEYPHASOR_VOLT, Measured, SensorChain

Array = NDArray[np.float64]
RATE_HZ, IMU_HZ = 10_240, 200

CHANNEL = {
    'noise_density': 1e-3,
    'bias_walk': 1e-3,
    'bandwidth_hz': 2000.0,
    'range': 3.0,
    'bits': 12,
    'jitter_s': 1e-6,
    'dropout_rate': 30.0,
    'dropout_s': 0.003,
}
ERRORS = {'bias': 0.1, 'scale_error': 0.02, 'cross_axis': 0.05}
EVERYTHING: dict[str, Any] = {
    'proximity': {
        **CHANNEL,
        'disk_y': {**ERRORS, 'runout': [{'order': 2, 'amplitude_m': 1e-3, 'phase_rad': 1.0}]},
        'brg2_z': {'runout': [{'order': 1, 'amplitude_m': 1e-3}]},
    },
    'accelerometers': {**CHANNEL, 'brg1_az': ERRORS},
    'load': {**CHANNEL, 'load_y': ERRORS},
    'keyphasor': {
        **CHANNEL,
        'range': 10.0,
        'bias': 0.1,
        'missed_probability': 0.3,
        'double_probability': 0.3,
    },
    'housing': {'mass_kg': 5.0},
}


def motion(n: int, seed: int = 0) -> tuple[Array, NDArray[np.int64], Array]:
    """Rows of an integrator with random numbers, and the angle of a shaft at 352 rad/s."""
    out = np.random.default_rng(seed).normal(size=(n, 16))
    unwrapped = 352.0 * np.arange(n) / RATE_HZ
    turns = np.floor(unwrapped / (2 * np.pi))
    return out, turns.astype(np.int64), unwrapped - turns * 2 * np.pi


def measure(
    config: SensorConfig,
    n: int,
    cuts: list[int] | None = None,
    seed: int = 3,
    levels: dict[str, Array] | None = None,
) -> list[Measured]:
    chain = SensorChain(config, seed, RATE_HZ)
    out, turns, angle = motion(n)
    edges = sorted({0, n, *(c for c in cuts or [] if c < n)})
    return [
        chain.measure(
            a,
            out[a:b],
            turns[a:b],
            angle[a:b],
            {k: v[a:b] for k, v in (levels or {}).items()},
        )
        for a, b in itertools.pairwise(edges)
    ]


def column_bytes(parts: list[Measured], truth: bool = False) -> dict[str, bytes]:
    rows = np.concatenate([p.truth_rows if truth else p.rows for p in parts])
    return {name: rows[name].tobytes() for name in ('sample', 'angle', *COLUMNS)}


def test_everything_off_is_the_truth() -> None:
    (block,) = measure(SensorConfig(), 1000)
    assert block.rows.tobytes() == block.truth_rows.tobytes()
    assert block.rows is not block.truth_rows
    out, _, _ = motion(1000)
    for i, name in enumerate(COLUMNS[:10]):
        assert block.rows[name].tobytes() == out[:, i].astype(np.float32).tobytes()


@settings(max_examples=12, deadline=None)
@given(cuts=st.lists(st.integers(1, 3000), max_size=8), seed=st.integers(0, 2**62))
def test_blocks_do_not_matter(cuts: list[int], seed: int) -> None:
    config = SensorConfig.from_mapping(EVERYTHING)
    levels = {'displacement_noise_m': np.linspace(0.0, 1.0, 3000)}
    whole = measure(config, 3000, seed=seed, levels=levels)
    parts = measure(config, 3000, cuts, seed, levels)
    assert column_bytes(parts) == column_bytes(whole)
    assert column_bytes(parts, truth=True) == column_bytes(whole, truth=True)
    for i in (0, 1):
        # repr: NaN is not equal to itself
        split = [repr(sample) for part in parts for sample in part.imu[i]]
        assert split == [repr(sample) for sample in whole[0].imu[i]]


def test_same_seed_repeats_and_another_does_not() -> None:
    config = SensorConfig.from_mapping(EVERYTHING)
    first, again, other = (column_bytes(measure(config, 2000, seed=s)) for s in (1, 1, 2))
    assert first == again
    for name in COLUMNS:
        assert first[name] != other[name]


@pytest.mark.parametrize(
    ('key', 'own'),
    [
        ('proximity', COLUMNS[:6]),
        ('accelerometers', COLUMNS[6:10]),
        ('load', ('load_y',)),
        ('keyphasor', ('keyphasor',)),
    ],
)
def test_one_kind_leaves_the_others_alone(key: str, own: tuple[str, ...]) -> None:
    parts = measure(SensorConfig.from_mapping({key: EVERYTHING[key]}), 2000)
    sensed, truth = column_bytes(parts), column_bytes(parts, truth=True)
    for name in COLUMNS:
        assert (sensed[name] != truth[name]) == (name in own), name


def test_effects_have_streams_of_their_own() -> None:
    """A loss or a walk does not change the noise of the channel or of its neighbours."""
    noise = {'noise_density': 1e-3}
    (alone,) = measure(SensorConfig.from_mapping({'proximity': noise}), 4000)
    losses = {**noise, 'dropout_rate': 20.0, 'jitter_s': 1e-12}
    (both,) = measure(SensorConfig.from_mapping({'proximity': losses}), 4000)
    kept = ~np.isnan(both.rows['disk_y'])
    assert 0.5 < kept.mean() < 1.0
    # slopes of 1e4/s times 1e-12 s, and float32 rows
    np.testing.assert_allclose(
        both.rows['disk_y'][kept], alone.rows['disk_y'][kept], rtol=1e-6, atol=1e-7
    )
    residuals = [alone.rows[c] - alone.truth_rows[c] for c in COLUMNS[:6]]
    correlation = np.corrcoef(residuals) - np.eye(6)
    assert np.abs(correlation).max() < 5 / math.sqrt(4000)  # 5 standard errors


def normals(seed: int, channel: int, effect: int, first: int, count: int) -> Array:
    values = np.empty(count)
    _kernels.normals(seed, channel, effect, first, values)
    return values


def test_noise_is_standard_normal_and_white() -> None:
    x = normals(3, 5, 0, 0, 200_000)
    # standard errors of mean, variance and autocorrelation of n values; 5 of each
    n = len(x)
    assert abs(x.mean()) < 5 / math.sqrt(n)
    assert abs(x.var() - 1.0) < 5 * math.sqrt(2 / n)
    assert abs((x**4).mean() - 3.0) < 5 * math.sqrt(96 / n)
    for lag in (1, 2, 3, 4, 17, 256):
        assert abs((x[lag:] * x[:-lag]).mean()) < 5 / math.sqrt(n)
    assert stats.kstest(x, 'norm').pvalue > 1e-4


@pytest.mark.parametrize('other', [(3, 6, 0, 0), (4, 5, 0, 0), (3, 5, 1, 0), (3, 5, 0, 200_000)])
def test_noise_of_another_key_is_independent(other: tuple[int, int, int, int]) -> None:
    n = 100_000
    x, y = normals(3, 5, 0, 0, n), normals(*other, n)
    assert abs((x * y).mean()) < 5 / math.sqrt(n)


@given(first=st.integers(0, 2**50), count=st.integers(1, 60), cut=st.integers(0, 60))
def test_noise_depends_on_the_sample_alone(first: int, count: int, cut: int) -> None:
    cut = min(cut, count)
    whole = normals(1, 2, 0, first, count)
    parts = [normals(1, 2, 0, first, cut), normals(1, 2, 0, first + cut, count - cut)]
    assert whole.tobytes() == np.concatenate(parts).tobytes()


def test_keyphasor_is_one_smooth_pulse_a_revolution() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 36_001)
    chain = SensorChain(SensorConfig(imu_rate_hz=0), 0, RATE_HZ)
    turns = np.zeros(len(angle), np.int64)
    volt = chain.measure(0, np.zeros((len(angle), 16)), turns, angle).rows['keyphasor']
    assert volt[0] == KEYPHASOR_VOLT
    assert np.max(volt) == KEYPHASOR_VOLT
    assert np.min(volt) == 0.0
    # on for 12 degrees around angle 0, and symmetric about it
    np.testing.assert_allclose((volt > 0.0).mean() * 360.0, 12.0, atol=0.03)
    np.testing.assert_allclose(volt, volt[::-1], atol=1e-6)
    # half of the voltage at u^2 = 1 - sqrt(1/2): 3.247 degrees by hand
    half = math.degrees(math.radians(6.0 * math.sqrt(1.0 - math.sqrt(0.5))))
    assert np.interp(half, np.degrees(angle), volt) == pytest.approx(2.5, abs=1e-3)


# -- configuration ------------------------------------------------------------------------------


@pytest.mark.parametrize('preset', PRESETS)
def test_presets_are_valid_and_survive_json(preset: str) -> None:
    config = RotorSimConfig.from_mapping({'sensors': {'preset': preset}})
    assert RotorSimConfig.from_json(config.model_dump_json()) == config
    assert RotorSimConfig.from_mapping(config.model_dump()) == config
    for number in PRESETS[preset].values():
        assert len(number.source) >= len('chosen')
    SensorChain(config.sensors, 0, config.rate_hz)


def test_single_fields_override_the_preset() -> None:
    probe = {'bits': 0, 'disk_y': {'bias': 1e-5}}
    config = SensorConfig.from_mapping({'preset': 'realistic', 'proximity': probe})
    base = SensorConfig.from_mapping({'preset': 'realistic'})
    assert config.proximity.bits == 0
    assert config.proximity.disk_y.bias == 1e-5
    assert config.proximity.disk_y.runout == base.proximity.disk_y.runout
    assert config.proximity.noise_density == base.proximity.noise_density
    assert config.accelerometers == base.accelerometers
    mems = config.with_preset('mems_accelerometer')
    assert mems.preset == 'mems_accelerometer'
    assert (mems.proximity.bits, mems.proximity.disk_y.bias) == (0, 1e-5)
    assert mems.proximity.noise_density == 0.0
    expected = SensorConfig.from_mapping({'preset': 'mems_accelerometer'}).accelerometers
    assert mems.accelerometers == expected


@pytest.mark.parametrize(
    ('sensors', 'sentence'),
    [
        ({'preset': 'x'}, "sensors.preset = 'x' is not allowed; it must be 'none', 'eddy_probe'"),
        (
            {'proximity': {'noise_densty': 1}},
            "sensors.proximity.noise_densty is not a known key; did you mean 'noise_density'?",
        ),
        (
            {'proximity': {'bits': 16}},
            'sensors.proximity: bits = 16 needs a range to divide; set range above 0',
        ),
        (
            {'load': {'bandwidth_hz': 5120.0}},
            'sensors.load.bandwidth_hz = 5120 Hz is not below half of rate_hz = 10240 Hz',
        ),
        (
            {'proximity': {'disk_z': {'runout': [{'order': 4, 'amplitude_m': 1e-6}]}}},
            'sensors.proximity.disk_z.runout[0].order = 4 is out of range; allowed: 1 to 3',
        ),
        ({'accelerometers': {'disk_y': {}}}, 'sensors.accelerometers.disk_y is not a known key'),
        ({'housing': {'damping_ratio': 1.0}}, 'sensors.housing.damping_ratio = 1.0 is out of'),
        (3, 'sensors = 3 is not allowed'),
    ],
)
def test_bad_sensors_get_their_sentence(sensors: Any, sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        RotorSimConfig.from_mapping({'sensors': sensors})
    assert str(caught.value).startswith(sentence)


def test_realistic_run_measures_and_states_its_variance() -> None:
    config = RotorSimConfig.from_mapping(
        {'settle_revolutions': 5, 'sensors': {'preset': 'realistic'}}
    )
    simulator = RotorSimulator(config)
    grid = LoadGrid.from_points(np.full((60, 2), 9.81))
    block = simulator.advance(5120, grid)
    for name in COLUMNS:
        assert np.isfinite(block.rows[name]).all()
        assert block.rows[name].tobytes() != block.truth_rows[name].tobytes()
    # the housing moves far less than the journal
    bare = RotorSimulator(RotorSimConfig.from_mapping({'settle_revolutions': 5}))
    journal = bare.advance(5120, grid).truth_rows['brg1_ay']
    assert block.truth_rows['brg1_ay'].std() < journal.std()
    imu = [
        message
        for topic, _, message in block_messages(messages.OFFLINE, config, 0, block)
        if topic is topics.BEARING_1_IMU
    ]
    density = config.sensors.accelerometers.noise_density
    assert imu[0].linear_acceleration_covariance[4] == pytest.approx(density**2 * 5120.0)


# -- IMU ----------------------------------------------------------------------------------------


def push(decimator: ImuDecimator, signal: Array) -> tuple[NDArray[np.int64], Array]:
    """Give one signal on the first of four channels; return indices and values."""
    first, values = decimator.push(np.column_stack([signal, *3 * [np.zeros_like(signal)]]))
    return np.arange(first, first + len(values)), values[:, 0]


def resample(signal: Array, rate: int = RATE_HZ, imu: int = IMU_HZ) -> tuple[Any, Array]:
    return push(ImuDecimator(rate, imu), signal)


def tone(frequency_hz: float, phase: float = 0.3, rate: int = RATE_HZ) -> Array:
    return np.asarray(np.cos(2 * np.pi * frequency_hz * np.arange(rate) / rate + phase))


@pytest.mark.parametrize(('rate', 'imu'), [(10_240, 200), (10_240, 333), (1000, 250), (44_100, 7)])
def test_constant_passes_unchanged(rate: int, imu: int) -> None:
    _, values = resample(np.full(3 * rate, 7.5), rate, imu)
    np.testing.assert_allclose(values, 7.5, rtol=1e-13)


@pytest.mark.parametrize('frequency_hz', [3.0, 30.0, 69.0])
def test_passband_keeps_amplitude_and_time(frequency_hz: float) -> None:
    index, values = resample(tone(frequency_hz))
    expected = np.cos(2 * np.pi * frequency_hz * index / IMU_HZ + 0.3)
    # ripple of an 80 dB Kaiser design is 1e-4; the stamps carry no delay
    np.testing.assert_allclose(values, expected, rtol=0, atol=2e-4)


@pytest.mark.parametrize('frequency_hz', [101.0, 130.0, 199.0, 201.0, 1000.5, 5000.0])
def test_what_would_alias_is_removed(frequency_hz: float) -> None:
    _, values = resample(tone(frequency_hz))
    assert np.abs(values).max() < 1e-4  # 80 dB


def test_outputs_start_and_end_with_complete_filters() -> None:
    indices, _ = resample(np.ones(RATE_HZ))
    # the filter is 0.17 s long, so 0.086 s at each end stay empty
    assert 0.08 < indices[0] / IMU_HZ < 0.1
    assert 0.9 < indices[-1] / IMU_HZ < 0.92


@given(cuts=st.lists(st.integers(1, 4000), max_size=6), seed=st.integers(0, 99))
def test_decimator_does_not_depend_on_blocks(cuts: list[int], seed: int) -> None:
    x = np.random.default_rng(seed).normal(size=(6000, 4))
    first, whole = ImuDecimator(RATE_HZ, IMU_HZ).push(x)
    decimator = ImuDecimator(RATE_HZ, IMU_HZ)
    edges = [0, *sorted({min(c, 5999) for c in cuts}), 6000]
    parts = [decimator.push(x[a:b]) for a, b in itertools.pairwise(edges)]
    assert parts[0][0] == first
    assert np.concatenate([values for _, values in parts]).tobytes() == whole.tobytes()
