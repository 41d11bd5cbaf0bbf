# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Many recordings: found in folders, one task each, in processes or on a Dask cluster; what died, failed or was done before."""
import argparse
import signal
import time

import pytest
from taxel_bags import write_taxels
from wishes import work

from tactile_driver.recordings.reader import BagReader
from tactile_perception.core.errors import BadArgument
from tactile_perception.tools import evaluate, process_bag
from tactile_perception.tools.many import FAILED, INTERRUPTED, Task, recordings, run


@pytest.fixture
def tasks(tmp_path):
    def make(**wishes):
        made = []
        for name, wish in wishes.items():
            (tmp_path / f'{name}.mcap').write_text(wish)
            made.append(Task(name, work, tmp_path / f'{name}.mcap', tmp_path / 'out' / name, argparse.Namespace(word='it')))
        return made
    return make


def outputs(folder):
    return {path.name: path.read_text() for path in (folder / 'out').iterdir()}


@pytest.mark.parametrize('jobs', [1, 3])
def test_one_that_fails_or_dies_costs_no_other_and_has_a_row(tasks, tmp_path, capsys, jobs):
    assert run(tasks(a='good', b='fail', c='die', d='bug', e='good'), jobs, '') == FAILED
    out = capsys.readouterr().out
    assert outputs(tmp_path) == {'a': 'good in it', 'e': 'good in it'}
    assert 'b.mcap: damaged' in out and 'exit code -9' in out and "ValueError('a bug')" in out and '4 bytes' in out
    assert out.splitlines()[-1] == '5 recordings: 2 done, 3 failed'


def test_a_second_start_does_what_is_left_alone(tasks, tmp_path, capsys):
    given = tasks(a='good', b='die once', c='good')
    assert run(given, 1, '') == FAILED and outputs(tmp_path).keys() == {'a', 'c'}
    (tmp_path / 'out/a').write_text('as it was')
    capsys.readouterr()
    assert run(given, 1, '') == 0
    assert outputs(tmp_path) == {'a': 'as it was', 'b': 'die once in it', 'c': 'good in it'}
    assert capsys.readouterr().out.splitlines()[-1] == '3 recordings: 1 done, 2 done before'


@pytest.fixture
def interruptible():
    """Ctrl-C interrupts, also where the tests are a shell's background job, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupted_one_is_not_taken_for_finished(interruptible, tasks, tmp_path, capsys):
    given, begin = tasks(a='good', b='interrupt', c='good'), time.monotonic()
    assert run(given, 1, '') == INTERRUPTED and time.monotonic() - begin < 30
    assert 'the same command continues' in capsys.readouterr().err and outputs(tmp_path).keys() == {'a'}
    assert run(given, 1, '') == 0 and outputs(tmp_path).keys() == {'a', 'b', 'c'}


def test_a_worker_of_a_cluster_that_is_killed_loses_nothing(tasks, tmp_path, capsys):
    distributed = pytest.importorskip('distributed', reason='distributed, an optional extra, is not installed: environment/extras.txt')
    given = tasks(a='good', b='die once', c='fail', d='good', e='good')
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        assert run(given, 1, cluster.scheduler_address) == FAILED
    assert outputs(tmp_path) == {'a': 'good in it', 'b': 'die once in it', 'd': 'good in it', 'e': 'good in it'}
    assert capsys.readouterr().out.splitlines()[-1] == '5 recordings: 4 done, 1 failed'


def test_recordings_are_found_in_folders_under_the_names_that_they_have_there(tmp_path):
    for name in ('day/one', 'day/more/two', 'day/.unfinished_x/three', 'other/one'):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / 'one_0.mcap').touch()
    (tmp_path / 'day/notes').mkdir()
    assert recordings([tmp_path / 'day']) == {'one': tmp_path / 'day/one', 'more/two': tmp_path / 'day/more/two'}
    assert recordings([tmp_path / 'other/one']) == {'one': tmp_path / 'other/one'}
    with pytest.raises(BadArgument, match='have one name'):
        recordings([tmp_path / 'day', tmp_path / 'other'])
    (tmp_path / 'empty/inner').mkdir(parents=True)
    with pytest.raises(BadArgument, match='no recording in this folder'):
        recordings([tmp_path / 'empty'])


@pytest.mark.parametrize('words, message', [(['--jobs', '0'], '--jobs 0'), (['--scheduler', 'tcp://x:1'], 'pip install distributed')])
def test_wrong_jobs_and_a_missing_dask_are_said(tmp_path, capsys, monkeypatch, words, message):
    monkeypatch.setattr('tactile_perception.tools.many.find_spec', lambda name: None)
    assert evaluate.main([str(tmp_path), *words]) == 1 and message in capsys.readouterr().err


def messages(bag):
    with BagReader(bag) as reader:
        return [(each.topic, each.stamp_ns, each.data) for each in reader.messages()]


def test_process_bag_of_a_folder_is_what_it_is_of_each_and_evaluate_takes_its_output(tmp_path, capsys):
    bags = [write_taxels(tmp_path / f'bags/{name}', frames=frames) for name, frames in (('a', 10), ('b', 12))]
    (tmp_path / 'bags/bad').mkdir()
    (tmp_path / 'bags/bad/bad_0.mcap').write_bytes(b'none')
    params = ['--params', f'{bags[0]}.yaml']
    assert process_bag.main([str(tmp_path / 'bags'), str(tmp_path / 'out'), '--jobs', '2', *params]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == '3 recordings: 2 done, 1 failed'
    assert sorted(path.name for path in (tmp_path / 'out').iterdir()) == ['a', 'b']
    for bag in bags:
        assert process_bag.main([str(bag), str(tmp_path / f'{bag.name}_alone'), *params]) == 0
        assert messages(tmp_path / 'out' / bag.name) == messages(tmp_path / f'{bag.name}_alone')
