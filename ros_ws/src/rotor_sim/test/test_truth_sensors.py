# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Each effect of a sensor against its equation in docs/sensors.md, or another implementation."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal, special

from rotor_sim.sensors import SensorConfig, _kernels
from rotor_sim.sensors._noiseless_kernels import COLUMNS
from rotor_sim.sensors.chain import Measured, SensorChain

Array = NDArray[np.float64]
RATE = 10_240
PROBES, ACCELEROMETERS = COLUMNS[:6], COLUMNS[6:10]


def measure(
    sensors: dict[str, Any],
    inputs: dict[int, Array] | None = None,
    *,
    n: int = RATE,
    seed: int = 1,
    rate: int = RATE,
    speed_rad_s: float = 352.0,
) -> Measured:
    """Measure `n` samples in blocks of 1000; `inputs` are columns of the integrator's rows."""
    chain = SensorChain(SensorConfig.from_mapping({'imu_rate_hz': 0, **sensors}), seed, rate)
    out = np.zeros((n, 16))
    for column, values in (inputs or {}).items():
        out[:, column] = values
    unwrapped = speed_rad_s * np.arange(n) / rate
    turns = np.floor(unwrapped / (2 * np.pi)).astype(np.int64)
    angle = unwrapped - turns * 2 * np.pi
    parts = [
        chain.measure(a, out[a : a + 1000], turns[a : a + 1000], angle[a : a + 1000])
        for a in range(0, n, 1000)
    ]
    rows, truth = ([getattr(p, k) for p in parts] for k in ('rows', 'truth_rows'))
    return Measured(np.concatenate(rows), np.concatenate(truth), ((), ()))


def test_random_words_are_those_of_the_published_generator() -> None:
    """Known answers of Philox 4x32-10, Salmon et al. 2011 (kat_vectors of Random123)."""
    words = {
        (0, 0, 0, 0): 0x6627E8D5,
        (2**64 - 1, 2**32 - 1, 2**32 - 1, 2**64 - 1): 0x408F276D,
        (0x299F31D0A4093822, 0x13198A2E, 0x03707344, 0x85A308D3243F6A88): 0xD16CFE09,
    }
    for (seed, channel, effect, index), word in words.items():
        arguments = (np.uint64(v) for v in (seed, channel, effect, index))
        assert _kernels.uniform(*arguments) == (word + 0.5) / 2**32  # type: ignore[arg-type]


