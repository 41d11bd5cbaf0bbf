# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that a subscription has received and a source has not read yet."""
from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any

from ..sources.source import NothingYet, Source
from .constants import NODES


class ReceivedMessages:
    """Queue between a subscription and the thread that reads its source.

    source: counts the messages that the queue drops; depth: number of messages kept, the newest.
    """

    def __init__(self, source: Source, depth: int):
        self._source, self._queue, self._arrived = source, deque(maxlen=depth), threading.Condition()

    def add(self, message: Any) -> None:
        """Append a message; the oldest one is dropped if the queue is full."""
        with self._arrived:
            self._source.skipped += len(self._queue) == self._queue.maxlen
            self._queue.append(message)
            self._arrived.notify_all()

    def next(self, is_ready: Callable[[], bool] = lambda: True) -> Any:
        """Remove and return the oldest message, once is_ready. Raises NothingYet after 0.1 s without one."""
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._queue and is_ready(), NODES.max_read_s):
                raise NothingYet
            return self._queue.popleft()

    def clear(self) -> None:
        """Drop all messages."""
        with self._arrived:
            self._queue.clear()
