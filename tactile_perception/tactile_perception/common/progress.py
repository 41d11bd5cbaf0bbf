# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Long work: progress on stderr, and on all cores."""
from __future__ import annotations

import gc
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Item, Result = TypeVar('Item'), TypeVar('Result')


def progress(items: Iterable[Item], name: str) -> Iterator[Item]:
    """The items; a line on stderr says once a second how many are done, by their name."""
    begin = said = time.monotonic()
    for done, item in enumerate(items, 1):
        yield item
        now = time.monotonic()
        if now - said > 1.0:
            said = now
            print(f'{done} {name}, {done / (now - begin):.0f} a second', file=sys.stderr, flush=True)


def in_parallel(work: Callable[[Item], Result], items: Sequence[Item], what: str) -> list[Result]:
    """[work(item) for item in items]; work: a module-level function, which may itself work in parallel; what: name of the items for the
    progress. A process that works never collects this one's garbage: a node of ROS 2 that it ended would end it."""
    what, workers = f'of {len(items)} {what}', min(len(items), len(os.sched_getaffinity(0)))
    if workers < 2:
        return list(progress(map(work, items), what))
    with ProcessPoolExecutor(workers, get_context('fork'), initializer=gc.freeze) as pool:
        return list(progress(pool.map(work, items), what))
