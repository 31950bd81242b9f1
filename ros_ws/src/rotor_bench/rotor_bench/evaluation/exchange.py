# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The parent side of the connection to a detector process, and its protocol rules.

A detector may write what it likes on its end of the socket, so nothing that comes back is trusted:
a verdict counts only for the block that was sent last, and whatever breaks the rules is the failure
of the detector. No block is sent before the verdict on the one before it is here.
"""

import collections
import contextlib
import json
import math
import select
import socket
import time
from collections.abc import Callable, Iterator

from rotor_bench.evaluation import pipe_protocol
from rotor_bench.evaluation.walls import Walls
from rotor_bench.evaluation.walls import text as walls_text
from rotor_common.errors import WireError
from rotor_interfaces.waveform import WaveformBlock

START_S = 120.0
"""Longest time to start a process, or to load and make a detector."""
END_S = 10.0
"""Longest time until the kernel has ended a process that is killed."""


LAST_WORDS_S = 1.0
"""How long the last replies of a process that is gone are read."""


class Stream:
    """Blocks to a detector, verdicts back; a failure ends it and is never raised.

    `verdicts` holds those not taken yet: (number of the block, score, evidence, '' where the score
    is not the largest so far). `walls` are the restrictions of the process, which must be the
    `expected` ones if these are given; `is_made` says whether its detector is made, `alarm_score`
    is the detector's, `learnt` the bytes of the detector after a fit.
    """

    def __init__(
        self,
        connection: socket.socket,
        leash: socket.socket,
        silence_s: float,
        *,
        is_fit: bool,
        expected: Walls | None = None,
    ) -> None:
        self._connection = connection
        self._leash = leash
        self._silence_s = silence_s
        self._is_fit = is_fit
        self._expected = expected
        self._replies = bytearray()
        self.is_made = False
        self._blocks = 0
        self._judged = 0
        self._ended = False
        self._done = False
        self.failure = ''
        self.walls: Walls = {}
        self.alarm_score = math.nan
        self.learnt = b''
        self.verdicts: collections.deque[tuple[int, float, str]] = collections.deque()

    def teach(self, learnt: bytes) -> None:
        """Send the fitted detector, before the first block of a flight under test."""
        with self._failing(START_S):
            self._connection.settimeout(START_S)
            pipe_protocol.send_learnt(self._connection, learnt)

    def begin(self) -> None:
        """Wait until the process is restricted and its detector is made."""
        with self._failing(START_S):
            self._await(lambda: self.is_made, START_S)

    def send(self, block: WaveformBlock) -> None:
        """Send an anonymous block, once the verdict on the one before is here.

        A process that is fitted gives none, and reads at its own pace.
        """
        if not self._blocks:
            self.begin()
        self._await_verdict()
        if self._is_open():
            self._blocks += 1
            with self._failing(self._silence_s):
                self._connection.settimeout(self._silence_s)
                pipe_protocol.send_block(self._connection, block)

    def end_flight(self) -> None:
        """Send the end of a reference flight."""
        self._end(pipe_protocol.END_OF_FLIGHT)

    def finish(self) -> None:
        """Send the end, wait for the last replies, and end the process."""
        self._await_verdict()
        self._ended = True
        self._end(pipe_protocol.END_OF_STREAM)
        with self._failing(self._silence_s):
            self._await(lambda: self._done, self._silence_s)
        self.close()

    def _end(self, stamp: int) -> None:
        if self._is_open():
            with self._failing(self._silence_s):
                self._connection.settimeout(self._silence_s)
                pipe_protocol.send_end(self._connection, stamp)

    def close(self) -> None:
        """End the process, whatever it is doing, and all that it has started."""
        self._connection.close()
        with contextlib.suppress(OSError):
            self._leash.settimeout(END_S)
            self._leash.shutdown(socket.SHUT_WR)
            self._leash.recv(1)  # the keeper closes its end last
        self._leash.close()

    def _is_open(self) -> bool:
        return not (self._done or self.failure)

    def _await_verdict(self) -> None:
        """Wait for the verdict on the last block; of a fit, take the replies that have come."""
        with self._failing(self._silence_s):
            if self._is_fit:
                while self._is_open() and self._has_news(0.0):
                    self._take()
            else:
                self._await(lambda: self._judged == self._blocks, self._silence_s)

    def _await(self, is_there: Callable[[], bool], limit_s: float) -> None:
        """Take replies until `is_there()`; the time limit is for all of them together."""
        until = time.monotonic() + limit_s
        while self._is_open() and not is_there():
            left_s = until - time.monotonic()
            if left_s <= 0:
                raise TimeoutError
            self._connection.settimeout(left_s)
            self._take()

    @contextlib.contextmanager
    def _failing(self, limit_s: float) -> Iterator[None]:
        """Turn what can go wrong with the socket into the failure of the detector."""
        try:
            yield
        except TimeoutError:
            self.failure = f'it did not answer within {limit_s:g} s'
        except OSError:
            with contextlib.suppress(OSError):  # the process is gone; its last replies count
                self._await(lambda: not self._has_news(0.1), LAST_WORDS_S)
            if self._is_open():
                self.failure = 'its process died'

    def _has_news(self, wait_s: float) -> bool:
        return bool(select.select([self._connection], [], [], wait_s)[0])

    def _take(self) -> None:
        data = self._connection.recv(65_536)
        if not data:
            raise ConnectionResetError
        self._replies += data
        try:
            for reply in pipe_protocol.take_replies(self._replies):
                if not self._is_open():
                    return
                self._accept(reply)
        except WireError as error:
            self.failure = f'it broke the rules of the exchange: {error}'

    def _accept(self, reply: pipe_protocol.Reply) -> None:
        """Take a reply that is expected; any other is a failure of the detector."""
        if reply.kind == pipe_protocol.WALLS and not self.walls:
            self.walls = json.loads(reply.data)  # sent before any code under test is loaded
            if self._expected is not None and self.walls != self._expected:
                self.failure = f'its process could not be isolated: {walls_text(self.walls)}'
        elif reply.kind == pipe_protocol.FAILED:
            self.failure = reply.text or 'it failed without a word'
        elif reply.kind == pipe_protocol.MADE and not self.is_made:
            self.is_made = True
            self.alarm_score = reply.score
        elif reply.kind == pipe_protocol.LEARNT and self._is_fit and not self.learnt:
            self.learnt = reply.data
        elif reply.kind == pipe_protocol.VERDICT and not self._is_fit:
            self._judge(reply)
        elif reply.kind == pipe_protocol.DONE and (self.learnt if self._is_fit else self._ended):
            self._done = True
        else:
            self.failure = f'it broke the rules of the exchange: a reply of kind {reply.kind}'

    def _judge(self, reply: pipe_protocol.Reply) -> None:
        if self._judged == self._blocks:
            self.failure = f'it gave more verdicts than the {self._blocks} blocks sent so far'
        elif math.isinf(reply.score):
            self.failure = 'it sent an infinite score; it must be a number, or NaN for none'
        else:
            self.verdicts.append((self._judged, reply.score, reply.text))
            self._judged += 1
