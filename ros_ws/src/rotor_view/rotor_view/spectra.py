# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The latest order spectrum as bars, and the whole flight as a spectrogram."""

import io

import numpy as np
import rerun as rr
from PIL import Image

from rotor_interfaces.channels import shown_channel
from rotor_interfaces.waveform import WaveformBlock
from rotor_view import style
from rotor_view.spectrogram import COLUMNS, MAX_ORDER, NANOMETRE, ROWS, Spectrogram, decibels
from rotor_view.units import Units

SPECTROGRAM_EVERY_S = 1.0


class Spectra:
    """Draws the spectra of the shown channel; set the time of the stream before each call.

    `is_thin`: only the latest ones, at the end.
    """

    def __init__(self, stream: rr.RecordingStream, *, is_thin: bool = False) -> None:
        self.channel = ''
        """Channel whose spectra are drawn: chosen from the first table, '' before it."""
        self.drawn: set[str] = set()
        """Entities that have something to show."""
        self._stream = stream
        self._is_thin = is_thin
        self._latest: rr.BarChart | rr.Clear | None = None
        self.units = Units()
        self._reference = NANOMETRE
        self._spectrogram = Spectrogram()
        self._due_s = 0.0
        self._labelled_span_s = 0.0

    def draw(self, time_s: float, table: WaveformBlock) -> None:
        """Draw a table with `order` and amplitudes (SI, zero to peak); nothing where it is NaN."""
        if not self.channel:
            self.channel = shown_channel(table.columns)
            self._reference = self.units.reference(self.channel)[0]
            self._spectrogram = Spectrogram(self._reference)
        if not {'order', self.channel} <= set(table.columns):
            return
        known = np.isfinite(table.rows[self.channel])
        rows = table.rows[known & (table.rows['order'] < MAX_ORDER)]
        orders = rows['order'].astype(np.float64)
        if len(orders) < 2:
            self._show(rr.Clear(recursive=False))
            return
        self._show(
            rr.BarChart(
                decibels(rows[self.channel], self._reference).astype(np.float32),
                abscissa=orders,
                widths=np.gradient(orders).astype(np.float32),
                color=style.SPECTRUM_COLOUR,
            )
        )
        self.drawn |= {style.SPECTRUM, style.SPECTROGRAM}
        self._spectrogram.add(time_s, orders, rows[self.channel])
        if time_s >= self._due_s and not self._is_thin:
            self._due_s = time_s + SPECTROGRAM_EVERY_S
            self.send_spectrogram()

    def _show(self, spectrum: rr.BarChart | rr.Clear) -> None:
        if self._is_thin:
            self._latest = spectrum
        else:
            self._stream.log(style.SPECTRUM, spectrum)

    def finish(self) -> None:
        """Send what is still held, and the whole spectrogram."""
        if self._latest is not None:
            self._stream.log(style.SPECTRUM, self._latest)
        self.send_spectrogram()

    def send_spectrogram(self) -> None:
        """Send the current picture; `draw` does so at most once a second of flight."""
        if self._spectrogram.is_empty:
            return
        file = io.BytesIO()
        Image.fromarray(self._spectrogram.picture()).save(file, 'png')
        self._stream.log(
            f'{style.SPECTROGRAM}/picture',
            rr.EncodedImage(contents=file.getvalue(), media_type='image/png'),
        )
        if self._spectrogram.span_s != self._labelled_span_s:
            self._labelled_span_s = self._spectrogram.span_s
            self._label(self._labelled_span_s)

    def _label(self, span_s: float) -> None:
        """Write time below the picture and orders to its left, in pixels of the picture."""
        ticks = [[COLUMNS * k / 4, ROWS - 2.0] for k in range(5)]
        labels = [f'{span_s * k / 4:g} s' for k in range(5)]
        for order in range(1, int(MAX_ORDER)):
            ticks.append([-14.0, ROWS * (1 - order / MAX_ORDER) - 12.0])
            labels.append(f'{order}x')
        self._stream.log(
            f'{style.SPECTROGRAM}/axes',
            rr.Points2D(
                ticks,
                labels=labels,
                colors=style.GREY,
                radii=rr.Radius.ui_points(0.0),
                show_labels=True,
            ),
        )
