# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""Validate the reports on `rig/progress`: they only grow, and never exceed what was sent."""

from collections.abc import Iterable


class Credit:
    """Progress of one consumer.

    Attributes:
        consumed_ns: the newest stamp that it has reported; 0 = ready, -1 = no report yet.
        refused: number of reports that cannot be true.

    """

    def __init__(self) -> None:
        self.consumed_ns = -1
        self.refused = 0

    def take(self, stamp_ns: int, sent_ns: int) -> None:
        """Take a report; one that goes back, or beyond the newest stamp sent, is counted.

        While nothing has been sent (0), a consumer may repeat a report of an earlier run: it is
        ready.
        """
        if not sent_ns:
            stamp_ns = min(stamp_ns, 0)
        if self.consumed_ns < stamp_ns <= sent_ns:
            self.consumed_ns = stamp_ns
        elif stamp_ns != self.consumed_ns:
            self.refused += 1


class Credits:
    """Progress of each of the named consumers; reports of others are ignored."""

    def __init__(self, names: Iterable[str]) -> None:
        self._credits = {name: Credit() for name in names}

    def __len__(self) -> int:
        return len(self._credits)

    def take(self, name: str, stamp_ns: int, sent_ns: int) -> None:
        """Take a report; see `Credit.take`."""
        if credit := self._credits.get(name):
            credit.take(stamp_ns, sent_ns)

    def behind(self, stamp_ns: int) -> list[str]:
        """Return the consumers that have not reported this stamp or a later one; 0 = ready."""
        return [name for name, credit in self._credits.items() if credit.consumed_ns < stamp_ns]

    @property
    def refused(self) -> int:
        """Number of reports that cannot be true."""
        return sum(credit.refused for credit in self._credits.values())
