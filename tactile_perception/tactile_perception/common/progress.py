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
_BAR = 24  # characters


class Progress:
    """Iterates over items and says once a second how many are done, on stderr; silent for what is over within a second.

    name: of the items; total: how many there are to be, 0 where that is not known; with it comes a bar, and the time that is left.
    """

    def __init__(self, items: Iterable[Item], name: str, total: int = 0):
        self._items, self._line = items, ProgressLine(name, total)

    def __iter__(self) -> Iterator[Item]:
        for item in self._items:
            yield item
            self._line.step()
        self._line.end()


class ProgressLine:
    """The line itself, for work that counts its steps. Over itself on a terminal, else a line each time."""

    def __init__(self, name: str, total: int = 0):
        self._name, self._total, self._done = name, total, 0
        self._said = self._begin = time.monotonic()
        self._open = False

    def step(self) -> None:
        """One more is done."""
        self._done += 1
        now = time.monotonic()
        if now - self._said > _EVERY_S:
            self._said, self._open = now, sys.stderr.isatty()
            print('\r' * self._open + self._text(now), end='  ' if self._open else '\n', file=sys.stderr, flush=True)

    def end(self) -> None:
        """No more come: the terminal's line is left."""
        if self._open:
            print(file=sys.stderr)
        self._open = False

    def _text(self, now: float) -> str:
        rate = self._done / (now - self._begin)
        if not self._total:
            return f'{self._done} {self._name}, {rate:.0f} a second'
        full = min(_BAR * self._done // self._total, _BAR)
        left = max(self._total - self._done, 0) / rate
        return (f'[{"#" * full}{"." * (_BAR - full)}] {self._done} of {self._total} {self._name}, {rate:.0f} a second, '
                f'{left // 60:.0f}:{left % 60:02.0f} left')


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
        """Print the record, unless one was printed a moment ago."""
        now = time.monotonic()
        if now - self._said > _EVERY_S:
            self._said = now
            super().emit(record)
