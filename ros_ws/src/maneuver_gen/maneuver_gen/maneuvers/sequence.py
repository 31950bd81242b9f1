# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Several maneuvers in sequence."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import pydantic

from maneuver_gen.curves import FloatArray, smooth_step
from maneuver_gen.errors import ManeuverError
from maneuver_gen.maneuver import Maneuver, time_field
from maneuver_gen.registry import PartOfSequence, resolve_paths
from rotor_common.configuration import ConfigModel, quantity


class Segment(ConfigModel):
    """One part of a sequence."""

    duration_s: float = time_field(description='how long the segment lasts', ge=0.01)
    maneuver: PartOfSequence = pydantic.Field(description='any profile but a sequence')


class Sequence(Maneuver):
    """Segments one after the other; each blends smoothly out of the one before.

    The last segment goes on for as long as the run lasts.
    """

    part_of_sequence: ClassVar[bool] = False
    profile: str = 'sequence'
    blend_s: float = quantity(
        0.5,
        unit='s',
        description='time from the start of a segment to blend into it',
        ge=0.05,
        le=60,
    )
    # not strict: the check of `profile` leaves lists, which strict mode does not take for tuples
    segments: tuple[Segment, ...] = pydantic.Field(
        strict=False, description='list of duration_s and maneuver, at least one'
    )

    @pydantic.model_validator(mode='after')
    def _room_to_blend(self) -> Self:
        if not self.segments:
            raise ManeuverError('segments is empty; a sequence has at least one segment')
        for number, segment in enumerate(self.segments):
            if number and segment.duration_s < self.blend_s:
                raise ManeuverError(
                    f'segments[{number}].duration_s = {segment.duration_s:g} is shorter than '
                    f'blend_s = {self.blend_s:g}; lengthen the segment or shorten the blend'
                )
        return self

    def load_factors(self, times_s: FloatArray) -> FloatArray:
        """Return the load of each segment, blended out of the one before, which goes on."""
        starts_s = np.concatenate(([0.0], np.cumsum([part.duration_s for part in self.segments])))
        starts_s[-1] = math.inf  # the last segment goes on
        result = np.empty((len(times_s), 2))
        for number, segment in enumerate(self.segments):
            inside = (times_s >= starts_s[number]) & (times_s < starts_s[number + 1])
            local_s = times_s[inside] - starts_s[number]
            load = segment.maneuver.sample(local_s)
            if number:
                blending = local_s < self.blend_s
                old = self.segments[number - 1].maneuver.sample(
                    times_s[inside][blending] - starts_s[number - 1]
                )
                share = smooth_step(local_s[blending] / self.blend_s)[:, np.newaxis]
                load[blending] = old * (1.0 - share) + load[blending] * share
            result[inside] = load
        return result

    def check_duration(self, duration_s: float) -> None:
        """Check every segment for how long the run needs it."""
        for maneuver, needed_s in self._parts(duration_s):
            maneuver.check_duration(needed_s)

    def _parts(self, duration_s: float) -> Iterator[tuple[Maneuver, float]]:
        left_s = duration_s
        for segment in self.segments[:-1]:
            if left_s > 0.0:
                yield segment.maneuver, min(left_s, segment.duration_s + self.blend_s)
            left_s -= segment.duration_s
        if left_s > 0.0:
            yield self.segments[-1].maneuver, left_s

    @classmethod
    def resolve_paths(cls, data: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
        """Make the files of every segment absolute."""
        segments = data.get('segments')
        if not isinstance(segments, list):
            return data
        return {**data, 'segments': [_resolved(segment, folder) for segment in segments]}


def _resolved(segment: Any, folder: Path) -> Any:
    if not isinstance(segment, Mapping) or 'maneuver' not in segment:
        return segment
    return {**segment, 'maneuver': resolve_paths(segment['maneuver'], folder)}
