# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Screenshots without a display."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from rerun.experimental import ViewerClient

from rotor_view import viewer

Pictures = TypeVar('Pictures')

SIZE = (1600, 1000)
"""Pixels of the whole page."""

DRAWN_S = 120.0
"""A page that has not come to rest by then has failed; a quiet machine needs about 5 s."""

VIEWERS = 3
"""Number of viewers that are tried if each ends by itself: with the software renderer one has
crashed, and the next did not."""

_NO_ANSWER = (RuntimeError, OSError)
"""What rerun raises when its viewer does not answer within 15 s."""

_PAUSE_S = 0.2
_EQUAL_PICTURES = 3


def whole_page(recording: Path, warn: Callable[[str], None]) -> bytes:
    """Return the page of a recording (.rrd) as PNG, drawn without a screen.

    Args:
        recording: the rerun file.
        warn: told a sentence for every viewer that ended by itself and was started again.

    Raises:
        ViewError: no software renderer, no viewer, or a page that never comes to rest.

    """
    return _draw(recording, warn, _rested_page)


def single_views(recording: Path, warn: Callable[[str], None]) -> dict[str, bytes]:
    """Return each view of a recording alone as PNG, by its name; otherwise as `whole_page`."""
    return _draw(recording, warn, _views_of_rested_page)


def _draw(
    recording: Path,
    warn: Callable[[str], None],
    draw: Callable[[viewer.Viewer, ViewerClient], Pictures],
) -> Pictures:
    """Return what `draw` gets from a viewer; one that ends by itself is started again."""
    for _ in range(VIEWERS - 1):
        try:
            return _draw_once(recording, draw)
        except viewer.ViewerEndedError as error:
            warn(f'{error}; it was started again')
    try:
        return _draw_once(recording, draw)
    except viewer.ViewerEndedError as error:
        raise viewer.ViewError(f'{error}; so did {VIEWERS - 1} viewers before it') from error


def _draw_once(
    recording: Path, draw: Callable[[viewer.Viewer, ViewerClient], Pictures]
) -> Pictures:
    with viewer.headless([str(recording)], SIZE) as drawing:
        try:
            return draw(drawing, ViewerClient.connect(drawing.url))
        except _NO_ANSWER:
            raise drawing.failure('gave no picture') from None


def _rested_page(drawing: viewer.Viewer, client: ViewerClient) -> bytes:
    """Return the page once everything is loaded and equal pictures follow each other."""
    deadline = time.monotonic() + DRAWN_S
    equal, last = 0, b''
    while time.monotonic() < deadline and drawing.is_running():
        try:
            state = client.get_state()
            picture = bytes(client.take_screenshot())
        except _NO_ANSWER:
            time.sleep(_PAUSE_S)  # a viewer that is crashing refuses at once
            continue
        loaded = not state.loading and any(r.current_time for r in state.recordings)
        equal = equal + 1 if loaded and picture == last else 1
        if equal >= _EQUAL_PICTURES:
            return picture
        last = picture
        time.sleep(_PAUSE_S)
    in_time = f' within {DRAWN_S:g} s' if drawing.is_running() else ''
    raise drawing.failure(f'did not finish drawing{in_time}')


def _views_of_rested_page(drawing: viewer.Viewer, client: ViewerClient) -> dict[str, bytes]:
    _rested_page(drawing, client)
    return {
        view.name: bytes(client.take_screenshot(view.view_id)) for view in client.get_state().views
    }
