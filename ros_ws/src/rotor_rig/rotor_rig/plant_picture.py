# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of a plant: the rotor from the side, above its Campbell diagram."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from rotor_sim.plant.campbell import Campbell
from rotor_sim.plant.element import GROUND, Element
from rotor_sim.plant.plant import Node, Plant

Array = NDArray[np.float64]

STEEL, EDGE, RED, BLUE, GREY = '#c9d1d9', '#24292f', '#d55e00', '#0072b2', '#8a8a8a'
_SPRINGS = ('shaft_segment', 'support')
_WHIRLS = LinearSegmentedColormap.from_list('whirls', [RED, '#555555', BLUE])


def plant_figure(plant: Plant, name: str, campbell: Campbell) -> Figure:
    """Return the picture of a plant, drawn to scale where it knows its sizes."""
    figure = Figure(figsize=(8.0, 8.6), layout='constrained')
    above, below = figure.subplots(2, 1, height_ratios=[1.0, 1.5])
    figure.suptitle(f'{name}: {plant.description}' if plant.description else name, wrap=True)
    _Side(plant, above).draw()
    _draw_campbell(below, campbell)
    return figure


class _Side:
    """Draws a rotor from the side, +y down as the load of level flight pulls."""

    def __init__(self, plant: Plant, axes: Any) -> None:
        self._plant, self._axes = plant, axes
        self._places = {name: node.position_m for name, node in plant.nodes.items()}
        span = np.ptp(list(self._places.values()))
        self._length = float(span) or 1.0
        """Of the machine, m; where all stands at one place, of the picture."""
        self._radii = dict.fromkeys(plant.nodes, 0.008 * self._length)
        for element in plant.elements:
            if diameter := getattr(element, 'outer_diameter_m', None):
                for end in _ends(element):
                    self._radii[end] = 0.5 * diameter
        self._thin = min(self._radii.values())
        self._written: dict[tuple[int, int], int] = {}

    def draw(self) -> None:
        drawn: Mapping[str, Callable[[str, Element], None]] = {
            'beam': self._beam,
            **dict.fromkeys(_SPRINGS, self._segment),
            'ball_bearing': self._bearing,
            'unbalance': self._unbalance,
        }
        self._axes.axhline(0.0, color=GREY, linewidth=0.6, linestyle=(0, (8, 3, 2, 3)), zorder=0)
        for name, node in self._plant.nodes.items():
            self._disk(name, node)
        # springs first: what is written under them goes further down
        for name, element in sorted(
            self._plant.named_elements(), key=lambda item: item[1].kind not in _SPRINGS
        ):
            is_crack = 'crack' in element.kind
            draw = self._crack if is_crack else drawn.get(element.kind, self._other)
            draw(name, element)
        self._axes.set_aspect('equal', adjustable='datalim')
        self._axes.margins(0.06, 0.08)
        self._axes.invert_yaxis()
        self._axes.set_xlabel('x [m]')
        self._axes.set_yticks([])
        for side in ('left', 'right', 'top'):
            self._axes.spines[side].set_visible(False)

    def _box(self, x: float, y: float, width: float, height: float, **style: Any) -> None:
        """Draw a rectangle about its middle."""
        shape: dict[str, Any] = {'facecolor': STEEL, 'edgecolor': EDGE, 'linewidth': 0.8} | style
        corner = (x - 0.5 * width, y - 0.5 * height)
        self._axes.add_patch(Rectangle(corner, width, height, **shape))

    def _text(self, x: float, text: str, *, below: bool = False) -> None:
        """Write over or under the rotor, one line further out where others stand already."""
        column = (round(8.0 * x / self._length), int(below))
        line = self._written.get(column, 0)
        self._written[column] = line + 1
        far = (
            max([*self._radii.values(), 0.1 * self._length]) + (0.05 + 0.045 * line) * self._length
        )
        y = far if below else -far
        self._axes.text(x, y, text, ha='center', va='center', fontsize=8, color=EDGE)
        self._axes.update_datalim([(x, 1.15 * y)])

    def _disk(self, name: str, node: Node) -> None:
        if node.mass_kg == 0.0 or self._is_in_a_bearing(name):
            return
        heaviest = max(each.mass_kg for each in self._plant.nodes.values())
        radius = 0.12 * self._length * (node.mass_kg / heaviest) ** (1.0 / 3.0)
        width = 0.3 * radius
        if node.polar_inertia_kg_m2 > 0.0:  # a full disk of this inertia
            radius = math.sqrt(2.0 * node.polar_inertia_kg_m2 / node.mass_kg)
            square = 12.0 * node.diametral_inertia_kg_m2 / node.mass_kg - 3.0 * radius**2
            width = math.sqrt(square) if square > 0.0 else 0.1 * radius
        self._radii[name] = radius
        self._box(self._places[name], 0.0, width, 2.0 * radius, zorder=3)
        self._text(self._places[name], f'{name}, {node.mass_kg:g} kg')

    def _is_in_a_bearing(self, name: str) -> bool:
        return any(
            hasattr(each, 'ball_count') and name in _ends(each) for each in self._plant.elements
        )

    def _is_housing(self, name: str) -> bool:
        return any(getattr(element, 'housing', None) == name for element in self._plant.elements)

    def _beam(self, _: str, element: Element) -> None:
        a, b = (self._places[end] for end in _ends(element))
        for key, style in (('outer_diameter_m', {}), ('inner_diameter_m', {'linestyle': ':'})):
            if diameter := getattr(element, key):
                self._box(0.5 * (a + b), 0.0, b - a, diameter, zorder=2, **style)

    def _segment(self, name: str, element: Element) -> None:
        ends = [end for end in _ends(element) if end != GROUND]
        if len(ends) < 2:
            self._spring(name, ends[0])
            return
        places = [self._places[end] for end in ends]
        self._axes.plot(places, [0.0] * len(places), color=EDGE, linewidth=2.5, zorder=2)

    def _spring(self, name: str, node: str) -> None:
        """Draw a spring between a node and the ground below it."""
        start = self._seat() if self._is_housing(node) else self._radii[node]
        length, width = 0.08 * self._length, 0.012 * self._length
        x = self._places[node]
        zigzag = np.array([0.0, 0.0, *([1.0, -1.0] * 3), 0.0, 0.0]) * width
        y = start + length * np.array([0.0, 0.15, *np.linspace(0.22, 0.78, 6), 0.85, 1.0])
        self._axes.plot(x + zigzag, y, color=EDGE, linewidth=1.0)
        ground = start + length
        if not self._is_housing(node):
            self._written[round(8.0 * x / self._length), 1] = 4
        self._axes.plot([x - 3 * width, x + 3 * width], [ground] * 2, color=EDGE, linewidth=1.0)
        for k in range(-3, 3):
            line = [x + k * width, x + (k - 0.7) * width + width]
            self._axes.plot(line, [ground + width, ground], color=EDGE, linewidth=0.6)
        self._axes.text(
            x, ground + 2.5 * width, name, ha='center', va='top', fontsize=7, color=GREY
        )

    def _seat(self) -> float:
        """Return how far a bearing reaches from the axis."""
        shaft = [getattr(each, 'outer_diameter_m', 0.0) for each in self._plant.elements]
        return 0.5 * max(shaft, default=0.0) + 0.055 * self._length

    def _bearing(self, name: str, element: Element) -> None:
        node, housing = _ends(element)
        x, shaft = self._places[node], self._radii[node]
        outer = self._seat()
        height = outer - shaft
        for sign in (-1.0, 1.0):
            middle = sign * (shaft + 0.5 * height)
            self._box(x, middle, 0.8 * height, height, facecolor='white', zorder=3)
            ball = Circle((x, middle), 0.28 * height, facecolor=STEEL, edgecolor=EDGE, zorder=4)
            self._axes.add_patch(ball)
        for end in (node, housing):
            if end != GROUND and (mass := self._plant.nodes[end].mass_kg):
                self._text(x, f'{end}, {mass:g} kg')
        self._text(x, name)

    def _unbalance(self, name: str, element: Element) -> None:
        (node,) = _ends(element)
        y = 0.9 * self._radii[node]
        self._axes.plot(self._places[node], y, 'o', color=RED, markersize=5, zorder=6)
        self._text(self._places[node], name, below=True)

    def _crack(self, name: str, element: Element) -> None:
        x = self._place_of(element)
        reach = max(1.6 * self._thin, 0.025 * self._length)
        jag = 0.006 * self._length * np.array([0.0, 1.0, -1.0, 1.0, 0.0])
        self._axes.plot(
            x + jag, reach * np.linspace(-1.0, 1.0, 5), color=RED, linewidth=2, zorder=7
        )
        self._text(x, name, below=True)

    def _other(self, name: str, element: Element) -> None:
        x = self._place_of(element)
        self._axes.plot(x, 0.0, 'D', color=BLUE, markersize=6, zorder=7)
        self._text(x, f'{name} ({element.kind})', below=True)

    def _place_of(self, element: Element) -> float:
        """Return where an element is: its own position, a quarter of the way along its nodes."""
        own = getattr(element, 'position_m', None)
        if own is not None:
            return float(own)
        places = [self._places[end] for end in _ends(element) if end != GROUND]
        return places[0] + 0.25 * (places[1] - places[0]) if len(places) > 1 else places[0]


