# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of an evaluation, from the plain data of its report."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rotor_bench.evaluation.report import columns_of
from rotor_bench.evaluation.summary import GOAL_CRACK, GOAL_GROWTH

COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#000000')
HEALTHY, CRACKED = '#8a8a8a', '#d55e00'
LEVELS = ('own alarm', '0 false alarms per hour')
MARKERS = ('o', '^')

Content = Mapping[str, Any]


def save_pictures(content: Content, folder: Path) -> list[str]:
    """Write every picture as PNG into `folder`; return their names."""
    made = {
        'roc.png': roc(content),
        'auc_by_crack.png': auc_by_crack(content),
        'scores.png': scores(content),
        'growth.png': growth(content),
        'false_alarms.png': false_alarms(content),
    }
    for name, figure in made.items():
        canvas: Any = FigureCanvasAgg(figure)
        canvas.print_png(str(folder / name))
    return list(made)


def _figure(width: float, height: float, columns: int = 1) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width, height), dpi=110, layout='constrained')
    return figure, figure.subplots(1, columns, squeeze=False, sharey='row')[0]


def _colours(content: Content) -> dict[str, str]:
    return {name: COLOURS[index % len(COLOURS)] for index, name in enumerate(content['detectors'])}


def roc(content: Content) -> Figure:
    """Draw the ROC of each detector: K of the goal and above, the load factor varies."""
    figure, (axes,) = _figure(5.5, 5.0)
    axes.plot([0, 1], [0, 1], color=HEALTHY, linewidth=0.8, linestyle=':', label='chance')
    for name, colour in _colours(content).items():
        numbers = content['detectors'][name]
        area = numbers['auc']['goal']['value']
        axes.plot(
            numbers['roc']['false_positive_rate'],
            numbers['roc']['true_positive_rate'],
            color=colour,
            drawstyle='steps-post',
            label=f'{name}, AUC {_number(area)}',
        )
    axes.set(
        xlabel='healthy flights with alarm',
        ylabel=f'cracked flights found, K $\\geq$ {GOAL_CRACK:g}',
        xlim=(-0.01, 1.0),
        ylim=(0.0, 1.01),
    )
    axes.legend(loc='lower right', fontsize='small')
    return figure


def auc_by_crack(content: Content) -> Figure:
    """Draw the area under the curve over the depth of the crack, with intervals."""
    figure, (axes,) = _figure(6.0, 4.0)
    axes.axhline(0.5, color=HEALTHY, linewidth=0.8, linestyle=':')
    for shift, (name, colour) in enumerate(_colours(content).items()):
        by_depth = content['detectors'][name]['auc_by']['crack_stiffness_ratio']
        points = [(float(k), area) for k, area in by_depth.items() if _has(area['low'])]
        value = np.array([area['value'] for _, area in points])
        below = value - [area['low'] for _, area in points]
        above = [area['high'] for _, area in points] - value
        depth = np.array([k for k, _ in points]) * 1.02**shift  # beside one another
        axes.errorbar(
            depth, value, np.maximum([below, above], 0.0), color=colour, marker='o', label=name,
            markersize=4, capsize=3, linewidth=1,
        )  # fmt: skip
    axes.set(xscale='log', xlabel='crack stiffness ratio K', ylabel='AUC', ylim=(0.0, 1.02))
    depths = sorted(map(float, columns_of(content['detectors'], 'crack_stiffness_ratio')))
    axes.set_xticks(depths, [f'{depth:g}' for depth in depths], minor=False)
    axes.set_xticks([], minor=True)
    axes.legend(fontsize='small', loc='lower right')
    return figure


