# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled kernel against the readable model, NaN, and the cache on disk."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rotor_sim import RotorParameters, _kernels
from rotor_sim.model import Drive, acceleration, rk4_step
from rotor_sim.parameters import VARIANTS

Array = NDArray[np.float64]
RATE_HZ = 10_240
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

    def drive_at(self, time_s: float) -> Drive:
        part = time_s * RATE_HZ
        time = (self.number + part) / RATE_HZ
        load_y, load_z = (float(np.interp(time, GRID_S, LOAD[:, i])) for i in (0, 1))
        return Drive(
            angle_rad=self.angle + (self.speed + 0.5 * self.speed_increment * part) * time_s,
            speed_rad_s=self.speed + self.speed_increment * part,
            angular_acceleration_rad_s2=self.speed_increment * RATE_HZ,
            load_y_m_s2=load_y,
            load_z_m_s2=load_z,
            crack_stiffness_ratio=self.crack + self.crack_increment * part,
        )


def kernel(parameters: RotorParameters, state: Array, sample: Sample) -> tuple[Array, Array]:
    """Return the sampled row and the state after it."""
    coefficients, balls = _kernels.pack(parameters)
    after, out = state.copy(), np.empty((1, _kernels.OUTPUTS))
    angle = np.array([sample.angle])
    _kernels.integrate(
        coefficients, balls, after, out, RATE_HZ, 1 / RATE_HZ, 1, sample.number,
        angle, parameters.cage_ratio * angle,
        np.array([sample.speed]), np.array([sample.speed_increment]),
        np.array([sample.crack]), np.array([sample.crack_increment]),
        LOAD, 0, 100,
    )  # fmt: skip
    return out[0], after


@pytest.mark.parametrize('variant', VARIANTS)
def test_kernel_is_the_model(variant: str) -> None:
    random = np.random.default_rng(2)
    for _ in range(100):
        p = RotorParameters.hou2016(
            variant,
            clearance_m=float(random.choice([0.0, 3e-6])),
            ball_count=int(random.integers(3, 15)),
            crack_angle_rad=float(random.uniform(-6, 6)),
            crack_half_angle_rad=float(random.uniform(0.1, 1.5)),
        )
        state = np.concatenate([random.normal(size=6) * 2e-5, random.normal(size=6) * 1e-2])
        sample = Sample(
            number=int(random.integers(0, 203)),  # the load has a kink at sample 102.4
            angle=float(random.uniform(0, 6.28)),
            speed=float(random.uniform(10, 1200)),
            speed_increment=float(random.uniform(-1, 1)),
            crack=float(random.uniform(0, 0.3)),
            crack_increment=float(random.uniform(-0.1, 0.1)),
        )
        row, after = kernel(p, state, sample)
        expected = acceleration(p, state, sample.drive_at(0.0))
        stepped = rk4_step(p, state, 0.0, 1 / RATE_HZ, sample.drive_at)
        np.testing.assert_array_equal(row[:6], state[:6])
        # relative to the largest term: the sums cancel in part
        scale = np.abs(expected).max()
        np.testing.assert_allclose(row[6:10], expected[2:], rtol=0, atol=2e-12 * scale)
        for part in (slice(0, 6), slice(6, 12)):
            size = np.abs(stepped[part]).max()
            np.testing.assert_allclose(after[part], stepped[part], rtol=0, atol=2e-12 * size)


def test_load_row_is_the_linear_interpolation() -> None:
    for number in (0, 50, 102, 103, 204):
        row, _ = kernel(RotorParameters.hou2016(), np.zeros(12), Sample(number))
        for column, axis in ((10, 0), (11, 1)):
            expected = np.interp(number / RATE_HZ, GRID_S, LOAD[:, axis])
            assert row[column] == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize('place', range(12))
def test_nan_stays_nan(place: int) -> None:
    state = np.full(12, 1e-6)
    state[place] = np.nan
    _, after = kernel(RotorParameters.hou2016(), state, Sample())
    assert np.isnan(after[place])


SCRIPT = """
import numpy as np
from rotor_sim import RotorParameters, _kernels
p, balls = _kernels.pack(RotorParameters.hou2016())
z = np.zeros(1)
_kernels.integrate(p, balls, np.zeros(12), np.empty((1, 12)), 10240, 1 / 10240, 1, 0, z, z, z, z,
                   z, z, np.zeros((3, 2)), 0, 100)
print(sum(_kernels.integrate.stats.cache_hits.values()),
      sum(_kernels.integrate.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_second_process_loads_the_kernel_from_disk(tmp_path: Path) -> None:
    environment = {**os.environ, 'NUMBA_CACHE_DIR': str(tmp_path)}
    results = [
        subprocess.run(
            [sys.executable, '-c', SCRIPT],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert results == [['0', '1'], ['1', '0']]


def test_import_is_light() -> None:
    """No ROS at all, and neither numba nor scipy before something is computed."""
    script = (
        "import sys, rotor_sim; print([m for m in ('rclpy', 'numba', 'scipy') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, '-c', script], check=True, capture_output=True, text=True)
    assert run.stdout.strip() == '[]'
