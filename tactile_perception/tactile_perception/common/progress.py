# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Long work: progress on stderr, and on all cores."""
from __future__ import annotations

import gc
import logging
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TypeVar

Item, Result = TypeVar('Item'), TypeVar('Result')
_EVERY_S = 1.0
_BAR = 24  # characters


class Progress:
    """Iterates over items and prints once a second how many are done; prints nothing within the first second.

    name: of the items; total: number of items, 0 if unknown; with it a bar and the remaining time are printed.
    """

    def __init__(self, items: Iterable[Item], name: str, total: int = 0):
        self._items, self._line = items, ProgressLine(name, total)

    def __iter__(self) -> Iterator[Item]:
        for item in self._items:
            yield item
            self._line.step()
        self._line.end()


class ProgressLine:
    """The progress line, for work that counts its steps; overwritten on a terminal, else a new line each time."""

    def __init__(self, name: str, total: int = 0):
        self._name, self._total, self._done = name, total, 0
        self._said = self._begin = time.monotonic()
        self._open = False

    def step(self) -> None:
        """Count one item."""
        self._done += 1
        now = time.monotonic()
        if now - self._said > _EVERY_S:
            self._said, self._open = now, sys.stderr.isatty()
            print('\r' * self._open + self._text(now), end='  ' if self._open else '\n', file=sys.stderr, flush=True)

    def end(self) -> None:
        """Finish the line."""
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
def log_reported() -> Iterator[None]:
    """Context in which the package's log goes to stderr, at most one line per second."""
    log, handler = logging.getLogger(__package__.partition('.')[0]), _RateLimited(sys.stderr)
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


class _RateLimited(logging.StreamHandler):
    """Drops records within a second of the last."""

    _said = 0.0

    def emit(self, record: logging.LogRecord) -> None:
        """Print the record, unless one was printed within the last second."""
        now = time.monotonic()
        if now - self._said > _EVERY_S:
            self._said = now
            super().emit(record)


_log = logging.getLogger(__name__)


def in_parallel(work: Callable[[Item], Result], items: Sequence[Item], what: str) -> list[Result]:
    """[work(item) for item in items]; work: a module-level function, which may itself work in parallel; what: name of the items in the
    log. A process that works never collects this one's garbage: a node of ROS 2 that it ended would end it."""
    workers = min(len(items), len(os.sched_getaffinity(0)))
    if workers < 2:
        return _collected(map(work, items), len(items), what)
    with ProcessPoolExecutor(workers, get_context('fork'), initializer=gc.freeze) as pool:
        return _collected(pool.map(work, items), len(items), what)


def _collected(results, count: int, what: str) -> list:
    done = []
    for result in results:
        done.append(result)
        _log.info('%s: %d of %d', what, len(done), count)
    return done
