# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that stays readable when the disk fills up or the process is killed during recording."""
from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path
from tactile_driver.recordings.writer import AT_ONCE, BagWriter


_RESERVE = 4 << 20  # bytes, chosen: room for the end of the file and for metadata.yaml
_MARGIN = 1 << 20  # bytes, chosen: no message is begun without so much room, because rosbag2 does not notice one that is cut
_RESERVE_NAME = 'reserve'


class LiveBag(BagWriter):
    """BagWriter of a running sensor. Each message goes to the file at once: a killed process loses the last 4 KB, or the last message.

    A full disk loses the messages of that time. Space reserved on the disk lets the bag be closed all the same. Raises OSError if there is
    no room for that.
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

    def write(self, topic: str, type_name: str, stamp_ns: int, data: bytes) -> None:
        """Append one serialised message. Raises OSError and drops the message while the disk is full."""
        if shutil.disk_usage(self.path).free < len(data) + _MARGIN:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        super().write(topic, type_name, stamp_ns, data)
