# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that stays readable when the disk fills up or the process is killed during recording."""
from __future__ import annotations

import os
from pathlib import Path

from tactile_driver.recordings.writer import AT_ONCE, BagWriter

_RESERVE = 4 << 20  # bytes, chosen: room for the end of the file and for metadata.yaml
_RESERVE_NAME = 'reserve'


class LiveBag(BagWriter):
    """BagWriter of a running sensor. A message goes to the file at once: a killed process loses the last message, or the last 4 KB.

    A full disk loses the messages of that time: write raises OSError. Space reserved on the disk lets the bag be closed all the same.
    """

    def __init__(self, path: str | Path):
        super().__init__(path, AT_ONCE)

    def __enter__(self) -> LiveBag:
        super().__enter__()
        with open(self.path / _RESERVE_NAME, 'wb') as file:
            os.posix_fallocate(file.fileno(), 0, _RESERVE)
        return self

    def __exit__(self, *exc) -> None:
        (self.path / _RESERVE_NAME).unlink(missing_ok=True)
        super().__exit__(*exc)
