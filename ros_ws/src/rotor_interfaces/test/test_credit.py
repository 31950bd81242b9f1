# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Progress only grows, never beyond what was sent, and what cannot be true is counted."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor_interfaces.credit import Credit, Credits

SENT_NS = 1000


@given(st.lists(st.integers(-(10**19), 10**19) | st.integers(-2, SENT_NS + 2)))
def test_progress_only_grows_and_every_report_is_taken_or_counted(reports: list[int]) -> None:
    credit = Credit()
    for stamp_ns in reports:
        before, refused = credit.consumed_ns, credit.refused
        credit.take(stamp_ns, SENT_NS)
        possible = before <= stamp_ns <= SENT_NS
        assert credit.consumed_ns == (stamp_ns if possible else before)
        assert credit.refused == refused + (not possible)


@pytest.mark.parametrize('stamp_ns', [0, 1, 10**18])
def test_before_anything_was_sent_a_report_means_ready(stamp_ns: int) -> None:
    credits_ = Credits(['monitor', 'recorder'])
    assert credits_.behind(0) == ['monitor', 'recorder']
    credits_.take('monitor', stamp_ns, 0)
    credits_.take('recorder', -1, 0)
    credits_.take('stranger', stamp_ns, 0)
    assert credits_.behind(0) == ['recorder']
    assert credits_.behind(1) == ['monitor', 'recorder']
    credits_.take('monitor', 7, 9)
    credits_.take('monitor', 3, 9)
    assert credits_.behind(7) == ['recorder']
    assert credits_.refused == 1
    assert len(credits_) == 2
