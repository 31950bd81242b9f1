# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Spalls of a ball bearing: where they are, what they take, and their lines in the envelope."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import hilbert

from plant_stream import streamed
from rotor_sim.plant.compiled_plant import CompiledPlant, Instant
from rotor_sim.plant.element import Element
from rotor_sim.plant.elements.ball_bearing import BallBearing
from rotor_sim.plant.elements.shaft_segment import ShaftSegment
from rotor_sim.plant.elements.spalled_ball_bearing import SpalledBallBearing
from rotor_sim.plant.generator import Record
from rotor_sim.plant.plant import Node, Plant

Array = NDArray[np.float64]

BALLS, INNER, OUTER, HERTZ = 9, 0.0401, 0.0639, 1.334e10
MASS, DEPTH = 4.0, 4e-6
CAGE = INNER / (INNER + OUTER)
PITCH, BALL = INNER + OUTER, OUTER - INNER
# per turn of the shaft, as in textbooks (contact angle 0)
BPFO = 0.5 * BALLS * (1.0 - BALL / PITCH)
BPFI = 0.5 * BALLS * (1.0 + BALL / PITCH)
BSF = 0.5 * PITCH / BALL * (1.0 - (BALL / PITCH) ** 2)
FTF = 0.5 * (1.0 - BALL / PITCH)
PLACES = ('outer_race', 'inner_race', 'ball')


def spalled(spall_on: Any, depth_m: float = DEPTH, **values: Any) -> SpalledBallBearing:
    values = {'node': 'journal', 'ball_count': BALLS, **values}
    return SpalledBallBearing(spall_on=spall_on, depth_m=depth_m, **values)


def held(bearing: Element, *, records: tuple[Record, ...] = ()) -> CompiledPlant:
    spring = ShaftSegment(node='journal', stiffness_n_m=1e5, damping_n_s_m=1500.0)
    return CompiledPlant(
        Plant(nodes={'journal': Node(mass_kg=MASS)}, elements=(spring, bearing)), records
    )


def force(bearing: Element, place: Any, angle: float) -> Array:
    """Of the bearing on the journal, N."""
    plant = CompiledPlant(Plant(nodes={'journal': Node(mass_kg=1.0)}, elements=(bearing,)))
    return plant.acceleration([*place, 0.0, 0.0], Instant(angle))


@pytest.mark.parametrize(
    ('spall_on', 'angle_rad', 'shaft', 'ball'),
    [
        # the ball at 3/9 of a turn stands at the spall of the outer race from the start
        ('outer_race', 2.0 * math.pi / 3.0, 0.0, 3),
        # and ball 0 is there when the cage has turned that far
        ('outer_race', 2.0 * math.pi / 3.0, 2.0 * math.pi / 3.0 / CAGE, 0),
        ('inner_race', 2.0 * math.pi / 3.0, 0.0, 3),
        # the inner race has gained a pitch on the cage: its spall is at the next ball
        ('inner_race', 0.0, 2.0 * math.pi / BALLS / (1.0 - CAGE), 1),
        ('ball', 0.0, 0.0, 0),
        # the ball has made half a turn on the cage: its spall is at the other race
        ('ball', 0.0, math.pi / BSF, 0),
        ('ball', -0.5 * math.pi, 0.5 * math.pi / BSF, 0),
    ],
)
def test_ball_in_the_spall_loses_its_depth(
    spall_on: str, angle_rad: float, shaft: float, ball: int
) -> None:
    """Preloaded by c, a ball carries K (c + n . x)^1.5, the one there K (c + n . x - depth)^1.5."""
    preload, place = 1e-5, np.array([3e-6, -2e-6])
    found = force(spalled(spall_on, angle_rad=angle_rad, clearance_m=-preload), place, shaft)
    at = CAGE * shaft + 2.0 * math.pi * np.arange(BALLS) / BALLS
    n = np.stack([np.cos(at), np.sin(at)])
    pressed = preload + place @ n
    pressed[ball] -= DEPTH
    assert found == pytest.approx(-HERTZ * (n @ pressed**1.5), rel=1e-9)


