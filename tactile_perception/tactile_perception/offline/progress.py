# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A line on the terminal that counts while a tool works."""
from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar('Item')
_EVERY_S = 1.0


class Progress:
    """Iterates over items and says once a second how many are done, on stderr; silent for what is over within a second."""

    def __init__(self, items: Iterable[Item], name: str):
        self._items, self._name = items, name

    def __iter__(self) -> Iterator[Item]:
        said = begin = time.monotonic()
        for count, item in enumerate(self._items, 1):
            yield item
            if time.monotonic() - said > _EVERY_S:
                said = time.monotonic()
                print(f'{count} {self._name}, {count / (said - begin):.0f} a second', file=sys.stderr, flush=True)


@contextmanager
def log_told() -> Iterator[None]:
    """While this lasts, what the package logs of long work goes to stderr, a line a second at most."""
    log, handler = logging.getLogger(__package__.partition('.')[0]), _Seldom(sys.stderr)
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


class _Seldom(logging.StreamHandler):
    """Leaves out what comes within a second of a line before."""

    _said = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        now = time.monotonic()
        if now - self._said > _EVERY_S:
            self._said = now
            super().emit(record)