def scores(content: Content) -> Figure:
    """Draw the score of every flight by maneuver, in multiples of the detector's alarm."""
    flights = [f for f in content['flights'] if f['labels']['crack'] != 'growing']
    maneuvers = sorted({flight['labels']['maneuver'] for flight in flights})
    detectors = content['detectors']
    height = 0.45 * len(maneuvers) + 1.6
    figure, columns = _figure(4.0 * len(detectors) + 1.0, height, len(detectors))
    jitter = np.random.default_rng(0)
    for axes, (name, numbers) in zip(columns, detectors.items(), strict=True):
        alarm = numbers['alarm_score']
        for offset, is_cracked, colour in ((0.18, False, HEALTHY), (-0.18, True, CRACKED)):
            points = [
                (
                    flight['outcomes'][name]['score'] - alarm,
                    maneuvers.index(flight['labels']['maneuver']),
                )
                for flight in flights
                if (flight['labels']['crack'] == 'constant') == is_cracked
                and _has(flight['outcomes'][name]['score'])
            ]
            x, row = np.array(points).T if points else np.zeros((2, 0))
            y = row + offset + jitter.uniform(-0.13, 0.13, len(row))
            axes.plot(x, y, '.', color=colour, markersize=3,
                      label='cracked' if is_cracked else 'healthy')  # fmt: skip
        axes.axvline(0.0, color='black', linewidth=0.8)
        # a power of ten: the labels about zero then keep apart
        axes.set_xscale('symlog', linthresh=10.0 ** round(math.log10(abs(alarm) or 1.0)))
        if numbers['failed']:
            words = f'failed on {numbers["failed"]} flights'
            axes.text(0.5, 1.0, words, transform=axes.transAxes, ha='center', va='top')
        axes.set(title=name, xlabel='score less the score of the alarm')
        axes.set_yticks(range(len(maneuvers)), maneuvers)
    keys, names = columns[0].get_legend_handles_labels()
    figure.legend(keys, names, loc='outside upper right', ncols=2, fontsize='small', markerscale=3)
    return figure


def growth(content: Content) -> Figure:
    """Draw how deep growing cracks were when each detector found them."""
    detectors = content['detectors']
    figure, (axes,) = _figure(6.5, 0.9 * len(detectors) + 1.4)
    axes.axvline(GOAL_GROWTH, color='black', linewidth=0.8, linestyle='--')
    growing = [f for f in content['flights'] if f['labels']['crack'] == 'growing']
    ends = [f['labels']['crack_stiffness_ratio'] for f in growing]
    deepest = 1.02 * max([GOAL_GROWTH, *ends])
    for row, (name, colour) in enumerate(_colours(content).items()):
        for offset, level, marker in zip((0.15, -0.15), LEVELS, MARKERS, strict=True):
            each = [depth for _, depth in detectors[name]['growth'][level]['each']]
            found = [depth for depth in each if _has(depth)]
            axes.plot(found, np.full(len(found), row + offset), marker, color=colour,
                      markersize=5, alpha=0.6, linestyle='none')  # fmt: skip
            text = f'{len(found)} of {len(each)} found' if each else '-'
            place = axes.get_yaxis_transform()
            axes.text(1.01, row + offset, text, transform=place, va='center', fontsize='small')
    for level, marker in zip(LEVELS, MARKERS, strict=True):
        axes.plot([], [], marker, color='black', linestyle='none', label=f'threshold: {level}')
    axes.set_yticks(range(len(detectors)), list(detectors))
    axes.set(xlabel='K when first found', xlim=(0.0, deepest), ylim=(-0.6, len(detectors) - 0.4))
    figure.legend(loc='outside upper center', ncols=2, fontsize='small')
    return figure


def false_alarms(content: Content) -> Figure:
    """Draw false alarms per hour by maneuver, with the 95 % upper bound."""
    detectors = content['detectors']
    maneuvers = sorted(
        {m for numbers in detectors.values() for m in numbers['false_alarms_by']['maneuver']}
    )
    figure, (axes,) = _figure(6.5, 0.5 * len(maneuvers) + 1.4)
    for index, (name, colour) in enumerate(_colours(content).items()):
        rates = detectors[name]['false_alarms_by']['maneuver']
        for row, maneuver in enumerate(maneuvers):
            rate = rates.get(maneuver)
            if rate is None or not _has(rate['per_hour']):
                continue
            y = row + 0.2 * (index - (len(detectors) - 1) / 2)
            axes.plot(
                [rate['per_hour'], rate['upper_per_hour']], [y, y], color=colour, linewidth=1.2
            )
            axes.plot(rate['per_hour'], y, 'o', color=colour, markersize=4)
        axes.plot([], [], 'o-', color=colour, markersize=4, label=name)
    axes.set_yticks(range(len(maneuvers)), maneuvers)
    axes.set_xscale('symlog', linthresh=0.1)
    axes.set(xlabel='false alarms per flight hour (dot) and 95 % upper bound', xlim=(-0.01, None))
    figure.legend(loc='outside upper center', ncols=4, fontsize='small')
    return figure


def _has(value: float | None) -> bool:
    return value is not None and math.isfinite(value)


def _number(value: float | None) -> str:
    return f'{value:.3f}' if value is not None and _has(value) else '-'
