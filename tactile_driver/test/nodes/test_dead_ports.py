# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import fcntl
import os
import socket
import time

import pytest

from tactile_driver.nodes.dead_ports import avoided


@pytest.fixture
def leave(tmp_path):
    """leave(number, age): the files of a port made so many s ago, whose process has ended."""
    def made(number, age=60.0):
        port, lock = tmp_path / f'fastrtps_port{number}', tmp_path / f'fastrtps_port{number}_el'
        for file in (port, lock):
            file.touch()
            os.utime(file, (time.time() - age,) * 2)
        return lock
    return made


def taken(lock):
    """Whether a process that wants the port would find it in use."""
    with open(lock) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def test_what_was_left_is_held_and_then_let_go(leave, tmp_path):
    lock = leave(7001)
    with avoided(tmp_path) as numbers:
        assert numbers == [7001] and taken(lock)
    assert not taken(lock)


def test_the_udp_ports_of_the_same_number_are_held_too(leave, tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(('', 0))
        number = free.getsockname()[1]
    leave(number)
    with avoided(tmp_path), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other, pytest.raises(OSError):
        other.bind(('', number))


def test_a_port_in_use_and_one_of_a_process_that_begins_are_left_alone(leave, tmp_path):
    new = leave(7003, age=0.0)
    with open(leave(7002)) as owner:
        fcntl.flock(owner, fcntl.LOCK_EX)
        with avoided(tmp_path) as numbers:
            assert numbers == [] and not taken(new)


def test_ten_seconds_after_it_was_first_missed_it_may_be_taken_over(leave, tmp_path):
    lock = leave(7001)
    with avoided(tmp_path) as numbers:
        assert numbers == [7001]
    with avoided(tmp_path) as numbers:
        assert numbers == [7001], 'missed a moment ago'
    os.utime(lock, (time.time() - 11.0,) * 2)
    with avoided(tmp_path) as numbers:
        assert numbers == [] and not taken(lock)


def test_what_another_user_has_left_does_not_hinder(leave, tmp_path, monkeypatch):
    leave(7001)

    def refused(*_):
        raise PermissionError
    monkeypatch.setattr(os, 'utime', refused)
    with avoided(tmp_path) as numbers:
        assert numbers == []


def test_of_many_the_youngest_are_held(leave, tmp_path):
    for number in range(7000, 7020):
        leave(number, age=100.0 - (number - 7000))
    with avoided(tmp_path) as numbers:
        assert numbers == list(range(7019, 7011, -1))


def test_other_files_and_no_folder_at_all(leave, tmp_path):
    (tmp_path / 'fastrtps_00dd42d782de3840').touch()
    (tmp_path / 'fastrtps_port7001').touch()  # without a lock
    os.utime(tmp_path / 'fastrtps_port7001', (1e9, 1e9))
    for folder in (tmp_path, tmp_path / 'none'):
        with avoided(folder) as numbers:
            assert numbers == []
