# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import gc
import os
from types import SimpleNamespace

import pytest

from tactile_perception.common import progress
from tactile_perception.common.progress import in_parallel


def test_items_come_through_and_a_short_run_is_silent(capsys):
    assert list(progress.progress('abc', 'letters')) == ['a', 'b', 'c']
    assert list(progress.progress([], 'letters')) == []
    assert capsys.readouterr() == ('', '')


def test_a_long_run_counts_once_in_a_while(capsys, monkeypatch):
    now = iter(0.4 * k for k in range(100))
    monkeypatch.setattr(progress, 'time', SimpleNamespace(monotonic=lambda: next(now)))  # threads of other tests ask for the time too
    assert len(list(progress.progress(range(9), 'frames'))) == 9
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert out == '' and 2 <= len(lines) <= 4 and lines[0].endswith('a second') and ' frames, ' in lines[0]
    assert [int(line.split()[0]) for line in lines] == sorted(int(line.split()[0]) for line in lines)


def square(number):
    return number**2, os.getpid()


def squares_of(numbers):
    return [value for value, _ in in_parallel(square, numbers, 'squares')]


@pytest.mark.parametrize('cores', [1, 3])
def test_results_are_in_order(cores, monkeypatch):
    monkeypatch.setattr(os, 'sched_getaffinity', lambda pid: range(cores))
    done = in_parallel(square, [1, 2, 3, 4, 5], 'squares')
    assert [value for value, _ in done] == [1, 4, 9, 16, 25]
    assert all((process == os.getpid()) == (cores == 1) for _, process in done)


def test_work_in_parallel_may_itself_be(monkeypatch):
    monkeypatch.setattr(os, 'sched_getaffinity', lambda pid: range(2))
    assert in_parallel(squares_of, [[1, 2], [3], [4, 5]], 'rows') == [[1, 4], [9], [16, 25]]


class Ended:
    """Notes the process that ends it; garbage, once nothing else holds it."""

    def __init__(self, notes):
        self.notes, self.itself = notes, self

    def __del__(self):
        with open(self.notes, 'a', encoding='utf-8') as notes:
            print(os.getpid(), file=notes)


def collected(number):
    return gc.collect() and number


def test_garbage_is_collected_by_the_process_that_made_it(monkeypatch, tmp_path):
    monkeypatch.setattr(os, 'sched_getaffinity', lambda pid: range(2))
    gc.disable()
    try:
        Ended(tmp_path / 'notes')
        in_parallel(collected, [1, 2], 'numbers')
    finally:
        gc.enable()
    gc.collect()
    assert (tmp_path / 'notes').read_text().split() == [str(os.getpid())]
