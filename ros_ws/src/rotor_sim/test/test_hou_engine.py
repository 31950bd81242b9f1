# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The engine of the paper's rotor against equations written apart, NaN, and the cache on disk."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hou_equations import Drive, acceleration, breathing, contact_force, rk4_step
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rotor_common.constants import LANES
from rotor_sim import RotorParameters
from rotor_sim.plant.arithmetic import cos_sin, half_angle
from rotor_sim.plant.breathing import breathing_polynomial
from rotor_sim.plant.compiled_plant import CompiledPlant
from rotor_sim.plant.elements.hou_crack import POLYNOMIAL_TERMS
from rotor_sim.plant.hou2016 import RECORDS, hou2016
from rotor_sim.plant.parameters import VARIANTS

Array = NDArray[np.float64]
Kernel = Callable[..., tuple[Array, Array]]
RATE_HZ = 10_240
BALL_COUNTS = (3, 8, 10)  # every one is compiled by itself
HALF_ANGLES = (np.pi / 6, np.pi / 6, 0.01, 0.1, 0.5, 1.0, np.pi / 2)
GRID_S = (0.0, 0.01, 0.02)
LOAD = np.array([[20.0, -3.0], [35.0, 4.0], [5.0, 0.0]])


@dataclass(frozen=True)
class Sample:
    """One sample at RATE_HZ in one step: start values and their increments over the sample."""

    number: int = 0
    angle: float = 0.3
    speed: float = 352.0
    speed_increment: float = 0.0
    crack: float = 0.1
    crack_increment: float = 0.0
    forcing_n: float = 0.0
    forcing_phase_rad: float = 0.0

    def drive_at(self, time_s: float) -> Drive:
        part = time_s * RATE_HZ
        time = (self.number + part) / RATE_HZ
        load_y, load_z = (float(np.interp(time, GRID_S, LOAD[:, i])) for i in (0, 1))
        angle = self.angle + (self.speed + 0.5 * self.speed_increment * part) * time_s
        twice = 2.0 * angle + self.forcing_phase_rad
        return Drive(
            angle_rad=angle,
            speed_rad_s=self.speed + self.speed_increment * part,
            angular_acceleration_rad_s2=self.speed_increment * RATE_HZ,
            load_y_m_s2=load_y,
            load_z_m_s2=load_z,
            crack_stiffness_ratio=self.crack + self.crack_increment * part,
            force_y_n=self.forcing_n * float(np.cos(twice)),
            force_z_n=self.forcing_n * float(np.sin(twice)),
        )


@pytest.fixture(scope='module')
def kernel(integrated: Callable[..., Any]) -> Kernel:
    def run(parameters: RotorParameters, state: Array, sample: Sample) -> tuple[Array, Array]:
        """Return the sampled row and the state after it."""
        drive = [
            sample.angle,
            parameters.cage_ratio * sample.angle,
            sample.speed,
            sample.speed_increment,
            sample.crack,
            sample.crack_increment,
        ]
        out, after = integrated(
            parameters,
            state,
            np.array([drive]),
            rate_hz=RATE_HZ,
            sample_s=1 / RATE_HZ,
            substeps=1,
            grid=LOAD,
            load_rate_hz=100,
            first_sample=sample.number,
            forcing=(sample.forcing_n, sample.forcing_phase_rad),
        )
        return out[0], after

    return run


@pytest.mark.parametrize('variant', VARIANTS)
def test_kernel_is_the_model(variant: str, kernel: Kernel) -> None:
    random = np.random.default_rng(2)
    for _ in range(100):
        p = RotorParameters.hou2016(
            variant,
            clearance_m=float(random.choice([0.0, 3e-6])),
            ball_count=int(random.choice(BALL_COUNTS)),
            crack_angle_rad=float(random.uniform(-6, 6)),
            crack_half_angle_rad=float(random.choice(HALF_ANGLES)),
        )
        state = np.concatenate([random.normal(size=6) * 2e-5, random.normal(size=6) * 1e-2])
        sample = Sample(
            number=int(random.integers(0, 203)),  # the load has a kink at sample 102.4
            angle=float(random.uniform(0, 6.28)),
            speed=float(random.uniform(10, 1200)),
            speed_increment=float(random.uniform(-1, 1)),
            crack=float(random.uniform(0, 0.3)),
            crack_increment=float(random.uniform(-0.1, 0.1)),
            forcing_n=float(random.uniform(0, 500)),
            forcing_phase_rad=float(random.uniform(-6, 6)),
        )
        row, after = kernel(p, state, sample)
        expected = acceleration(p, state, sample.drive_at(0.0))
        stepped = rk4_step(p, state, 0.0, 1 / RATE_HZ, sample.drive_at)
        np.testing.assert_array_equal(row[:6], state[:6])
        # relative to the largest term: the sums cancel in part
        scale = np.abs(expected).max()
        np.testing.assert_allclose(row[6:10], expected[2:], rtol=0, atol=2e-12 * scale)
        cage = p.cage_ratio * sample.angle
        on_journals = [contact_force(p, state[i : i + 2], cage) for i in (2, 4)]
        forces = np.concatenate(on_journals)
        np.testing.assert_allclose(row[12:], forces, rtol=0, atol=2e-12 * np.abs(forces).max())
        for part in (slice(0, 6), slice(6, 12)):
            size = np.abs(stepped[part]).max()
            np.testing.assert_allclose(after[part], stepped[part], rtol=0, atol=2e-12 * size)


