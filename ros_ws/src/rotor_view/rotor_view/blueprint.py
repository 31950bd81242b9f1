# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The layout of the viewer. A view is shown only if it has data."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import rerun as rr
import rerun.blueprint as rrb

from rotor_view import indicators, style
from rotor_view.orbit import REVOLUTIONS
from rotor_view.spectrogram import COLUMNS, ROWS
from rotor_view.style import EXAGGERATION, TIMELINE
from rotor_view.units import Units

WAVEFORM_WINDOW_S = 0.1

LOAD_VIEW = 'Load factor n [1]'
ALARM_VIEW = 'Alarm'
SENTENCE_VIEW = 'Alarm: latest sentence'
LOG_VIEW = 'Alarms and losses'
SPEED_VIEW = 'Speed [rad/s]'
TRUTH_VIEW = 'Crack K (truth)'
RIG_VIEW = f'Rig, displacements x {EXAGGERATION:g}, crack side red'

_CROWD = 3
"""With this many rules of the alarm there is no room for curves that it does not judge."""

_TRUTH_RANGE = (0.0, 0.5)
_Part = tuple[rrb.View | rrb.Container, float]
"""A view or a group of views, and its share of the row or column."""


@dataclass(frozen=True)
class Page:
    """Contents of the page.

    Args:
        drawn: entities with at least one number, picture or body.
        channel: whose spectra, ratios and amplitudes are shown.
        plane: whose orbit is shown.
        waveforms: entities of the waveform with their channels.
        rules: indicators that the alarm judges, in the order of its rules.
        units: units of the channels.

    """

    drawn: frozenset[str] = frozenset()
    channel: str = ''
    plane: str = ''
    waveforms: tuple[tuple[str, tuple[str, ...]], ...] = ()
    rules: tuple[str, ...] = ()
    units: Units = field(default_factory=Units)

    def has(self, *paths: str) -> bool:
        """Say whether any of these entities has something to show."""
        return not self.drawn.isdisjoint(paths)


def rule_view(page: Page, indicator: str) -> str:
    """Return the name of the view of a rule of the alarm."""
    return f'{indicator} [{page.units.of_indicator(indicator)[0]}], judged by the alarm'


def ratio_view(page: Page) -> str:
    """Return the name of the view of the super-harmonic ratios; it says if no rule judges them."""
    ratios = any(rule.startswith(f'{page.channel}/ratio_') for rule in page.rules)
    judged = '' if ratios else ', not judged'
    return f'Super-harmonic ratios of {style.channel_name(page.channel)} [1]{judged}'


def amplitude_view(page: Page) -> str:
    """Return the name of the view of the amplitudes at the first orders."""
    unit = page.units.of_channel(page.channel)[0]
    return f'Amplitudes of {style.channel_name(page.channel)} [{unit}]'


def spectrum_view(page: Page) -> str:
    """Return the name of the view of the latest spectrum."""
    name = style.channel_name(page.channel)
    return f'Order spectrum of {name} [{page.units.decibels(page.channel)}]'


def spectrogram_view(page: Page) -> str:
    """Return the name of the view of all spectra."""
    return f'Spectrogram of {style.channel_name(page.channel)}: order over flight time'


def waveform_view(page: Page, path: str, *, latest: bool = True) -> str:
    """Return the name of the view of a part of the waveform."""
    channels = dict(page.waveforms)[path]
    what = ', '.join(style.channel_name(channel) for channel in channels)
    if path == style.DISPLACEMENT:
        what = 'Disk displacement'
    elif path == style.ACCELERATION:
        what = 'Bearing 1 acceleration'
    when = f', latest {WAVEFORM_WINDOW_S:g} s' if latest else ''
    return f'{what} [{page.units.of_channel(channels[0])[0]}]{when}'


