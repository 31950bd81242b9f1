# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A node without a run holds on to the source that it heard first."""

import math

from hypothesis import assume, given
from hypothesis import strategies as st

from rotor_interfaces.gaps import FirstSource
from rotor_interfaces.messages import sample_stamp_ns

RATE_HZ = 10_240
COUNT = 256
HALF_BLOCK_NS = COUNT * 10**9 // RATE_HZ // 2


def accepts(source: FirstSource, epoch_ns: int, block: int, *, is_alone: bool = False) -> bool:
    first = block * COUNT
    stamp_ns = sample_stamp_ns(epoch_ns, first, RATE_HZ)
    return source.accepts(stamp_ns, first, COUNT, step_s=1.0 / RATE_HZ, is_alone=is_alone)


epochs = st.integers(10**18, 2 * 10**18)


@given(
    epoch=epochs,
    shift_ns=st.integers(-(10**15), 10**15),
    order=st.lists(st.booleans(), min_size=2, max_size=60),
)
def test_of_two_sources_exactly_the_blocks_of_the_first_are_accepted(
    epoch: int, shift_ns: int, order: list[bool]
) -> None:
    assume(abs(shift_ns) > HALF_BLOCK_NS)
    source = FirstSource()
    assert accepts(source, epoch, 0)
    sent = {True: 1, False: 0}
    for is_first in order:
        assert accepts(source, epoch if is_first else epoch + shift_ns, sent[is_first]) == is_first
        sent[is_first] += 1
    assert source.other_blocks == order.count(False)


@given(
    epoch=epochs,
    gap=st.integers(0, 100_000),
    jitter_ns=st.integers(-HALF_BLOCK_NS + 1000, HALF_BLOCK_NS - 1000),
)
def test_a_gap_and_stamps_that_jitter_are_the_sources_own(
    epoch: int, gap: int, jitter_ns: int
) -> None:
    source = FirstSource()
    assert accepts(source, epoch, 5)
    assert accepts(source, epoch + jitter_ns, 6 + gap)


def test_a_source_alone_may_jump_as_it_likes() -> None:
    source = FirstSource()
    for epoch, block in ((10**18, 0), (10**18, 9), (10**18, 0), (2 * 10**18, 0), (5, 7)):
        assert accepts(source, epoch, block, is_alone=True)
    assert source.other_blocks == 0


def test_a_repeated_block_is_not_accepted_from_two_sources() -> None:
    source = FirstSource()
    assert accepts(source, 10**18, 3)
    assert not accepts(source, 10**18, 3)


def test_blocks_that_do_not_tell_their_step_cannot_be_told_apart() -> None:
    source = FirstSource()
    assert source.accepts(0, 0, 1, step_s=math.nan, is_alone=False)
    assert not source.accepts(10**5, 1, 1, step_s=math.nan, is_alone=False)
    assert source.accepts(10**5, 1, 1, step_s=math.nan, is_alone=True)
