# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Definitions of figures 5 to 19: the diagrams they need and the panels they show.

Source: Hou, Chen, Cao, Lu, Mechanism and Machine Theory 105 (2016) 515-528. Ranges and operating
points come from `facts.yaml`; everything else here is from the captions of the figures.
"""

import importlib.resources
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rotor_common.plain_data import parse_yaml
from rotor_dynamics import OperatingPoint, Plan, sweep
from rotor_sim.plant.parameters import RotorParameters

VARIANTS = ('natural', 'derived', 'figure', 'figure_chaos')
"""Every reading of the equations, the default first."""

RECONSTRUCTIONS = ('figure', 'figure_chaos')
RECONSTRUCTION = "empirical reconstruction, not the authors' code"

SLOWEST_SPEED_RAD_S = 20.0
"""Where a diagram over speed starts: at speed 0 there is no revolution to sample at."""

HIGHEST_FREQUENCY_RAD_S = 1500.0
"""End of the frequency axes of the paper's spectra (Figs 6, 7-10, 12, 14, 17, 19)."""

HIGHEST_ORDER = 32.0
"""Largest order that a survey resolves; below 47 rad/s the spectra of Fig. 6 end there."""

SERIES_TRANSIENT = 4.236
"""Transient of Figs 7-10 over that of the diagrams: with 1000 revolutions there the recording
starts at tau = 2.6616e4, just before the paper's window of 2.662e4 to 2.666e4."""

SERIES_WINDOW = (2.662e4, 2.666e4)
"""That window, 6.4 revolutions; its phase in the revolution is kept with a shorter transient."""

SERIES_REVOLUTIONS = 48
"""Revolutions recorded sample by sample: the window, and four beats of the ball pass with 3x for
the phase portrait (3.0846 - 3 = 1/11.8)."""

RESONANCE_LOAD_FACTOR = 3
"""Load factor G of Figs 7 to 10 and of the resonances in the text."""

LOAD_FACTORS = (0.0, 10.0)
"""Range of G in Figs 11 to 13."""

CONTINUATION_VALUES = 200
CONTINUATION_TRANSIENT = 200
CONTINUATION_REVOLUTIONS = 50
"""Up- and down-sweeps behind Fig. 11 start from their neighbour, so they settle sooner."""

MICROMETRE = 1e-6

PanelKind = Literal[
    'orbit_diagram', 'waterfall', 'exponents', 'series', 'portrait', 'section', 'spectrum'
]
Facts = Mapping[str, Any]


@dataclass(frozen=True)
class Settings:
    """Values a diagram; revolutions left out, recorded, and for an exponent; check at 2N steps."""

    values: int = 400
    transient: int = 1000
    revolutions: int = 300
    exponent_revolutions: int = 500
    check_steps: bool = True


@dataclass(frozen=True)
class Diagram:
    """One survey: a parameter swept in SI, or a few values of it, everything else fixed.

    `over` is speed_rad_s, load_factor or a field of RotorParameters.
    """

    key: str
    over: str
    values: tuple[float, ...] = ()
    limits: tuple[float, float] = (0.0, 0.0)
    speed_rad_s: float = 0.0
    load_factor: float = 0.0
    changes: Mapping[str, float] = field(default_factory=dict)
    exponent: bool = False
    highest_order: float = 0.0
    transient_ratio: float = 1.0
    continued: bool = False
    series: bool = False

    def axis(self, count: int) -> NDArray[np.float64]:
        """Return the values of the parameter in SI: its own few, or `count` evenly spaced."""
        if self.values:
            return np.array(self.values)
        return np.linspace(*self.limits, count)

    def points(self, variant: str, count: int) -> tuple[OperatingPoint, ...]:
        """Return one operating point per value, in the named reading of the equations."""
        axis = self.axis(count)
        return sweep(
            RotorParameters.hou2016(variant, **self.changes),
            self.over,
            axis,
            speed_rad_s=None if self.over == 'speed_rad_s' else self.speed_rad_s,
            load_factor=None if self.over == 'load_factor' else self.load_factor,
        )

    def plan(self, settings: Settings) -> Plan:
        """Return what to compute at every point."""
        return Plan(
            transient_revolutions=round(self.transient_ratio * settings.transient),
            revolutions=settings.revolutions,
            exponent_revolutions=settings.exponent_revolutions if self.exponent else 0,
            highest_order=self.highest_order,
            check_steps=settings.check_steps,
        )

    def swept(self, points: Iterable[OperatingPoint]) -> NDArray[np.float64]:
        """Return the values of the swept parameter at `points`, SI."""
        held_by_point = self.over in {'speed_rad_s', 'load_factor'}
        owners = points if held_by_point else [point.parameters for point in points]
        return np.array([float(getattr(owner, self.over)) for owner in owners])


