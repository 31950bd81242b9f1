# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the views of a page have drawn something: their declared colours, found in pixels."""

import io
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from rotor_interfaces.channels import CHANNEL_COLUMNS
from rotor_view import blueprint, style
from rotor_view.style import Colour

RULE = 'crack_ratio_low'
PAGE = blueprint.Page(
    channel='disk_z',
    plane='disk',
    waveforms=tuple(
        (path, tuple(names)) for path, names in style.channel_groups(CHANNEL_COLUMNS).items()
    ),
    rules=(RULE,),
)
"""What the page of the test flight shows."""

RULE_VIEW = blueprint.rule_view(PAGE, RULE)
RATIO_VIEW = blueprint.ratio_view(PAGE)
SPECTRUM_VIEW = blueprint.spectrum_view(PAGE)
SPECTROGRAM_VIEW = blueprint.spectrogram_view(PAGE)
DISPLACEMENT_VIEW = blueprint.waveform_view(PAGE, style.DISPLACEMENT)
ACCELERATION_VIEW = blueprint.waveform_view(PAGE, style.ACCELERATION)
ORBIT_VIEW = blueprint.orbit_view(PAGE)

EXPECTED: dict[str, tuple[Colour, ...]] = {
    blueprint.LOAD_VIEW: (style.AMBER,),
    blueprint.ALARM_VIEW: style.LEVEL_COLOURS[:3],
    blueprint.SENTENCE_VIEW: (),  # words have no colour of their own
    RULE_VIEW: (style.RULE_COLOUR, *style.LEVEL_COLOURS[1:3]),
    RATIO_VIEW: (style.TEAL, style.MAGENTA, style.VIOLET, style.LIME),
    SPECTRUM_VIEW: (style.SPECTRUM_COLOUR,),
    SPECTROGRAM_VIEW: ((250, 154, 32),),
    DISPLACEMENT_VIEW: (style.BLUE, style.ORANGE),
    ACCELERATION_VIEW: (style.TEAL, style.MAGENTA),
    blueprint.RIG_VIEW: (style.CRACK_COLOUR, style.LOAD_COLOUR),
    ORBIT_VIEW: (style.ORBIT_COLOUR,),
    blueprint.LOG_VIEW: style.LEVEL_COLOURS[:3],
    blueprint.SPEED_VIEW: (style.LIME,),
    blueprint.TRUTH_VIEW: (style.RED,),
}
"""Colours each view must show; the test flight has a level, a curve, a body for each of them."""

FEWEST_PIXELS = 100
"""A line across the smallest view has more; the dot in a legend, at most 60, is not a curve."""


def pixels_of(picture: NDArray[np.float64], colour: Colour) -> int:
    """Count the pixels with the hue of a colour: shading and smoothing change only its length."""
    wanted = np.array(colour, np.float64)
    length = np.linalg.norm(picture, axis=-1)
    bright = length > 0.35 * np.linalg.norm(wanted)
    cosine = (picture @ wanted) / np.maximum(length * np.linalg.norm(wanted), 1.0)
    return int((bright & (cosine > 0.995)).sum())


def empty_views(pictures: Mapping[str, bytes]) -> dict[str, list[Colour]]:
    """Return the views of a page that lack a colour they must show, with those colours."""
    lacking: dict[str, list[Colour]] = {}
    for name in pictures:
        colours = EXPECTED[name]
        image = Image.open(io.BytesIO(pictures[name])).convert('RGB')
        picture = np.asarray(image, np.float64)
        missing = [colour for colour in colours if pixels_of(picture, colour) < FEWEST_PIXELS]
        if missing:
            lacking[name] = missing
    return lacking
