# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Long computations on all cores, with progress in the log."""
from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Item, Result = TypeVar('Item'), TypeVar('Result')

_log = logging.getLogger(__name__)


def in_parallel(work: Callable[[Item], Result], items: Sequence[Item], what: str) -> list[Result]:
    """[work(item) for item in items]; work: a module-level function, which may itself work in parallel; what: name of the items in the
    log."""
    workers = min(len(items), len(os.sched_getaffinity(0)))
    if workers < 2:
        return _collected(map(work, items), len(items), what)
    with ProcessPoolExecutor(workers, get_context('fork')) as pool:
        return _collected(pool.map(work, items), len(items), what)


def _collected(results, count: int, what: str) -> list:
    done = []
    for result in results:
        done.append(result)
        _log.info('%s: %d of %d', what, len(done), count)
    return done
