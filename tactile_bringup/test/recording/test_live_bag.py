# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that is written live: on a disk that is full for a while, by a process that is killed, and as any other."""
import os
import shutil
import signal
import subprocess
import sys
from collections import namedtuple

from tactile_bringup.nodes.record_node import LiveBag
from tactile_driver.recordings.reader import BagReader

SIZE = 100_000
WRITING = """
import sys, time
from tactile_bringup.nodes.record_node import LiveBag
bag = LiveBag(sys.argv[1]).__enter__()
for number in range(1, 51):
    bag.write('/raw', 'std_msgs/msg/String', number, number.to_bytes(4, 'little') * 1000)
print('written', flush=True)
time.sleep(600)
"""


def put(bag, number):
    """Whether message number was taken."""
    try:
        bag.write('/raw', 'std_msgs/msg/String', number, number.to_bytes(4, 'little') * (SIZE // 4))
    except OSError:
        return False
    return True


def numbers(path, size=SIZE):
    """Of the messages in the bag; each has to be whole."""
    with BagReader(path) as reader:
        found = list(reader.messages())
    assert all(m.data == m.stamp_ns.to_bytes(4, 'little') * (size // 4) for m in found)
    return [m.stamp_ns for m in found]


def test_as_any_other_bag(tmp_path):
    with LiveBag(tmp_path / 'bag') as bag:
        assert all(put(bag, k) for k in range(1, 31))
    assert numbers(tmp_path / 'bag') == list(range(1, 31))
    assert sorted(os.listdir(tmp_path / 'bag')) == ['bag_0.mcap', 'metadata.yaml']


def test_a_full_disk_costs_what_comes_while_it_is_full(tmp_path, monkeypatch):
    usage, disk = namedtuple('usage', 'free'), [1 << 30]
    monkeypatch.setattr(shutil, 'disk_usage', lambda _path: usage(disk[0]))
    with LiveBag(tmp_path / 'bag') as bag:
        assert all(put(bag, k) for k in range(1, 11))
        disk[0] = SIZE
        assert not any(put(bag, k) for k in range(11, 21))
        disk[0] = 1 << 30
        assert all(put(bag, k) for k in range(21, 31))
    assert numbers(tmp_path / 'bag') == [*range(1, 11), *range(21, 31)]


def test_a_process_that_is_killed_leaves_all_but_the_last_of_what_it_wrote(tmp_path):
    writing = subprocess.Popen([sys.executable, '-c', WRITING, str(tmp_path / 'bag')], stdout=subprocess.PIPE, text=True)
    assert writing.stdout.readline() == 'written\n'
    writing.send_signal(signal.SIGKILL)
    writing.wait()
    found = numbers(tmp_path / 'bag', 4000)
    assert found == list(range(1, len(found) + 1)) and len(found) >= 48