def orbit_view(page: Page) -> str:
    """Return the name of the view of the orbit."""
    unit = page.units.of_channel(f'{page.plane}_y')[0]
    return f'Orbit of {page.plane} [{unit}], {REVOLUTIONS} revolutions'


def _whole_flight() -> rrb.TimeAxis:
    """Return the time axis that all views of the flight have: from 0 to the newest data.

    Linked axes are no alternative: rerun 0.41 then starts each view at its own first value.
    """
    return rrb.TimeAxis(
        view_range=rr.TimeRange(
            start=rrb.TimeRangeBoundary.absolute(seconds=0.0),
            end=rrb.TimeRangeBoundary.infinite(),
        ),
    )


def _flight(
    name: str,
    paths: tuple[str, ...],
    *,
    legend: bool = False,
    limits: tuple[float, float] | None = None,
) -> rrb.TimeSeriesView:
    """Return curves over the whole flight."""
    return rrb.TimeSeriesView(
        name=name,
        origin='/',
        contents=[f'+ /{path}' for path in paths],
        axis_x=_whole_flight(),
        axis_y=rrb.ScalarAxis(range=limits) if limits else None,
        plot_legend=rrb.PlotLegend('LeftTop', visible=legend),
    )


def _waveform(name: str, path: str) -> rrb.TimeSeriesView:
    """Return the latest 0.1 s of a waveform, every sample at its true time."""
    return rrb.TimeSeriesView(
        name=name,
        origin=f'/{path}',
        plot_legend=rrb.PlotLegend('LeftTop'),
        time_ranges=rrb.VisibleTimeRange(
            TIMELINE,
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-WAVEFORM_WINDOW_S),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        ),
    )


def _latest(page: Page) -> list[str]:
    """Return the waveforms whose latest samples are shown: two for the rig, else all."""
    paths = [path for path, _ in page.waveforms if page.has(path)]
    main = [path for path in (style.DISPLACEMENT, style.ACCELERATION) if path in paths]
    return main if page.has(style.RIG) and main else paths