@pytest.mark.parametrize('spall_on', PLACES)
def test_spall_is_met_as_often_as_the_geometry_says(spall_on: str) -> None:
    """Edges of what is lost, counted over 40 turns of the shaft."""
    bearing, smooth = (
        spalled(spall_on, clearance_m=-1e-5),
        spalled(spall_on, 0.0, clearance_m=-1e-5),
    )
    plants = [
        CompiledPlant(Plant(nodes={'journal': Node(mass_kg=1.0)}, elements=(each,)))
        for each in (bearing, smooth)
    ]
    turns = np.arange(0.1, 40.1, 0.004)
    state = np.zeros(4)
    lost = np.array(
        [
            np.hypot(*(plants[0].acceleration(state, at) - plants[1].acceleration(state, at)))
            for at in map(Instant, map(float, 2.0 * math.pi * turns))
        ]
    )
    inside = lost > 0.2 * lost.max()
    met = np.count_nonzero(inside[1:] & ~inside[:-1])
    expected = {'outer_race': BPFO, 'inner_race': BPFI, 'ball': 2.0 * BSF}[spall_on]
    assert met == pytest.approx(40.0 * expected, abs=1.0)
    assert bearing.labels()['spall_order'] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize('spall_on', PLACES)
def test_entry_comes_before_exit(spall_on: str) -> None:
    """Ramps of half and of a tenth of the length: the loss grows slowly and ends fast."""
    radius = {'outer_race': OUTER, 'inner_race': INNER, 'ball': 0.5 * BALL}[spall_on]
    length = 0.05 * radius
    bearing = spalled(spall_on, clearance_m=-1e-5, length_m=length, entry_share=0.5, exit_share=0.1)
    order = {'outer_race': CAGE, 'inner_race': 1.0 - CAGE, 'ball': BSF}[spall_on]
    reach = 0.5 * length / radius / order  # shaft angle from the middle of the spall to its edge

    def share(part: float) -> float:
        """Of the depth that ball 0 has lost, from the force along it."""
        found = force(bearing, (0.0, 0.0), part * reach)
        n = np.array([math.cos(CAGE * part * reach), math.sin(CAGE * part * reach)])
        # without the loss the forces of all balls add up to 0
        missing = float(found @ n)
        left = 1e-5 - ((HERTZ * 1e-5**1.5 - missing) / HERTZ) ** (2.0 / 3.0)
        return float(left / DEPTH)

    ramp = [3.0 * t**2 - 2.0 * t**3 for t in (0.25, 0.5, 0.75)]
    assert [share(-0.75), share(-0.5), share(-0.25)] == pytest.approx(ramp, abs=2e-3)
    assert [share(0.01), share(0.4), share(0.79)] == pytest.approx([1.0] * 3, abs=2e-3)
    assert share(0.9) == pytest.approx(0.5, abs=5e-3)
    assert [share(-1.01), share(1.01)] == pytest.approx([0.0, 0.0], abs=1e-9)
    if spall_on == 'ball':  # the same at the other race, half a turn of the ball later
        half = math.pi / BSF / reach
        assert share(half - 0.5) == pytest.approx(0.5, abs=2e-3)
        assert share(half + 0.4) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize('spall_on', PLACES)
@pytest.mark.parametrize(('balls', 'clearance'), [(9, 0.0), (9, 2e-6), (8, -3e-6), (12, -1e-6)])
def test_depth_0_has_the_bits_of_the_bearing_without_pairs(
    spall_on: str, balls: int, clearance: float
) -> None:
    plain = BallBearing(node='journal', ball_count=balls, clearance_m=clearance)
    sound = spalled(spall_on, 0.0, ball_count=balls, clearance_m=clearance)
    deep = spalled(spall_on, 1e-5, ball_count=balls, clearance_m=clearance, length_m=1e-2)
    differ = False
    for k in range(40):
        place = np.array([6e-6, 1e-6 * k])
        expected = force(plain, place, 0.37 * k)
        assert force(sound, place, 0.37 * k).tobytes() == expected.tobytes()
        differ |= force(deep, place, 0.37 * k).tobytes() != expected.tobytes()
    assert differ


