# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a view without a screen."""

import time
from pathlib import Path
from typing import Self

from rerun.experimental import ViewerClient

from vibration_monitor.view import viewer

SIZE = (1600, 1000)
"""Pixels of the whole page."""

DRAWN_S = 120.0
"""A page that has not come to rest by then has failed; a quiet machine needs about 5 s."""

_NO_ANSWER = (RuntimeError, OSError)
"""What rerun raises when its viewer does not answer within 15 s."""

_PAUSE_S = 0.2
_EQUAL_PICTURES = 3


class Page:
    """A recording (.rrd) drawn without a screen; a context that holds the viewer.

    Raises:
        ViewError: no software renderer, no viewer, or a page that never comes to rest.

    """

    def __init__(self, recording: Path, size: tuple[int, int] = SIZE) -> None:
        self._viewer = viewer.headless([str(recording)], size)
        try:
            self._client = ViewerClient.connect(self._viewer.url)
            self._whole = self._wait_until_drawn()
        except BaseException:
            self._viewer.close()
            raise

    def _wait_until_drawn(self) -> bytes:
        """Return the page once everything is loaded and equal pictures follow each other."""
        deadline = time.monotonic() + DRAWN_S
        equal, last = 0, b''
        while time.monotonic() < deadline and self._viewer.is_running():
            try:
                state = self._client.get_state()
                picture = bytes(self._client.take_screenshot())
            except _NO_ANSWER:
                continue
            loaded = not state.loading and any(r.current_time for r in state.recordings)
            equal = equal + 1 if loaded and picture == last else 1
            if equal >= _EQUAL_PICTURES:
                return picture
            last = picture
            time.sleep(_PAUSE_S)
        raise self._viewer.failure(f'did not finish drawing within {DRAWN_S:g} s')

    def whole(self) -> bytes:
        """Return the page as PNG."""
        return self._whole

    def views(self) -> dict[str, bytes]:
        """Return each view alone as PNG, by its name."""
        try:
            return {
                view.name: bytes(self._client.take_screenshot(view.view_id))
                for view in self._client.get_state().views
            }
        except _NO_ANSWER:
            raise self._viewer.failure('gave no picture of a view') from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._viewer.close()