def _flight_column(page: Page) -> list[_Part]:
    """Return the views over the whole flight: load or waveform, alarm, judged indicators."""
    parts: list[_Part] = []
    if page.has(style.LOAD, style.LOAD_SENSOR):
        parts.append((_flight(LOAD_VIEW, (style.LOAD_SENSOR, style.LOAD)), 1.1))
    elif not page.has(style.RIG):
        for path in _latest(page)[:1]:
            name = waveform_view(page, path, latest=False)
            parts.append((_flight(name, (path,), legend=True), 1.1))
    judged = [rule for rule in page.rules if page.has(indicators.value_path(rule))]
    if judged:
        views = [
            _flight(
                rule_view(page, rule),
                (indicators.limits_path(rule), indicators.value_path(rule)),
                legend=True,
            )
            for rule in judged
        ]
        columns = 1 if len(views) <= _CROWD else 2
        parts.append((rrb.Grid(*views, grid_columns=columns), 1.2 * -(-len(views) // columns)))
    if page.has(style.ratios(page.channel)) and len(judged) < _CROWD:
        parts.append((_flight(ratio_view(page), (style.ratios(page.channel),), legend=True), 1.0))
    if page.has(style.amplitudes(page.channel)) and not page.has(style.RIG):
        curves = (style.amplitudes(page.channel),)
        parts.append((_flight(amplitude_view(page), curves, legend=True), 1.0))
    if page.has(style.ALARM_LEVEL):
        lane = rrb.StateTimelineView(
            name=ALARM_VIEW, origin=f'/{style.ALARM_LEVEL}', time_view=_whole_flight()
        )
        sentence = rrb.TextDocumentView(name=SENTENCE_VIEW, origin=f'/{style.ALARM_SENTENCE}')
        curve_shares = sum(share for _, share in parts) or 1.0
        # a lane and a sentence need the same height whatever other views there are
        parts[1:1] = [(lane, 0.2 * curve_shares), (sentence, 0.15 * curve_shares)]
    return parts


def _signal_column(page: Page) -> list[_Part]:
    parts: list[_Part] = []
    if page.has(style.SPECTRUM):
        spectrum = rrb.BarChartView(
            name=spectrum_view(page),
            origin=f'/{style.SPECTRUM}',
            plot_legend=rrb.PlotLegend(visible=False),
        )
        picture = rrb.Spatial2DView(
            name=spectrogram_view(page),
            origin=f'/{style.SPECTROGRAM}',
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-32.0, COLUMNS + 14.0), y_range=(-4.0, ROWS + 22.0)
            ),
        )
        parts += [(spectrum, 1.15), (picture, 1.3)]
    waveforms = _latest(page)
    if page.has(style.RIG):
        waveforms = waveforms[:1]
    return parts + [(_waveform(waveform_view(page, path), path), 1.0) for path in waveforms]


def _rotor_column(page: Page) -> list[_Part]:
    parts: list[_Part] = []
    if page.has(style.RIG):
        rig = rrb.Spatial3DView(
            name=RIG_VIEW,
            origin=f'/{style.RIG}',
            line_grid=rrb.LineGrid3D(visible=False),
            eye_controls=rrb.EyeControls3D(
                position=(0.42, -0.22, -0.42), look_target=(0.0, -0.02, 0.0), eye_up=(0, -1, 0)
            ),
        )
        parts.append((rig, 1.0))
    if page.has(style.ORBIT):
        orbit = rrb.Spatial2DView(name=orbit_view(page), origin=f'/{style.ORBIT}')
        parts.append((orbit, 1.0))
    return parts


def _bottom_row(page: Page) -> list[_Part]:
    parts: list[_Part] = []
    if page.has(style.LOG):
        log = rrb.TextLogView(
            name=LOG_VIEW,
            origin=f'/{style.LOG}',
            columns=rrb.TextLogColumns(
                timeline_columns=[TIMELINE], text_log_columns=['LogLevel', 'Body']
            ),
        )
        parts.append((log, 1.6))
    if page.has(style.RIG):
        parts += [(_waveform(waveform_view(page, path), path), 0.8) for path in _latest(page)[1:]]
    speeds = [path for path in (style.SPEED, style.WINDOW_SPEED) if page.has(path)]
    parts += [(_flight(SPEED_VIEW, (path,)), 0.5) for path in speeds[:1]]
    if page.has(style.CRACK_TRUTH):
        truth = _flight(TRUTH_VIEW, (style.CRACK_TRUTH,), limits=_TRUTH_RANGE)
        parts.append((truth, 0.5))
    return parts


def _vertical(parts: Sequence[_Part]) -> rrb.Vertical:
    return rrb.Vertical(*(view for view, _ in parts), row_shares=[share for _, share in parts])


def _horizontal(parts: Sequence[_Part]) -> rrb.Horizontal:
    views, shares = [view for view, _ in parts], [share for _, share in parts]
    return rrb.Horizontal(*views, column_shares=shares)


def blueprint(page: Page) -> rrb.Blueprint:
    """Return the layout: flight on the left, signals in the middle, the rotor on the right."""
    columns = ((_flight_column(page), 1.2), (_signal_column(page), 1.2), (_rotor_column(page), 1.0))
    upper = [(_vertical(parts), share) for parts, share in columns if parts]
    lower = _bottom_row(page)
    rows: list[_Part] = [(_horizontal(upper), 4.0)] if upper else []
    rows += [(_horizontal(lower), 1.05)] if lower else []
    return rrb.Blueprint(
        _vertical(rows),
        rrb.TopPanel(state='hidden'),
        rrb.BlueprintPanel(state='collapsed'),
        rrb.SelectionPanel(state='collapsed'),
        rrb.TimePanel(state='collapsed', timeline=TIMELINE, play_state='following'),
        auto_views=False,
        auto_layout=False,
    )