@dataclass(frozen=True)
class Panel:
    """One set of axes: what is drawn, of which diagram, and the paper's ticks around it.

    `index` picks a point of the diagram for the panels of a single motion; `ticks_x`, `ticks_y`
    are the outer ticks of the paper's axes, `mark_x` a value the text names.
    """

    caption: str
    kind: PanelKind
    diagram: str
    coordinate: Literal['y', 'z'] = 'z'
    index: int = 0
    ticks_x: tuple[float, float] | None = None
    ticks_y: tuple[float, float] | None = None
    mark_x: float | None = None


@dataclass(frozen=True)
class Figure:
    """A figure of the paper: its number, caption, panels and the columns of its layout."""

    number: int
    title: str
    panels: tuple[Panel, ...]
    columns: int = 2

    @property
    def diagrams(self) -> tuple[str, ...]:
        """Keys of the diagrams it needs, without repetition."""
        return tuple(dict.fromkeys(panel.diagram for panel in self.panels))


def load_facts() -> dict[str, Any]:
    """Return what the paper reports, as stored in `facts.yaml`."""
    text = importlib.resources.files(__package__).joinpath('facts.yaml').read_text('utf-8')
    facts: dict[str, Any] = parse_yaml(text)
    loaded = facts['fig11_13']
    for name in ('nearest_order', 'lyapunov_ticks'):  # by speed in rad/s; keys of YAML are text
        loaded[name] = {int(speed): value for speed, value in loaded[name].items()}
    return facts


def diagrams(facts: Facts) -> dict[str, Diagram]:
    """Return every diagram that figures 5 to 19 are drawn from, by its key."""
    low, high = facts['fig5_6']['speeds_rad_s']
    made = [
        Diagram(
            key=f'speed_at_G{load}',
            over='speed_rad_s',
            limits=(max(low, SLOWEST_SPEED_RAD_S), high),
            load_factor=load,
            highest_order=HIGHEST_ORDER,
        )
        for load in facts['fig5_6']['load_factors']
    ]
    speeds = [row['speed_rad_s'] for row in facts['fig7_10']]
    made.append(
        Diagram(
            key='four_speeds',
            over='speed_rad_s',
            values=tuple(float(speed) for speed in speeds),
            load_factor=RESONANCE_LOAD_FACTOR,
            exponent=True,
            highest_order=_orders_at(min(speeds)),
            transient_ratio=SERIES_TRANSIENT,
            series=True,
        )
    )
    made += [
        Diagram(
            key=f'G_at_{speed}',
            over='load_factor',
            limits=LOAD_FACTORS,
            speed_rad_s=speed,
            exponent=True,
            highest_order=_orders_at(speed),
            continued=True,
        )
        for speed in facts['fig11_13']['lyapunov_ticks']
    ]
    made += _crack_diagrams(facts)
    made += _clearance_diagrams(facts['fig17_18'])
    row = facts['fig19']
    made.append(
        _held(
            row,
            key='eccentricity',
            over='eccentricity_m',
            limits=_micrometres(row['eccentricity_um']),
            changes={
                'crack_stiffness_ratio': row['K'],
                'clearance_m': row['clearance_um'] * MICROMETRE,
            },
            highest_order=_orders_at(row['speed_rad_s']),
        )
    )
    return {diagram.key: diagram for diagram in made}


def _crack_diagrams(facts: Facts) -> list[Diagram]:
    loaded, unloaded = facts['fig14_15'], facts['fig16']
    sections = sorted(loaded['quasi_periodic_K'] + loaded['chaotic_K'])
    return [
        _held(
            loaded,
            key='K',
            over='crack_stiffness_ratio',
            limits=tuple(loaded['K']),
            highest_order=_orders_at(loaded['speed_rad_s']),
        ),
        _held(loaded, key='K_sections', over='crack_stiffness_ratio', values=tuple(sections)),
        _held(
            unloaded, key='K_unloaded', over='crack_stiffness_ratio', limits=tuple(unloaded['K'])
        ),
    ]


def _clearance_diagrams(row: Facts) -> list[Diagram]:
    sections = sorted(row['quasi_periodic_um'] + row['chaotic_um'])
    changes = {'crack_stiffness_ratio': row['K']}
    return [
        _held(
            row,
            key='clearance',
            over='clearance_m',
            limits=_micrometres(row['clearance_um']),
            changes=changes,
            highest_order=_orders_at(row['speed_rad_s']),
        ),
        _held(
            row,
            key='clearance_sections',
            over='clearance_m',
            values=_micrometres(sections),
            changes=changes,
        ),
    ]


def _held(row: Facts, **how: Any) -> Diagram:
    """Return a diagram with an exponent at the speed and load factor of `row`."""
    return Diagram(
        speed_rad_s=row['speed_rad_s'], load_factor=row['load_factor'], exponent=True, **how
    )


def _orders_at(speed_rad_s: float) -> float:
    return min(HIGHEST_ORDER, HIGHEST_FREQUENCY_RAD_S / speed_rad_s)