def test_load_row_is_the_linear_interpolation(kernel: Kernel) -> None:
    for number in (0, 50, 102, 103, 204):
        row, _ = kernel(RotorParameters.hou2016(), np.zeros(12), Sample(number))
        for column, axis in ((10, 0), (11, 1)):
            expected = np.interp(number / RATE_HZ, GRID_S, LOAD[:, axis])
            assert row[column] == pytest.approx(expected, rel=1e-13)


@settings(max_examples=300, deadline=None)
@given(angle=st.floats(-1e5, 1e5))
@example(angle=0.0)
@example(angle=np.pi / 4)
@example(angle=np.pi)
@example(angle=2 * np.pi)
def test_cos_and_sin_are_those_of_the_library(angle: float) -> None:
    # one unit in the last place of 1; near a zero the error is that small too
    assert cos_sin(angle) == pytest.approx((np.cos(angle), np.sin(angle)), rel=0, abs=2.3e-16)


@settings(max_examples=300, deadline=None)
@given(angle=st.floats(-np.pi / 2, np.pi / 2), behind=st.booleans(), r=st.floats(1e-12, 1e3))
@example(angle=np.pi / 2, behind=False, r=1.0)
@example(angle=-np.pi / 2, behind=True, r=1.0)
@example(angle=0.0, behind=True, r=1e-5)
def test_angle_is_that_of_the_library(angle: float, behind: bool, r: float) -> None:
    x, y = r * np.cos(angle) * (-1.0 if behind else 1.0), r * np.sin(angle)
    # two units in the last place of pi/2, and what rounding x and y turns the direction by
    assert half_angle(x, y, r) == pytest.approx(angle, rel=0, abs=1e-15)


def lanes_of(count: int, variant: str, half_angle: float) -> list[RotorParameters]:
    return [
        RotorParameters.hou2016(
            variant,
            clearance_m=1e-6 * (i % 3),
            crack_angle_rad=0.4 * i,
            crack_half_angle_rad=half_angle,
            eccentricity_m=1e-6 * i,
        )
        for i in range(count)
    ]


@pytest.mark.parametrize('count', [1, 16])
@pytest.mark.parametrize('half_angle', [np.pi / 6, 0.5])
@pytest.mark.parametrize('variant', VARIANTS)
def test_the_second_bearing_repeats_the_first_to_the_last_bit(
    variant: str, half_angle: float, count: int
) -> None:
    """What is left out for bearings that move alike changes no bit of what is computed."""
    random = np.random.default_rng(5)
    plants = [
        CompiledPlant(hou2016(rotor), RECORDS) for rotor in lanes_of(count, variant, half_angle)
    ]
    states = np.concatenate(
        [random.normal(size=(count, 6)) * 2e-5, random.normal(size=(count, 6)) * 1e-2], axis=1
    )
    states[:, [4, 5, 10, 11]] = states[:, [2, 3, 8, 9]]
    n = 400
    drives = np.zeros((count, n, 4 + 2 * len(plants[0].live)))
    speeds = random.uniform(200.0, 700.0, size=(count, 1))
    drives[:, :, 0] = speeds * np.arange(n) / RATE_HZ
    drives[:, :, 1] = plants[0].ratios[1] * drives[:, :, 0]
    drives[:, :, 2] = speeds
    for lane, plant in enumerate(plants):
        drives[lane, :, 4::2] = list(plant.live.values())
    loads = np.repeat(LOAD[None], count, axis=0)
    loads = np.concatenate([loads, loads], axis=1)
    found = []
    for alike in (plants[0].alike(states), ()):
        after, out = states.copy(), np.empty((count, n, 6 + len(RECORDS)))
        plants[0].module.stream(
            (0,) * count,
            alike,
            np.array([plant.coefficients for plant in plants]),
            np.array([plant.ratios for plant in plants]),
            after,
            out,
            RATE_HZ,
            1 / RATE_HZ,
            2,
            0,
            drives,
            loads,
            0,
            100,
        )
        found.append((after.tobytes(), out.tobytes()))
        assert np.isfinite(out).all()
    assert plants[0].alike(states) == (0,)
    assert found[0] == found[1]