def test_normal_numbers_are_the_quantiles_of_the_words() -> None:
    n = 40_000
    values = np.empty(n)
    _kernels.normals(5, 2, 1, 0, values)
    uniform = np.array([_kernels.uniform(5, 2, 1, k) for k in range(n // 4)])
    # the error that the module states for its cubics
    np.testing.assert_allclose(values[::4], special.ndtri(uniform), rtol=0, atol=2e-7)


def test_quantiles_hold_in_the_tails_too() -> None:
    words = np.concatenate(
        [
            2.0 ** np.arange(0, 31, 0.01),
            2.0**32 - 1 - 2.0 ** np.arange(0, 31, 0.01),
            np.linspace(0, 2**32 - 1, 10_001),
        ]
    ).astype(np.uint64)
    values = np.array([_kernels._normal(word) for word in words])
    exact = special.ndtri((words.astype(np.float64) + 0.5) / 2**32)
    np.testing.assert_allclose(values, exact, rtol=0, atol=2e-7)


def test_noise_has_the_stated_one_sided_density() -> None:
    n = 40 * RATE
    rows = measure({'accelerometers': {'noise_density': 3e-3}}, n=n).rows
    for name in ACCELEROMETERS:
        frequency, power = signal.welch(rows[name].astype(float), RATE, nperseg=2048)
        assert len(frequency) == 1025
        # 399 half-overlapping Hann windows, some 210 independent: 5 standard errors a band
        for band in np.array_split(power[5:-5], 10):
            independent = 210 * len(band) / 1.5
            assert band.mean() == pytest.approx(9e-6, rel=5 / math.sqrt(independent))


def test_variance_of_the_walk_grows_with_time() -> None:
    rate, sigma, n = 1000, 2.0, 4 * 256 + 1
    sensors = {'proximity': {'bias_walk': sigma}, 'accelerometers': {'bias_walk': sigma}}
    runs = [measure(sensors, n=n, rate=rate, seed=seed).rows for seed in range(300)]
    walks = np.array([[rows[name] for name in COLUMNS[:10]] for rows in runs]).reshape(-1, n)
    assert not walks[:, 0].any()
    for knot in (1, 2, 4):
        elapsed = knot * 256 / rate
        # 3000 walks: 5 standard errors of a variance
        variance = (walks[:, 256 * knot] ** 2).mean()
        assert variance == pytest.approx(sigma**2 * elapsed, rel=5 * math.sqrt(2 / 3000))
    step = np.diff(walks[:, ::256], axis=1)
    assert abs((step[:, 1] * step[:, 0]).mean() / step.var()) < 5 / math.sqrt(3000)


@pytest.mark.parametrize('bandwidth_hz', [100.0, 1000.0, 4000.0])
def test_filter_is_3_db_down_at_its_bandwidth(bandwidth_hz: float) -> None:
    n = 2 * RATE
    wave = np.sin(2 * np.pi * bandwidth_hz * np.arange(n) / RATE)
    rows = measure({'proximity': {'bandwidth_hz': bandwidth_hz}}, {0: wave}, n=n).rows
    settled = rows['disk_y'][RATE:].astype(float)
    gain = settled.std() / wave[RATE:].std()
    assert 20 * math.log10(gain) == pytest.approx(-3.0103, abs=1e-3)


def test_filter_is_that_of_scipy_and_starts_at_rest() -> None:
    rng = np.random.default_rng(0)
    wave = 5.0 + rng.normal(size=3000)
    rows = measure({'load': {'bandwidth_hz': 700.0}}, {10: wave}, n=3000).rows
    sections = signal.butter(4, 700.0, fs=RATE, output='sos')
    expected, _ = signal.sosfilt(sections, wave, zi=signal.sosfilt_zi(sections) * wave[0])
    np.testing.assert_allclose(rows['load_y'], expected, rtol=1e-6)  # float32
    constant = measure({'load': {'bandwidth_hz': 50.0}}, {10: np.full(99, 9.81)}, n=99).rows
    np.testing.assert_allclose(constant['load_y'], 9.81, rtol=1e-7)


@pytest.mark.parametrize('bits', [8, 12])
def test_converter_has_equal_steps_and_their_error(bits: int) -> None:
    n = 4 * RATE
    wave = np.random.default_rng(7).uniform(-0.9, 0.9, n)
    rows = measure({'accelerometers': {'range': 1.0, 'bits': bits}}, {6: wave}, n=n).rows
    step = 2.0 / 2**bits
    codes = rows['brg1_ay'].astype(float) / step
    np.testing.assert_array_equal(codes, np.round(codes))
    error = rows['brg1_ay'] - wave
    assert np.abs(error).max() <= 0.5 * step * (1 + 1e-4)
    # Widrow: uniform over a step; 5 standard errors, and float32 rows
    assert error.var() == pytest.approx(step**2 / 12, rel=5 * math.sqrt(0.8 / n) + 1e-3)


def test_range_limits_both_signs() -> None:
    wave = np.linspace(-2.0, 2.0, 4001)
    plain = measure({'proximity': {'range': 0.5}}, {0: wave}, n=4001).rows['disk_y']
    np.testing.assert_array_equal(plain, np.clip(wave, -0.5, 0.5).astype(np.float32))
    digital = measure({'proximity': {'range': 0.5, 'bits': 4}}, {0: wave}, n=4001).rows['disk_y']
    # 16 codes, two's complement: -8 to 7
    np.testing.assert_array_equal(np.unique(digital), np.arange(-8, 8) * 0.0625)


def test_runout_is_a_vector_of_each_order_locked_to_the_angle() -> None:
    vectors = {1: (2e-6, 0.9), 2: (6e-7, -2.1), 3: (3e-7, 1.4)}
    runout = [{'order': k, 'amplitude_m': a, 'phase_rad': p} for k, (a, p) in vectors.items()]
    speed = 2 * np.pi * 5.0  # slow roll: 5 turns a second, whole in one second
    sensors = {'proximity': {'brg1_z': {'runout': runout}}}
    block = measure(sensors, speed_rad_s=speed)
    angle = block.rows['angle']
    for order, (amplitude, phase) in vectors.items():
        found = 2 * (block.rows['brg1_z'] * np.exp(-1j * order * angle)).mean()
        # float32 rows
        assert found == pytest.approx(amplitude * np.exp(1j * phase), rel=1e-6)
    assert not block.rows['disk_y'].any()


def test_jitter_is_slope_times_time_error_and_common_to_all_channels() -> None:
    frequency, amplitude, jitter_s = 200.0, 3.0, 2e-6
    n = 8 * RATE
    wave = amplitude * np.sin(2 * np.pi * frequency * np.arange(n) / RATE)
    sensors = {'accelerometers': {'jitter_s': jitter_s}}
    block = measure(sensors, {6: wave, 9: 2 * wave}, n=n)
    error = (block.rows['brg1_ay'].astype(float) - wave)[1:]
    slope = amplitude * 2 * np.pi * frequency / math.sqrt(2)
    # the slope over one sample is 0.06 % low at 200 Hz; 5 standard errors of a squared product
    assert error.std() == pytest.approx(slope * jitter_s, rel=1e-3 + 5 * math.sqrt(2 / n))
    other = (block.rows['brg2_az'].astype(float) - 2 * wave)[1:]
    # float32 rows, 2e-7 of 6
    np.testing.assert_allclose(other, 2 * error, atol=2e-6)
    # nothing to see where nothing moves, and no slope before sample 0
    still = measure(sensors, {6: np.full(100, 5.0)}, n=100).rows['brg1_ay']
    np.testing.assert_array_equal(still, 5.0)


def test_scale_bias_and_cross_axis_are_exact() -> None:
    rng = np.random.default_rng(1)
    y, z, load_y, load_z = rng.normal(size=(4, 500))
    errors = {'bias': 0.3, 'scale_error': 0.05, 'cross_axis': -0.02}
    sensors = {
        'proximity': {'brg2_y': errors},
        'accelerometers': {'brg1_az': errors},
        'load': {'load_y': errors},
    }
    inputs = {4: y, 5: z, 6: y, 7: z, 10: load_y, 11: load_z}
    rows = measure(sensors, inputs, n=500).rows
    for name, own, other in (
        ('brg2_y', y, z),
        ('brg1_az', z, y),
        ('load_y', load_y, load_z),
    ):
        expected = 1.05 * (own - 0.02 * other) + 0.3
        np.testing.assert_allclose(rows[name], expected, rtol=1e-6, atol=1e-7)
    np.testing.assert_array_equal(rows['brg2_z'], z.astype(np.float32))


def test_losses_have_their_rate_and_length() -> None:
    rate, length_s, n = 10.0, 0.004, 40 * RATE
    # the converter must not make a number of what is lost
    losses = {'dropout_rate': rate, 'dropout_s': length_s, 'range': 1.0, 'bits': 8}
    rows = measure({'proximity': losses, 'accelerometers': losses}, n=n).rows
    lost = np.array([np.isnan(rows[name]) for name in COLUMNS[:10]])
    starts = (lost[:, 1:] & ~lost[:, :-1]).sum()
    samples = round(length_s * RATE)
    # coverage of a Poisson process of intervals; 4000 of them, 5 standard errors
    share = 1 - math.exp(-rate * samples / RATE)
    assert lost.mean() == pytest.approx(share, rel=5 / math.sqrt(4000))
    assert starts / (10 * 40) == pytest.approx(rate * (1 - share), rel=5 / math.sqrt(4000))
    edges = np.flatnonzero(np.diff(lost[0].astype(int)))
    lengths = np.diff(edges)[::2]
    assert lengths.min() == samples
    assert not np.isnan(rows['load_y']).any()


def test_pulses_are_missed_and_doubled_at_their_rates() -> None:
    n, speed = 60 * RATE, 2 * np.pi * 100.0
    turns = 6000
    edges = {}
    for key, faults in {
        'clean': {},
        'missed': {'missed_probability': 0.2},
        'double': {'double_probability': 0.1, 'double_offset_rad': 2.0},
    }.items():
        rows = measure({'keyphasor': faults}, n=n, speed_rad_s=speed).rows
        on = rows['keyphasor'] > 2.5
        edges[key] = rows['angle'][1:][on[1:] & ~on[:-1]] / (2 * np.pi)
    assert len(edges['clean']) == turns - 1  # the pulse at angle 0 begins before sample 0
    missed = len(edges['clean']) - len(edges['missed'])
    assert missed / turns == pytest.approx(0.2, abs=5 * math.sqrt(0.2 * 0.8 / turns))
    added = len(edges['double']) - len(edges['clean'])
    assert added / turns == pytest.approx(0.1, abs=5 * math.sqrt(0.1 * 0.9 / turns))
    place = edges['double'] % 1.0
    false = place[(place > 0.1) & (place < 0.9)]
    # 2 rad after the pulse, less the rising flank of 3.2 degrees; a sample is 3.5 degrees
    np.testing.assert_allclose(false * 360.0, math.degrees(2.0) - 1.5, atol=2.0)
    # a missing pulse is missing as a whole: no half-height remainders
    pulse = measure({'keyphasor': {'missed_probability': 0.2}}, n=n, speed_rad_s=speed).rows
    clean = measure({}, n=n, speed_rad_s=speed).rows
    part = pulse['keyphasor'][clean['keyphasor'] > 0] / clean['keyphasor'][clean['keyphasor'] > 0]
    assert set(np.unique(part)) == {0.0, 1.0}


HOUSING = {'mass_kg': 8.0, 'natural_frequency_hz': 900.0, 'damping_ratio': 0.05}


@pytest.mark.parametrize('frequency_hz', [56.0, 450.0, 880.0, 900.0, 920.0, 2500.0])
def test_housing_answers_as_the_oscillator_does(frequency_hz: float) -> None:
    rate, n, force = 51_200, 51_200, 70.0
    phase = 2 * np.pi * frequency_hz * np.arange(n) / rate
    out = {13: force * np.cos(phase), 14: 2 * force * np.cos(phase)}
    truth = measure({'housing': HOUSING}, out, n=n, rate=rate).truth_rows
    s = 2j * np.pi * frequency_hz
    w, zeta = 2 * np.pi * 900.0, 0.05
    response = s * s / (s * s + 2 * zeta * w * s + w * w) / 8.0
    last = slice(n // 2, None)
    # the driving force is MINUS that on the journal; the hold lowers it by (pi f/rate)^2/3, and the
    # small difference of force and spring below the resonance by as much at the resonance
    hold = 0.5 * (math.pi * max(frequency_hz, 900.0) / rate) ** 2
    for name, size in (('brg1_az', force), ('brg2_ay', 2 * force)):
        found = 2 * (truth[name][last] * np.exp(-1j * phase[last])).mean()
        assert found == pytest.approx(-size * response, rel=hold + 1e-4)
    assert not truth['brg1_ay'].any()


def test_housing_is_the_exact_answer_to_a_force_linear_between_samples() -> None:
    force = np.random.default_rng(2).normal(size=2000)
    force -= force[0]  # scipy starts from zero, the housing from rest under the first force
    truth = measure({'housing': HOUSING}, {12: 40.0 + force}, n=2000).truth_rows
    w, zeta, mass = 2 * np.pi * 900.0, 0.05, 8.0
    system = signal.lti([1 / mass, 0, 0], [1, 2 * zeta * w, w * w])
    _, expected, _ = signal.lsim(system, -force, np.arange(2000) / RATE)
    # float32 rows
    np.testing.assert_allclose(truth['brg1_ay'], expected, atol=1e-6 * np.abs(expected).max())


def test_housing_at_rest_feels_nothing() -> None:
    truth = measure({'housing': HOUSING}, {12: np.full(3000, 321.0)}, n=3000).truth_rows
    # rounding of forces of 40 m/s^2
    assert np.abs(truth['brg1_ay']).max() < 1e-10
