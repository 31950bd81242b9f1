# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Gap detection by absolute sample index."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor_common.errors import WireError
from rotor_interfaces.gaps import BlockTime, Continuity, SampleContinuity


def test_what_follows_what() -> None:
    stream = SampleContinuity()
    assert stream.check(512, 256) is Continuity.FIRST
    assert stream.check(768, 256) is Continuity.CONTIGUOUS
    assert stream.check(1280, 256) is Continuity.GAP
    assert stream.check(0, 256) is Continuity.RESTART
    assert (stream.blocks, stream.gaps, stream.lost_samples, stream.restarts) == (4, 1, 256, 1)


def at(first: int, stamp_s: float, step_s: float = 1e-3) -> tuple[int, int, BlockTime]:
    """Return a block of 256 samples at 1 kHz."""
    return first, 256, BlockTime(round(stamp_s * 1e9), 0.0, step_s)


def steady(blocks: int, first: int = 0) -> SampleContinuity:
    stream = SampleContinuity()
    for k in range(first, first + blocks):
        stream.check(*at(256 * k, 0.256 * k))
    return stream


@pytest.mark.parametrize('false', [10**12, 4 * 256 + 130, 4 * 256 - 256, 0, -(10**12)])
def test_a_jump_that_the_stamps_contradict_is_refused_and_no_loss(false: int) -> None:
    stream = steady(4)
    with pytest.raises(WireError, match=f'sample = {false} after 1023 does not fit the stamp'):
        stream.check(*at(false, 4 * 0.256))
    assert stream.check(*at(5 * 256, 5 * 0.256)) is Continuity.GAP
    assert (stream.blocks, stream.lost_samples, stream.restarts) == (5, 256, 0)


@pytest.mark.parametrize('lost', [1, 255, 256, 10_000, 36_000_000])
@pytest.mark.parametrize('drift', [0.0, 5e-4, -5e-4])
def test_a_gap_that_the_stamps_confirm_is_a_loss(lost: int, drift: float) -> None:
    stream = steady(4)
    first = 1024 + lost
    assert stream.check(*at(first, first * 1e-3 + lost * 1e-3 * drift)) is Continuity.GAP
    assert stream.lost_samples == lost


def test_a_run_that_begins_again_is_one_whatever_its_epoch() -> None:
    for epoch_s in (-5.0, 0.0, 1000.0):
        stream = steady(8)
        assert stream.check(*at(0, epoch_s)) is Continuity.RESTART


def test_a_source_that_counts_otherwise_from_now_on_is_followed() -> None:
    stream = steady(4)
    with pytest.raises(WireError):
        stream.check(*at(10**9, 4 * 0.256))
    assert stream.check(*at(10**9 + 256, 5 * 0.256)) is Continuity.RESTART
    assert stream.check(*at(10**9 + 512, 6 * 0.256)) is Continuity.CONTIGUOUS
    assert (stream.lost_samples, stream.restarts) == (0, 1)


def test_behind_a_false_first_block_another_run_begins() -> None:
    for false, true in ((10**12, 256), (0, 10**12)):
        stream = SampleContinuity()
        stream.check(*at(false, 0.0))
        assert stream.check(*at(true, 0.256)) is Continuity.RESTART
        assert stream.lost_samples == 0


@pytest.mark.parametrize('step_s', [1e-3, math.nan])
def test_where_the_stamps_stand_still_the_index_alone_counts(step_s: float) -> None:
    stream = SampleContinuity()
    for k in (0, 1, 2, 5):
        stream.check(*at(256 * k, 0.0, step_s))
    assert (stream.lost_samples, stream.restarts) == (512, 0)


def test_blocks_of_one_sample_are_timed_by_their_stamps() -> None:
    stream = SampleContinuity()
    for n in range(4):
        stream.check(n, 1, BlockTime(n * 1_000_000, 0.0, math.nan))
    with pytest.raises(WireError):
        stream.check(10**12, 1, BlockTime(4_000_000, 0.0, math.nan))
    assert stream.check(7, 1, BlockTime(7_000_000, 0.0, math.nan)) is Continuity.GAP
    assert stream.lost_samples == 3


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