def _ends(element: Element) -> list[str]:
    return [getattr(element, key) for key, _ in element.touches]


def _draw_campbell(axes: Any, campbell: Campbell) -> None:
    """Draw natural frequencies over speed, the colour by whirl, with what passes 1x marked."""
    speeds = campbell.speeds_rad_s
    hertz = campbell.frequencies_rad_s / (2.0 * np.pi)
    top = 2.2 * speeds[-1] / (2.0 * np.pi)
    for order in (1, 2, 3):
        line = order * speeds / (2.0 * np.pi)
        axes.plot(speeds, line, color=GREY, linewidth=0.8, linestyle='--', zorder=1)
        end = min(float(line[-1]), 0.94 * top)
        axes.text(end * 2.0 * np.pi / order, end, f' {order}x', color=GREY, ha='right', va='bottom')
    lines = None
    for number in range(hertz.shape[1]):
        points = np.column_stack([speeds, hertz[:, number]])
        pieces = np.stack([points[:-1], points[1:]], axis=1)
        colours = 0.5 * (campbell.whirls[:-1, number] + campbell.whirls[1:, number])
        there = np.isfinite(pieces).all(axis=(1, 2))
        lines = LineCollection(
            list(pieces[there]), array=colours[there], cmap=_WHIRLS, clim=(-1.0, 1.0), linewidth=2
        )
        axes.add_collection(lines)
    for each in campbell.critical_speeds:
        y = each.speed_rad_s / (2.0 * np.pi)
        axes.plot(each.speed_rad_s, y, 'o', mfc='none', mec=EDGE, markersize=8, zorder=5)
    axes.set_xlim(0.0, speeds[-1])
    axes.set_ylim(0.0, top)
    axes.set_xlabel('speed [rad/s]')
    axes.set_ylabel('natural frequency [Hz]')
    per_minute = 30.0 / np.pi
    upper = axes.secondary_xaxis(
        'top', functions=(lambda x: x * per_minute, lambda x: x / per_minute)
    )
    upper.set_xlabel('speed [rpm]')
    if lines is not None:
        bar = axes.figure.colorbar(lines, ax=axes, ticks=[-1.0, 0.0, 1.0], shrink=0.6)
        bar.ax.set_yticklabels(['backward', 'straight', 'forward'])
