"""Log of events: numbered, bounded, read by any number of tabs at their own pace."""

from __future__ import annotations

import asyncio
import json
import secrets
import threading
from collections import deque
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from typing import Any

KEPT_EVENTS = 2000  # events that a tab may be behind before it must fetch the state anew
EVENT_QUIET_SECONDS = 15.0  # s without an event, after which a comment is sent to keep the connection open


@dataclass(frozen=True)
class LoggedEvent:
    """Event with its number, from 1 at the start of the server, and plain data.

    name : ``step``, ``job`` or ``changed``; ``reset`` where a reader must fetch the whole state anew.
    """

    number: int
    name: str
    data: Mapping[str, Any]


class EventLog:
    """Log of the last `KEPT_EVENTS` events. Readers keep their own place in it; one that is too far behind gets a ``reset``.

    `start` is a random text for each start of the server, by which a reader finds that the numbers began anew.
    """

    def __init__(self) -> None:
        self.start = secrets.token_hex(4)
        self._events: deque[LoggedEvent] = deque(maxlen=KEPT_EVENTS)
        self._number = 0
        self._lock = threading.Lock()
        self._readers: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()

    def publish(self, name: str, **data: Any) -> None:
        """Add an event with plain data, from any thread, and wake all readers."""
        with self._lock:
            self._number += 1
            self._events.append(LoggedEvent(self._number, name, data))
            readers = list(self._readers)
        for loop, signal in readers:
            try:
                loop.call_soon_threadsafe(signal.set)
            except RuntimeError:  # its loop has ended
                self._readers.discard((loop, signal))

    def since(self, number: int) -> tuple[list[LoggedEvent], bool]:
        """Return the kept events after a number, and whether the reader has lost some.

    A number above the last one comes from another start of the server, and counts as lost too.
    """
        with self._lock:
            events = [event for event in self._events if event.number > number]
            first = self._events[0].number if self._events else self._number + 1
            return events, number + 1 < first or number > self._number

    async def stream(self, last_id: str = "") -> AsyncIterator[str]:
        """Yield the text of server-sent events after the one of id `last_id` (``start-number``), or from now on.

        A reader without an id, or with that of an earlier start, gets a ``reset`` first.
        """
        start, _, text = last_id.partition("-")
        number = int(text) if text.isdigit() and start == self.start else self._number
        signal = asyncio.Event()
        reader = (asyncio.get_running_loop(), signal)
        self._readers.add(reader)
        try:
            yield "retry: 1000\n\n"
            if start != self.start:  # a first connection, or one to a server that has started anew
                yield self._text(LoggedEvent(number, "reset", {}))
            while True:
                signal.clear()
                events, is_lost = self.since(number)
                if is_lost:
                    yield self._text(LoggedEvent(self._number, "reset", {}))
                    number = self._number
                    continue
                for event in events:
                    yield self._text(event)
                    number = event.number
                try:
                    await asyncio.wait_for(signal.wait(), EVENT_QUIET_SECONDS)
                except TimeoutError:
                    yield ": quiet\n\n"
        finally:
            self._readers.discard(reader)

    def _text(self, event: LoggedEvent) -> str:
        """Return an event in the format of server-sent events."""
        return f"id: {self.start}-{event.number}\nevent: {event.name}\ndata: {json.dumps(event.data)}\n\n"
