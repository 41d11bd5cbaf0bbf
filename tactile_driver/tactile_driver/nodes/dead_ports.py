# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ports in shared memory that a killed process has left behind, and how not to take one of them over.

Fast DDS keeps the port of a process in /dev/shm, and a lock that ends with the process. The next process takes over a port whose lock is
free; but who had sent to the dead one goes on to write into its memory for up to three seconds before it looks again. So a node that is
started again would hear nothing, and would not be known to others, for as long (measured: 2.2 to 2.7 s to its first message, median of 8;
0.15 to 0.19 s with a port of its own).
"""
from __future__ import annotations

import fcntl
import os
import re
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

_FOLDER = Path('/dev/shm')
_NAME = re.compile(r'fastrtps_port(\d+)')
_LOCK = '_el'
_NEW_S = 0.2  # a port as young as this may be of a process that begins and has no lock yet
_REMEMBERED_S = 10.0  # by then nobody writes into it any more, and it may be taken over, which also removes it
_MOST = 8  # more ports than that left would move new ones out of the range in which processes look for each other
_FIRST_UDP = 7400  # from here on a port's number is that of a UDP port too, and the one below is of the same process


@contextmanager
def avoided(folder: Path = _FOLDER) -> Iterator[list[int]]:
    """Within, nobody on this machine takes over a port that was left lately; gives their numbers, the last ones first."""
    with ExitStack() as held:
        yield [number for number in _left(folder)[:_MOST] if _hold(folder / f'fastrtps_port{number}{_LOCK}', number, held)]


def _left(folder: Path) -> list[int]:
    """The ports that are there, but for new ones, youngest first. Most of them are in use."""
    found = []
    for name in os.listdir(folder) if folder.is_dir() else ():
        match = _NAME.fullmatch(name)
        if not match:
            continue
        try:
            made = os.stat(folder / name).st_mtime
        except OSError:  # its owner has removed it
            continue
        if time.time() - made > _NEW_S:
            found.append((made, int(match[1])))
    return [number for _, number in sorted(found, reverse=True)]


def _hold(lock: Path, number: int, held: ExitStack) -> bool:
    """Hold the lock, and with it the port's number, where nobody has it and its owner was not missed long ago."""
    try:
        file = held.enter_context(open(lock))
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        long_ago = _missed_s(lock) > _REMEMBERED_S
    except OSError:  # in use, gone by now, or of another user
        return False
    if long_ago:
        fcntl.flock(file, fcntl.LOCK_UN)
        return False
    for port in (number - 1, number) if number >= _FIRST_UDP else ():
        own = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        try:
            own.bind(('', port))
        except OSError:  # somebody else holds it, as well
            pass
    return True


def _missed_s(lock: Path) -> float:
    """How long ago its owner was first missed: that is kept as the time of the lock's last change, which at first is the port's own."""
    own, port = os.stat(lock).st_mtime, os.stat(str(lock).removesuffix(_LOCK)).st_mtime
    if own > port + _NEW_S / 2:
        return time.time() - own
    os.utime(lock)
    return 0.0
