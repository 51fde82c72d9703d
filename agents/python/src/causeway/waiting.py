"""Waiting for a process beside this one: looking for a moment, then asleep.

Who sleeps is woken some ten microseconds late, and later on a processor that idles; the other one
may be done sooner. Who looks takes processor time meanwhile, so that it is done only where it
helps: not longer than sleeping costs, not after a long wait, and ever more rarely while it is in
vain. The engine waits for its client in the same way.
"""

from __future__ import annotations

import select
import time

__all__ = ["Waiting"]

#: About what it takes to fall asleep and to be woken.
LOOK_SECS = 20e-6
#: After a wait longer than this nobody looks.
SHORT_SECS = 150e-6
#: Most waits without a look after one in vain.
PAUSE_MAX = 256

Events = list[tuple[int, int]]


class Waiting:
    """Waits for descriptors. While it sleeps, and between two looks, other threads run."""

    def __init__(self, descriptors: list[int]) -> None:
        """Waits for what can be read from any of these."""
        self._poll = select.poll()
        for descriptor in descriptors:
            self._poll.register(descriptor, select.POLLIN)
        #: Waits without a look that are left, and how many there were after the last in vain.
        self._left = 0
        self._pause = 0

    def wait(self, timeout_secs: float) -> Events:
        """Descriptors and what is the matter with each; none after so long."""
        if self.looks():
            events = self._look()
            self.note_look(bool(events))
            if events:
                return events
        begun = time.monotonic()
        events = self._poll.poll(max(timeout_secs, 0.0) * 1000.0)
        self.note_sleep(time.monotonic() - begun)
        return events

    def _look(self) -> Events:
        until = time.monotonic() + LOOK_SECS
        while True:
            events = self._poll.poll(0)
            if events or time.monotonic() > until:
                return events

    def looks(self) -> bool:
        """Whether to look before this wait."""
        if self._left == 0:
            return True
        self._left -= 1
        return False

    def note_look(self, seen: bool) -> None:
        """What was waited for was seen in time, or not."""
        self._pause = 0 if seen else min(max(2 * self._pause, 1), PAUSE_MAX)
        self._left = self._pause

    def note_sleep(self, waited_secs: float) -> None:
        """It took so long asleep."""
        if waited_secs > SHORT_SECS:
            self._left = max(self._left, 1)
