# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The one layout: what an engineer sees when the viewer opens."""

import rerun as rr
import rerun.blueprint as rrb

from vibration_monitor.view import style
from vibration_monitor.view.orbit import REVOLUTIONS
from vibration_monitor.view.spectrogram import COLUMNS, ROWS
from vibration_monitor.view.style import EXAGGERATION, TIMELINE

WAVEFORM_WINDOW_S = 0.1

LOAD_VIEW = 'Load factor n [1]'
ALARM_VIEW = 'Alarm'
RATIO_VIEW = 'Super-harmonic ratios of disk z [1]'
SPECTRUM_VIEW = 'Order spectrum of disk z [dB re 1 nm]'
SPECTROGRAM_VIEW = 'Spectrogram of disk z: order over flight time'
DISPLACEMENT_VIEW = f'Disk displacement [um], latest {WAVEFORM_WINDOW_S:g} s'
ACCELERATION_VIEW = 'Bearing 1 acceleration [m/s2]'
ORBIT_VIEW = f'Orbit of the disk [um], {REVOLUTIONS} revolutions'
LOG_VIEW = 'Alarms and losses'
SPEED_VIEW = 'Speed [rad/s]'
TRUTH_VIEW = 'Crack K (truth)'
RIG_VIEW = f'Rig, displacements x {EXAGGERATION:g}, crack side red'


def _whole_flight() -> rrb.TimeAxis:
    """Return the time axis that all views of the flight have: from 0 to the newest data.

    Linked axes would not do: rerun 0.41 then starts each view at its own first value.
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


def _flight_column() -> rrb.Vertical:
    return rrb.Vertical(
        _flight(LOAD_VIEW, (style.LOAD_SENSOR, style.LOAD)),
        rrb.StateTimelineView(
            name=ALARM_VIEW, origin=f'/{style.ALARM_LEVEL}', time_view=_whole_flight()
        ),
        _flight(RATIO_VIEW, (style.RATIOS,), legend=True),
        row_shares=[1.2, 0.5, 1.6],
    )


def _signal_column() -> rrb.Vertical:
    return rrb.Vertical(
        rrb.BarChartView(
            name=SPECTRUM_VIEW,
            origin=f'/{style.SPECTRUM}',
            plot_legend=rrb.PlotLegend(visible=False),
        ),
        rrb.Spatial2DView(
            name=SPECTROGRAM_VIEW,
            origin=f'/{style.SPECTROGRAM}',
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-32.0, COLUMNS + 14.0), y_range=(-4.0, ROWS + 22.0)
            ),
        ),
        _waveform(DISPLACEMENT_VIEW, style.DISPLACEMENT),
        row_shares=[1.15, 1.3, 1.0],
    )


def _rotor_column() -> rrb.Vertical:
    return rrb.Vertical(
        rrb.Spatial3DView(
            name=RIG_VIEW,
            origin=f'/{style.RIG}',
            line_grid=rrb.LineGrid3D(visible=False),
            eye_controls=rrb.EyeControls3D(
                position=(0.42, -0.22, -0.42), look_target=(0.0, -0.02, 0.0), eye_up=(0, -1, 0)
            ),
        ),
        rrb.Spatial2DView(name=ORBIT_VIEW, origin=f'/{style.ORBIT}'),
        row_shares=[1.0, 1.0],
    )


def _bottom_row() -> rrb.Horizontal:
    return rrb.Horizontal(
        rrb.TextLogView(
            name=LOG_VIEW,
            origin=f'/{style.LOG}',
            columns=rrb.TextLogColumns(
                timeline_columns=[TIMELINE], text_log_columns=['LogLevel', 'Body']
            ),
        ),
        _waveform(ACCELERATION_VIEW, style.ACCELERATION),
        _flight(SPEED_VIEW, (style.SPEED,)),
        _flight(TRUTH_VIEW, (style.CRACK_TRUTH,), limits=(0.0, 0.3)),
        column_shares=[1.6, 0.8, 0.5, 0.5],
    )


def blueprint() -> rrb.Blueprint:
    """Return the layout: flight on the left, signals in the middle, the rotor on the right."""
    columns = rrb.Horizontal(
        _flight_column(), _signal_column(), _rotor_column(), column_shares=[1.2, 1.2, 1.0]
    )
    return rrb.Blueprint(
        rrb.Vertical(columns, _bottom_row(), row_shares=[4.0, 1.05]),
        rrb.TopPanel(state='hidden'),
        rrb.BlueprintPanel(state='collapsed'),
        rrb.SelectionPanel(state='collapsed'),
        rrb.TimePanel(state='collapsed', timeline=TIMELINE, play_state='following'),
        auto_views=False,
        auto_layout=False,
    )
