# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that is written live: on a disk that is full for a while, by a process that is killed, and as any other."""
import os

import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from rosbags.rosbag2 import Reader  # noqa: E402
from tactile_perception.bags.rosbag import BagReader  # noqa: E402
from tactile_perception.nodes.messages.serialization import MessageCodec  # noqa: E402

from tactile_bringup.recording import live_bag  # noqa: E402
from tactile_bringup.recording.live_bag import LiveBag  # noqa: E402

SIZE = 100_000


@pytest.fixture
def disk(monkeypatch):
    """Free bytes; None for enough. Files lose nothing when they are cut."""
    free, write, cut = [None], os.pwrite, os.ftruncate

    def pwrite(file, data, at):
        if free[0] is None:
            return write(file, data, at)
        count = min(len(data), free[0])
        if not count:
            raise OSError(28, 'No space left on device')
        free[0] -= count
        return write(file, data[:count], at)

    def ftruncate(file, size):
        free[0] += max(os.fstat(file).st_size - size, 0)
        cut(file, size)
    monkeypatch.setattr(live_bag.os, 'pwrite', pwrite)
    monkeypatch.setattr(live_bag.os, 'ftruncate', ftruncate)
    monkeypatch.setattr(live_bag, '_AGAIN_S', 0.0)
    return free


@pytest.fixture
def bag(tmp_path):
    return LiveBag(tmp_path / 'bag', MessageCodec().store).__enter__()


def put(bag, number):
    """Whether message number was taken."""
    try:
        bag.write('/raw', 'std_msgs/msg/String', number, number.to_bytes(4, 'little') * (SIZE // 4))
    except OSError:
        return False
    return True


def numbers(path):
    """Of the messages in the bag; each has to be whole."""
    with BagReader(path) as reader:
        found = list(reader.messages())
    assert all(m.data == m.stamp_ns.to_bytes(4, 'little') * (SIZE // 4) for m in found)
    return [m.stamp_ns for m in found]


def test_as_any_other_bag(bag, tmp_path):
    assert all(put(bag, k) for k in range(1, 31))
    assert os.path.getsize(tmp_path / 'bag' / 'reserve') == 4 << 20
    bag.__exit__(None, None, None)
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == 30 and [stamp for _, stamp, _ in reader.messages()] == list(range(1, 31))
    assert sorted(os.listdir(tmp_path / 'bag')) == ['bag.mcap', 'metadata.yaml']


@pytest.mark.parametrize('free', [0, 1000, 1_500_000, 2_400_000])
def test_a_full_disk_costs_what_comes_while_it_is_full(bag, tmp_path, disk, free):
    disk[0] = free
    taken = {k for k in range(1, 60) if put(bag, k)}
    assert 10 <= len(taken) < 40 and taken == set(range(1, len(taken) + 1)), 'a chunk of 1 MB is kept, no more'
    disk[0] = None
    later = {k for k in range(60, 70) if put(bag, k)}
    assert len(later) == 10
    bag.__exit__(None, None, None)
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == len(taken | later)
    assert numbers(tmp_path / 'bag') == sorted(taken | later)


def test_a_disk_that_stays_full_leaves_what_was_written(bag, tmp_path, disk):
    assert all(put(bag, k) for k in range(1, 25))
    disk[0] = 50
    for k in range(25, 60):
        put(bag, k)
    with pytest.raises(OSError, match='No space'):
        bag.__exit__(None, None, None)
    assert numbers(tmp_path / 'bag') == list(range(1, 23))


def test_a_process_that_dies_loses_what_came_after_the_last_flush(bag, tmp_path):
    assert put(bag, 1) and put(bag, 2)
    bag.flush()
    assert put(bag, 3)
    assert numbers(tmp_path / 'bag') == [1, 2]