@pytest.mark.parametrize('balls', [8, 10])
def test_depth_0_agrees_with_paired_balls_to_rounding(balls: int) -> None:
    """Pairs of opposite balls are added in another order."""
    plain = BallBearing(node='journal', ball_count=balls, clearance_m=1e-6)
    sound = spalled('outer_race', 0.0, ball_count=balls, clearance_m=1e-6)
    for k in range(40):
        place = np.array([6e-6, 1e-6 * k - 2e-5])
        expected = force(plain, place, 0.37 * k)
        error = np.hypot(*(force(sound, place, 0.37 * k) - expected))
        assert error <= 4e-15 * np.hypot(*expected)


def test_derived_tangent_is_that_of_differences() -> None:
    plant = held(spalled('outer_race', clearance_m=-1e-5))
    state, at = np.array([3e-6, -2e-6, 0.1, 0.2]), Instant(0.01, 100.0)
    slope = plant.jacobian(state, at)
    for k in range(2):
        move = 1e-10 * np.eye(4)[k]
        change = plant.acceleration(state + move, at) - plant.acceleration(state - move, at)
        assert slope[:, k] == pytest.approx(change / 2e-10, rel=1e-4)


def envelope_lines(bearing: Element, turns_hz: float) -> tuple[Array, Array]:
    """Return frequencies and amplitudes of the envelope of the acceleration in 0.4 to 3 kHz."""
    rate = 10240
    plant = held(bearing, records=(Record('acceleration', 0),))
    samples, _ = streamed(
        plant,
        2.0 * math.pi * turns_hz,
        load_m_s2=(50.0, 0.0),
        samples=4 * rate + rate // 2,
        rate_hz=rate,
        substeps=4,
    )
    signal = samples[rate // 2 :, 2]
    frequencies = np.fft.rfftfreq(len(signal), 1.0 / rate)
    spectrum = np.fft.rfft(signal)
    spectrum[(frequencies < 400.0) | (frequencies > 3000.0)] = 0.0
    envelope = np.abs(hilbert(np.fft.irfft(spectrum, len(signal))))
    window = np.hanning(len(signal))
    return frequencies, np.abs(np.fft.rfft((envelope - envelope.mean()) * window)) / window.sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    ('spall_on', 'line', 'beside', 'sidebands'),
    [('outer_race', BPFO, 0.0, 0), ('inner_race', BPFI, 1.0, 2), ('ball', 2.0 * BSF, FTF, 2)],
)
def test_envelope_has_the_lines_of_the_geometry(
    spall_on: str, line: float, beside: float, sidebands: int
) -> None:
    """BPFO, BPFI +- shaft, 2 BSF +- FTF within a line of 0.25 Hz, far above what lies between.

    The load stands still, so a spall that moves through its zone is modulated with the shaft or
    the cage, and one on the outer race is not.
    """
    turns_hz = 25.0
    frequencies, found = envelope_lines(spalled(spall_on), turns_hz)
    _, sound = envelope_lines(spalled(spall_on, 0.0), turns_hz)
    floor = float(np.median(found[(frequencies > 5.0) & (frequencies < 400.0)]))
    for n in (1, 2):
        for k in range(-sidebands, sidebands + 1):
            at = int(np.argmin(np.abs(frequencies - turns_hz * (n * line + k * beside))))
            near = slice(at - 6, at + 7)
            assert abs(int(np.argmax(found[near])) - 6) <= 1, (n, k)
            assert found[near].max() > 20.0 * floor, (n, k)
            assert found[near].max() > 100.0 * sound[near].max(), (n, k)
    if spall_on == 'outer_race':  # no sidebands of shaft or cage
        for offset in (1.0, -1.0, FTF, -FTF):
            at = int(np.argmin(np.abs(frequencies - turns_hz * (line + offset))))
            assert found[at - 2 : at + 3].max() < 1e-2 * found.max()