def test_bearings_are_alike_only_bit_for_bit() -> None:
    plant = CompiledPlant(hou2016(RotorParameters()))
    states = np.full((3, 12), np.nan)
    assert plant.alike(states) == (0,)
    for place in (2, 3, 8, 9, 4, 5, 10, 11):
        other = np.zeros((3, 12))
        other[1, place] = -0.0
        assert plant.alike(other) == ()


@pytest.mark.parametrize('alpha', [0.01, 0.1, 0.4, 0.65, 1.0, 1.3, np.pi / 2])
def test_polynomial_of_the_breathing_is_eq_4(alpha: float) -> None:
    polynomial, error = breathing_polynomial(alpha, POLYNOMIAL_TERMS)
    assert error < 1e-14
    u = np.linspace(-alpha, alpha, 999)
    t = np.tan(0.5 * u)
    # the model reaches u at theta = pi/2 - u; its cosine turns by up to 1e-16 pi/(2 alpha)
    expected = breathing(0.5 * np.pi - u, alpha)
    np.testing.assert_allclose(
        0.5 + t * np.polyval(polynomial, t**2), expected, rtol=0, atol=1e-14 + 5e-16 / alpha
    )


@pytest.mark.parametrize('place', range(12))
def test_nan_stays_nan(place: int, kernel: Kernel) -> None:
    state = np.full(12, 1e-6)
    state[place] = np.nan
    _, after = kernel(RotorParameters.hou2016(), state, Sample())
    assert np.isnan(after[place])


STREAM = """
import sys
import numpy as np
from rotor_sim import RotorParameters
from rotor_sim.plant.compiled_plant import CompiledPlant
from rotor_sim.plant.hou2016 import RECORDS, hou2016
plant = CompiledPlant(hou2016(RotorParameters()), RECORDS)
n = int(sys.argv[1])
stream = plant.module.stream
stream((0,) * n, (0,) * (sys.argv[2] == 'alike'), np.array([plant.coefficients] * n),
       np.array([plant.ratios] * n), np.zeros((n, 12)), np.empty((n, 1, 16)), 10240,
       1 / 10240, 1, 0, np.zeros((n, 1, 8)), np.zeros((n, 3, 2)), 0, 100)
"""
CACHE = f"""
{STREAM}
print(sum(stream.stats.cache_hits.values()), sum(stream.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_second_process_loads_the_kernel_from_disk(tmp_path: Path) -> None:
    environment = {**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)}
    results = [
        subprocess.run(
            [sys.executable, '-c', CACHE, '1', 'different'],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert results == [['0', '1'], ['1', '0']]


ASSEMBLY = f"""
{STREAM}
(text,) = stream.inspect_asm().values()
print(*(text.count(name) for name in ('vsqrtpd', 'vsqrtsd', 'vfmadd')))
"""


@pytest.mark.slow
@pytest.mark.parametrize(('bearings', 'contacts'), [('alike', 1), ('different', 2)])
def test_lanes_are_vectorised_and_nothing_is_contracted(
    bearings: str, contacts: int, tmp_path: Path
) -> None:
    processor = Path('/proc/cpuinfo')
    if not (processor.exists() and ' avx ' in processor.read_text()):
        pytest.skip('this processor has no AVX')
    # code from the cache on disk has no assembly to look at
    run = subprocess.run(
        [sys.executable, '-c', ASSEMBLY, str(LANES), bearings],
        env={**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)},
        check=True,
        capture_output=True,
        text=True,
    )
    packed, single, contracted = map(int, run.stdout.split())
    # 4 evaluations of 4 ball pairs a contact and one distance, in one or more copies of the loop
    assert packed > 0
    assert packed % (4 * (4 * contacts + 1)) == 0
    assert single == 0
    assert contracted == 0


def test_import_is_light() -> None:
    """No ROS at all, and neither numba nor scipy before something is computed."""
    script = (
        "import sys, rotor_sim; print([m for m in ('rclpy', 'numba', 'scipy') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, '-c', script], check=True, capture_output=True, text=True)
    assert run.stdout.strip() == '[]'
