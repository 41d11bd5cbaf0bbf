# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Memory that killed processes have left behind, and its removal.

What a process sends waits in a segment of shared memory of its own: a file of 8 MB in /dev/shm, which Fast DDS removes only if the process
ends by itself. Beside it lies a file that its process holds locked. Without this a node that dies again and again would fill the memory.
"""
from __future__ import annotations

import fcntl
import os
import re
import time
from pathlib import Path

_FOLDER = Path('/dev/shm')
_LOCK = re.compile(r'fastrtps_([0-9a-f]{16})_el')
_NEW_S = 10.0  # the lock of one that begins may not be held yet


def remove_segments(folder: Path = _FOLDER) -> list[str]:
    """Remove the segments whose process is gone; gives their names. Who has one open goes on to read what is in it."""
    found = [match for match in map(_LOCK.fullmatch, os.listdir(folder) if folder.is_dir() else ()) if match]
    return [f'fastrtps_{match[1]}' for match in found if _removed(folder / match[0])]


def _removed(lock: Path) -> bool:
    try:
        if time.time() - os.stat(lock).st_mtime < _NEW_S:
            return False
        with open(lock) as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            Path(str(lock).removesuffix('_el')).unlink(missing_ok=True)
            lock.unlink()
    except OSError:  # in use, gone by now, or of another user
        return False
    return True
