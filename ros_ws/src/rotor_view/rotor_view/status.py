# Copyright 2026 The cracked rotor rig authors
# SPDX-License-Identifier: Apache-2.0
"""The status of alarm and nodes: levels over the flight, and a log."""

import re
from typing import Any

import rerun as rr

from rotor_interfaces.messages import level_of
from rotor_view import style

_NUMBER = re.compile(r'[-+]?\d+(\.\d+)?(e[-+]?\d+)?')


class Status:
    """Logs the states of one run; set the time of the stream before each call."""

    def __init__(self, stream: rr.RecordingStream) -> None:
        self.drawn: set[str] = set()
        """Entities that have something to show."""
        self._stream = stream
        self._alarms: dict[str, tuple[int, str]] = {}
        self._health: dict[str, int] = {}
        stream.log(
            style.ALARM_LEVEL,
            rr.StateConfiguration(values=style.LEVELS, colors=style.LEVEL_COLOURS),
            static=True,
        )

    def note(self, text: str) -> None:
        """Write a line of the view itself into the log."""
        self._log('view', text, 'INFO', style.GREY)

    def add_alarm(self, message: Any) -> None:
        """Show level and sentence as they are; log a line when the level or the words change."""
        for status in message.status:
            level = level_of(status)
            name = style.LEVELS[level]
            known_level, known_words = self._alarms.get(status.name, (None, ''))
            words = _NUMBER.sub('', status.message)  # numbers change with every window
            self._alarms[status.name] = (level, words)
            sentence = name if status.message == name else f'{name}: {status.message}'
            self._stream.log(style.ALARM_SENTENCE, rr.TextDocument(sentence))
            self.drawn |= {style.ALARM_LEVEL, style.ALARM_SENTENCE}
            if level != known_level:
                self._stream.log(style.ALARM_LEVEL, rr.StateChange(state=name))
            if level != known_level or words != known_words:
                self._log('alarm', status.message, name, style.LEVEL_COLOURS[level])

    def add_health(self, message: Any) -> None:
        """Log a line whenever the level of a node changes, the first time only if it is bad."""
        for status in message.status:
            level = level_of(status)
            known = self._health.get(status.name, 0)
            self._health[status.name] = level
            if level != known:
                text = f'{status.name}: {status.message}'
                self._log('health', text, style.LEVELS[level], style.LEVEL_COLOURS[level])

    def _log(self, source: str, text: str, level: str, colour: style.Colour) -> None:
        self.drawn.add(style.LOG)
        self._stream.log(f'{style.LOG}/{source}', rr.TextLog(text, level=level, color=colour))
