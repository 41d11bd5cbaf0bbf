# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import logging
import os

import pytest
from tactile_perception.common import parallel as module
from tactile_perception.common.parallel import in_parallel


def square(number):
    return number**2, os.getpid()


def squares_of(numbers):
    return [value for value, _ in in_parallel(square, numbers, 'squares')]


@pytest.mark.parametrize('cores', [1, 3])
def test_results_are_in_order_and_told(cores, monkeypatch, caplog):
    monkeypatch.setattr(os, 'sched_getaffinity', lambda pid: range(cores))
    # launch, which other tests import, makes loggers that keep to themselves
    monkeypatch.setattr(module._log, 'handlers', [caplog.handler])
    with caplog.at_level(logging.INFO, logger=module._log.name):
        done = in_parallel(square, [1, 2, 3, 4, 5], 'squares')
    assert [value for value, _ in done] == [1, 4, 9, 16, 25] and caplog.messages[-1] == 'squares: 5 of 5'
    assert all((process == os.getpid()) == (cores == 1) for _, process in done)


def test_work_in_parallel_may_itself_be(monkeypatch):
    monkeypatch.setattr(os, 'sched_getaffinity', lambda pid: range(2))
    assert in_parallel(squares_of, [[1, 2], [3], [4, 5]], 'rows') == [[1, 4], [9], [16, 25]]
