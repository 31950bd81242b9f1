# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Draw docs/images/maneuvers.png from the load grids of `maneuver_gen`.

Usage: python docs/make_maneuver_figure.py [FILE.png]
"""

import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from maneuver_gen import flight_path_angle, load_grid, parse_maneuver
from maneuver_gen.curves import FloatArray
from maneuver_gen.maneuvers.climb_dive import ClimbDive
from rotor_common.constants import GRAVITY_M_S2, LOAD_RATE_HZ

DEFAULT_FILE = Path(__file__).parent / 'images' / 'maneuvers.png'
BLUE, ORANGE, GREEN, PURPLE = '#0072b2', '#d55e00', '#009e73', '#7b3f99'
SHADE = '#eef1f5'


def load_factors(data: dict[str, Any], duration_s: float) -> tuple[FloatArray, FloatArray]:
    """Return times (s) and load factors, normal and lateral, of shape (n, 2)."""
    grid = load_grid(parse_maneuver(data), duration_s)
    return np.arange(len(grid)) / LOAD_RATE_HZ, grid / GRAVITY_M_S2


def draw_climb_dive(load_axes: Any, angle_axes: Any) -> None:
    """Draw the default climbing-diving flight: load factor above flight-path angle."""
    config = parse_maneuver({'profile': 'climb_dive'})
    assert isinstance(config, ClimbDive)  # noqa: S101
    times, load = load_factors({'profile': 'climb_dive'}, 20.0)
    paper = load_factors({'profile': 'climb_dive', 'weight': False}, 20.0)[1]
    names = ('pull-up', 'push-over', 'pull-out')
    for axes in (load_axes, angle_axes):
        for pulse in config.pulses():
            axes.axvspan(pulse.start_s, pulse.end_s, color=SHADE, zorder=0)
        axes.set_xlim(0.0, 20.0)
    for name, pulse in zip(names, config.pulses(), strict=True):
        load_axes.text((pulse.start_s + pulse.end_s) / 2.0, 3.25, name, ha='center')
    load_axes.plot(times, load[:, 0], color=BLUE, label='with the weight: level flight is 1')
    load_axes.plot(times, paper[:, 0], '--', color=ORANGE, label='weight: false, as eq. (1)')
    load_axes.set_ylim(-1.3, 3.7)
    load_axes.set_ylabel('load factor')
    load_axes.set_title('climb_dive: the default flight')
    load_axes.legend(loc='center', bbox_to_anchor=(0.5, 0.55), frameon=False)
    angle_axes.plot(times, np.degrees(flight_path_angle(config, times)), color=BLUE)
    angle_axes.set_ylabel('flight path [degrees]')
    angle_axes.set_xlabel('time [s]')


def draw_turn(axes: Any) -> None:
    """Draw a turn with slip."""
    data = {'profile': 'turn', 'bank_rad': np.pi / 3.0, 'turn_s': 5.0, 'slip_load_factor': -0.3}
    times, load = load_factors(data, 11.0)
    axes.plot(times, load[:, 0], color=BLUE, label='normal')
    axes.plot(times, load[:, 1], color=GREEN, label='lateral, from slip')
    axes.set_title('turn: 60 degrees of bank, slip -0.3')
    axes.legend(frameon=False, loc='center')


def draw_simple(axes: Any) -> None:
    """Draw step, ramp and sinusoid."""
    profiles: list[tuple[dict[str, Any], str]] = [
        ({'profile': 'step', 'after': 3.0, 'at_s': 2.0}, BLUE),
        ({'profile': 'ramp', 'after': 5.0, 'start_s': 2.0, 'duration_s': 6.0}, ORANGE),
        ({'profile': 'sinusoid', 'amplitude': 0.8, 'frequency_hz': 0.5, 'mean': -0.5}, GREEN),
    ]
    for data, colour in profiles:
        times, load = load_factors(data, 10.0)
        axes.plot(times, load[:, 0], color=colour, label=data['profile'])
    axes.set_title('step, ramp, sinusoid')
    axes.legend(frameon=False, loc='upper left')


def draw_sequence(axes: Any) -> None:
    """Draw a sequence with its blends shaded."""
    durations_s, loads, blend_s = (3.0, 3.0, 4.0), (1.0, 4.0, 2.0), 1.0
    parts = [
        {'duration_s': duration_s, 'maneuver': {'profile': 'constant', 'load_factor': load}}
        for duration_s, load in zip(durations_s, loads, strict=True)
    ]
    data = {'profile': 'sequence', 'blend_s': blend_s, 'segments': parts}
    times, load = load_factors(data, 10.0)
    for join_s in np.cumsum(durations_s)[:-1]:
        axes.axvspan(join_s, join_s + blend_s, color=SHADE, zorder=0)
    axes.plot(times, load[:, 0], color=PURPLE)
    axes.set_title('sequence: blends shaded')


def draw_gusts(axes: Any) -> None:
    """Draw rough air of two strengths."""
    for rms, colour in ((0.4, ORANGE), (0.1, BLUE)):
        times, load = load_factors({'profile': 'gusts', 'rms': rms, 'seed': 2}, 30.0)
        axes.plot(times, load[:, 0], color=colour, label=f'rms {rms:g}')
    axes.set_ylim(-0.5, 2.7)
    axes.set_title('gusts')
    axes.legend(frameon=False, loc='upper left', ncols=2)


def main(path: Path) -> None:
    """Write the figure to `path`."""
    mpl.rcParams.update({'font.size': 9, 'axes.grid': True, 'grid.alpha': 0.3})
    figure = Figure(figsize=(11.0, 7.5), layout='constrained')
    panels = figure.subplot_mosaic(
        [['load'] * 4, ['angle'] * 4, ['turn', 'simple', 'sequence', 'gusts']],
        height_ratios=[2.0, 1.1, 1.7],
    )
    draw_climb_dive(panels['load'], panels['angle'])
    draw_turn(panels['turn'])
    draw_simple(panels['simple'])
    draw_sequence(panels['sequence'])
    draw_gusts(panels['gusts'])
    panels['turn'].set_ylabel('load factor')
    for name in ('turn', 'simple', 'sequence', 'gusts'):
        panels[name].set_xlabel('time [s]')
    for axes in panels.values():
        axes.spines[['top', 'right']].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={'Software': None})


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_FILE)
