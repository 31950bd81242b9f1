# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""A node without a run holds on to the source that it heard first."""

import math

from hypothesis import assume, given
from hypothesis import strategies as st

from rotor_interfaces.gaps import BlockTime, FirstSource
from rotor_interfaces.messages import sample_stamp_ns

RATE_HZ = 10_240
COUNT = 256
HALF_BLOCK_NS = COUNT * 10**9 // RATE_HZ // 2


def accepts(source: FirstSource, epoch_ns: int, block: int, *, is_alone: bool = False) -> bool:
    first = block * COUNT
    stamp_ns = sample_stamp_ns(epoch_ns, first, RATE_HZ)
    time = BlockTime(stamp_ns, 0.0, 1.0 / RATE_HZ)
    return source.accepts(first, COUNT, time, is_alone=is_alone)


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


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(2, 10**9))
def test_of_blocks_of_one_sample_the_stamps_tell_the_step(order: list[bool], shift_ns: int) -> None:
    """As in a run, which is never alone: its blocks may be as short as that."""
    source, step_ns, sent = FirstSource(), 1000, 2

    def one(number: int, stamp_ns: int) -> bool:
        time = BlockTime(stamp_ns, 0.0, math.nan)
        return source.accepts(number, 1, time, is_alone=False)

    assert one(0, 10**18)
    assert one(1, 10**18 + step_ns)
    for is_first in order:
        stamp_ns = 10**18 + sent * step_ns
        assert one(sent, stamp_ns if is_first else stamp_ns + step_ns + shift_ns) == is_first
        sent += is_first
    assert source.other_blocks == order.count(False)


@given(step_s=st.floats(1e-9, 1e9), count=st.integers(1, 65_536))
def test_a_block_does_not_say_itself_when_it_is_due(step_s: float, count: int) -> None:
    """However far apart its samples are: the step of the newest block counts."""
    source = FirstSource()
    assert accepts(source, 10**18, 0)
    late = BlockTime(10**18 + 10**11, 0.0, step_s)
    assert not source.accepts(COUNT, count, late, is_alone=False)