def _micrometres(values: Iterable[float]) -> tuple[Any, ...]:
    return tuple(value * MICROMETRE for value in values)


def figures(facts: Facts) -> dict[int, Figure]:
    """Return figures 5 to 19 by number."""
    loads = facts['fig5_6']['load_factors']
    over_speed: tuple[tuple[int, str, PanelKind], ...] = (
        (5, 'Orbit diagrams of Z over speed', 'orbit_diagram'),
        (6, 'Spectra of Z over speed', 'waterfall'),
    )
    made = [
        Figure(
            number,
            f'{what}, with different load factors',
            tuple(Panel(f'G = {load}', kind, f'speed_at_G{load}') for load in loads),
        )
        for number, what, kind in over_speed
    ]
    made += [_motion(7 + index, index, row) for index, row in enumerate(facts['fig7_10'])]
    made += _load_figures(facts['fig11_13']['lyapunov_ticks'])
    crack, unloaded, clearance = facts['fig14_15'], facts['fig16'], facts['fig17_18']
    made += [
        _responses(14, 'K', 'the crack stiffness K', crack, mark_x=crack['chaotic_above_K']),
        _sections(15, 'K_sections', 'K', crack['quasi_periodic_K'] + crack['chaotic_K'], ''),
        Figure(
            16,
            f'Responses over K at {unloaded["speed_rad_s"]} rad/s without load',
            (
                Panel('Z', 'orbit_diagram', 'K_unloaded'),
                _exponents(unloaded['lyapunov_ticks'], 'K_unloaded'),
            ),
        ),
        _responses(
            17,
            'clearance',
            'the bearing clearance',
            clearance,
            mark_x=clearance['chaotic_above_um'] * MICROMETRE,
        ),
        _sections(
            18,
            'clearance_sections',
            'clearance',
            clearance['quasi_periodic_um'] + clearance['chaotic_um'],
            ' \N{GREEK SMALL LETTER MU}m',
        ),
        _responses(19, 'eccentricity', 'the eccentricity', facts['fig19']),
    ]
    return {figure.number: figure for figure in made}


def _motion(number: int, index: int, row: Facts) -> Figure:
    at: dict[str, Any] = {'diagram': 'four_speeds', 'index': index}
    return Figure(
        number,
        f'Motion at {row["speed_rad_s"]} rad/s, G = {RESONANCE_LOAD_FACTOR}',
        (
            Panel('Z over tau', 'series', ticks_y=tuple(row['z_ticks']), **at),
            Panel(
                'Phase portrait',
                'portrait',
                ticks_x=tuple(row['z_ticks']),
                ticks_y=tuple(row['y_ticks']),
                **at,
            ),
            Panel(
                'Poincaré section',
                'section',
                ticks_x=tuple(row['poincare_z_ticks']),
                ticks_y=tuple(row['poincare_y_ticks']),
                **at,
            ),
            Panel('Spectrum of Z', 'spectrum', **at),
        ),
    )


def _load_figures(ticks: Mapping[int, list[float]]) -> list[Figure]:
    def panels(kind: PanelKind) -> tuple[Panel, ...]:
        return tuple(Panel(f'{speed} rad/s', kind, f'G_at_{speed}') for speed in ticks)

    exponents = tuple(
        Panel(f'{speed} rad/s', 'exponents', f'G_at_{speed}', ticks_y=(pair[0], pair[1]))
        for speed, pair in ticks.items()
    )
    return [
        Figure(11, 'Orbit diagrams of Z over the load factor', panels('orbit_diagram')),
        Figure(12, 'Spectra of Z over the load factor', panels('waterfall')),
        Figure(13, 'Largest Lyapunov exponent over the load factor', exponents),
    ]


def _exponents(ticks: Iterable[float], key: str, mark_x: float | None = None) -> Panel:
    low, high = ticks
    return Panel('Largest Lyapunov exponent', 'exponents', key, ticks_y=(low, high), mark_x=mark_x)


def _responses(number: int, key: str, over: str, row: Facts, mark_x: float | None = None) -> Figure:
    """Return the four panels that Figs 14, 17 and 19 share."""
    return Figure(
        number,
        f'Responses over {over} at {row["speed_rad_s"]} rad/s, G = {row["load_factor"]}',
        (
            Panel('Z', 'orbit_diagram', key, mark_x=mark_x),
            _exponents(row['lyapunov_ticks'], key, mark_x),
            Panel('Spectra of Y', 'waterfall', key, 'y'),
            Panel('Spectra of Z', 'waterfall', key),
        ),
    )


def _sections(number: int, key: str, over: str, values: list[float], unit: str) -> Figure:
    return Figure(
        number,
        f'Poincaré sections (Z, Y) for different {over}',
        tuple(
            Panel(f'{over} = {value:g}{unit}', 'section', key, index=index)
            for index, value in enumerate(sorted(values))
        ),
        columns=4,
    )
