# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that stays readable when the disk fills up or the process is killed during recording."""
from __future__ import annotations

import os
import time
from pathlib import Path
from typing import BinaryIO

from tactile_perception.bags.rosbag import BagWriter

_AGAIN_S = 0.1  # chosen: interval between two attempts to write to a full disk
_RESERVE = 4 << 20  # bytes, chosen: room for the messages that wait for a full disk, and for the index
_RESERVE_NAME = 'reserve'


class KeptFile:
    """File of a rosbags writer, with a buffer that settle writes completely or not at all.

    file: with its header already written; everything after that must go through this object.
    """

    def __init__(self, file: BinaryIO):
        file.flush()
        self._file, self._written, self._kept = file, file.tell(), bytearray()

    def write(self, data: bytes) -> int:
        """Add data to the buffer; the number of bytes."""
        self._kept += data
        return len(data)

    def tell(self) -> int:
        """Position of the next byte."""
        return self._written + len(self._kept)

    @property
    def waiting(self) -> bool:
        """Whether the buffer holds data."""
        return bool(self._kept)

    def settle(self) -> None:
        """Write the buffer. Raises OSError on failure; the file is then unchanged and the buffer is kept."""
        begin, view = self._written, memoryview(self._kept)
        try:
            while view:
                count = os.pwrite(self._file.fileno(), view, self._written)
                self._written, view = self._written + count, view[count:]
        except OSError:
            self._written = begin
            os.ftruncate(self._file.fileno(), begin)
            raise
        finally:
            view.release()
        self._kept = bytearray()

    def close(self) -> None:
        """Write the buffer and close the file, even if writing fails."""
        try:
            self.settle()
        finally:
            self._file.close()


class LiveBag(BagWriter):
    """BagWriter whose file is valid after each flush.

    A full disk loses the messages of that time; a killed process loses those since the last flush. Space reserved on the disk lets the
    index be written at the end.
    """

    def __enter__(self) -> LiveBag:
        super().__enter__()
        self._storage = self._writer.storage
        self._file = self._storage.bio = KeptFile(self._storage.bio)
        self._tried_s, self._full = 0.0, None
        self._reserve = Path(self._writer.path, _RESERVE_NAME)
        with open(self._reserve, 'wb') as file:
            os.posix_fallocate(file.fileno(), 0, _RESERVE)
        return self

    def __exit__(self, *exc) -> None:
        self._reserve.unlink(missing_ok=True)
        super().__exit__(*exc)

    def write(self, topic: str, type_name: str, stamp_ns: int, data: bytes) -> None:
        """Append one serialised message. Raises OSError and drops the message while the buffer cannot be written."""
        if self._full is not None:
            self._settle()
        super().write(topic, type_name, stamp_ns, data)
        if self._file.waiting:
            self.flush(end_chunk=False)

    def flush(self, end_chunk: bool = True) -> None:
        """Write the buffer as far as the disk takes it; end_chunk: also the messages, up to 1 MB, that rosbags collects first."""
        if end_chunk and self._storage.chunk.msgs and self._full is None:
            self._storage.close_chunk()
        try:
            self._settle()
        except OSError:  # the buffer is kept; the next write raises the error
            pass

    def _settle(self) -> None:
        if self._full is not None and time.monotonic() - self._tried_s < _AGAIN_S:
            raise self._full
        self._tried_s = time.monotonic()
        try:
            self._file.settle()
        except OSError as error:
            self._full = error
            raise
        self._full = None
