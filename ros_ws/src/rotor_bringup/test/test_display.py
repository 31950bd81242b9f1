# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""What a person sees of a live run: true of the channel it names, and words for what is unknown."""

import io
import math
import re

import pytest
from rich.console import Console

from rotor_bringup.display import Display, RunState

UNKNOWN = {f'disk_z/amplitude_order_{order}': math.nan for order in (1, 2, 3)}
KNOWN = {f'disk_z/amplitude_order_{order}': order * 1e-6 for order in (1, 2, 3)}
ACCELERATION = {f'brg1_ay/amplitude_order_{order}': order / 10 for order in (1, 2, 3)}


def said(state: RunState, *, terminal: bool) -> str:
    """Return what the display shows of a state, without control sequences."""
    out = io.StringIO()
    console = Console(file=out, force_terminal=terminal, width=160, color_system=None)
    with Display(state, console) as display:
        display.refresh()
    return re.sub(r'\x1b\[[0-9;?]*[A-Za-z]', '', out.getvalue())


def state_after(*windows: dict[str, float]) -> RunState:
    state = RunState(20.0, simulated_s=1.0)
    for values in windows:
        state.take_indicators(values)
    return state


@pytest.mark.parametrize('terminal', [False, True])
@pytest.mark.parametrize(
    ('windows', 'words'),
    [
        ((), r'amplitudes:?\s+no window yet'),
        ((UNKNOWN,), r'disk_z:?\s+1x -  2x -  3x -'),
        ((KNOWN, UNKNOWN), r'disk_z:?\s+1x -  2x -  3x -'),
        ((KNOWN,), r'disk_z:?\s+1x 1.00 um  2x 2.00 um  3x 3.00 um'),
        ((ACCELERATION,), r'brg1_ay:?\s+1x 0.10 m/s\^2  2x 0.20 m/s\^2  3x 0.30 m/s\^2'),
    ],
)
def test_what_is_not_known_is_said_in_words(
    windows: tuple[dict[str, float], ...], words: str, *, terminal: bool
) -> None:
    text = said(state_after(*windows), terminal=terminal)
    assert re.search(words, text)
    assert not re.search(r'\b(nan|inf)\b', text)


def test_the_load_factor_is_unknown_until_it_is_told() -> None:
    state = state_after()
    assert 'n =     -' in said(state, terminal=False)
    state.load_factor = 3.0
    assert 'n =  3.00' in said(state, terminal=False)
