# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import fcntl
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tactile_driver.nodes.dead_segments import remove_segments

NAME = 'fastrtps_00000000deadbeef'
NODE = """
import rclpy
from rclpy.node import Node
from tactile_driver.nodes.run import make_room_for_images
make_room_for_images()
rclpy.init()
rclpy.spin((Node('sender'), print('up', flush=True))[0])
"""


@pytest.fixture
def leave(tmp_path):
    """leave(age): the files of a segment made so many s ago, whose process has ended; gives its lock."""
    def made(age=60.0):
        segment, lock = tmp_path / NAME, tmp_path / f'{NAME}_el'
        for file in (segment, lock):
            file.touch()
            os.utime(file, (time.time() - age,) * 2)
        return lock
    return made


def test_what_was_left_is_removed(leave, tmp_path):
    leave()
    assert remove_segments(tmp_path) == [NAME] and not os.listdir(tmp_path)


def test_one_in_use_and_one_of_a_process_that_begins_are_left_alone(leave, tmp_path):
    with open(leave()) as owner:
        fcntl.flock(owner, fcntl.LOCK_EX)
        assert remove_segments(tmp_path) == []
    leave(age=1.0)
    assert remove_segments(tmp_path) == [] and len(os.listdir(tmp_path)) == 2


def test_other_files_and_no_folder_at_all(tmp_path):
    for name in ('fastrtps_port7000_el', 'fastrtps_port7000', 'mine_el', f'{NAME}_elsewhere'):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (0, 0))
    assert remove_segments(tmp_path) == [] and len(os.listdir(tmp_path)) == 4
    assert remove_segments(tmp_path / 'none') == []


@pytest.mark.ros
def test_of_two_processes_the_segment_of_the_killed_one():
    pytest.importorskip('rclpy', reason='ROS is not sourced')
    environment, shared = {**os.environ, 'ROS_DOMAIN_ID': str(100 + os.getpid() % 100)}, Path('/dev/shm')
    processes = [subprocess.Popen([sys.executable, '-c', NODE], stdout=subprocess.PIPE, text=True, env=environment) for _ in range(2)]
    try:
        owned = []
        for process in processes:
            assert process.stdout.readline() == 'up\n'
            maps = Path(f'/proc/{process.pid}/maps').read_text()
            locks = {os.readlink(f'/proc/{process.pid}/fd/{fd}') for fd in os.listdir(f'/proc/{process.pid}/fd')}
            owned.append({path.name for path in shared.glob('fastrtps_????????????????') if str(path) in maps and f'{path}_el' in locks})
        processes[0].kill()
        processes[0].wait()
        for name in set.union(*owned):
            os.utime(shared / f'{name}_el', (0, 0))
        removed = remove_segments()
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert all(owned) and owned[0] <= set(removed) and not owned[1] & set(removed)
    assert not any((shared / name).exists() for name in owned[0])
