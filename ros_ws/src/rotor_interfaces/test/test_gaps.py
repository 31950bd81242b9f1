# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Gap detection by absolute sample index."""

from hypothesis import given
from hypothesis import strategies as st

from rotor_interfaces.gaps import Continuity, SampleContinuity


def test_what_follows_what() -> None:
    stream = SampleContinuity()
    assert stream.check(512, 256) is Continuity.FIRST
    assert stream.check(768, 256) is Continuity.CONTIGUOUS
    assert stream.check(1280, 256) is Continuity.GAP
    assert stream.check(0, 256) is Continuity.RESTART
    assert (stream.blocks, stream.gaps, stream.lost_samples, stream.restarts) == (4, 1, 256, 1)


@given(
    counts=st.lists(st.integers(1, 500), min_size=2, max_size=40),
    dropped=st.sets(st.integers(1, 38)),
)
def test_every_dropped_sample_between_two_received_blocks_is_counted(
    counts: list[int], dropped: set[int]
) -> None:
    stream = SampleContinuity()
    last = len(counts) - 1
    first, lost = 0, 0
    for k, count in enumerate(counts):
        if k in dropped and k != last:
            lost += count
        else:
            stream.check(first, count)
        first += count
    assert stream.lost_samples == lost
    assert stream.restarts == 0
