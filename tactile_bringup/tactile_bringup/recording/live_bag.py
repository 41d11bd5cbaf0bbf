# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A bag that is written while a sensor runs: whatever happens to the disk or the process, what was written can be read."""
from __future__ import annotations

import os
import time
from pathlib import Path
from typing import BinaryIO

from tactile_perception.bags.rosbag import BagWriter

_AGAIN_S = 0.1  # between two tries to write to a disk that is full
_RESERVE = 4 << 20  # bytes: what waits for a disk that is full, and the index
_RESERVE_NAME = 'reserve'


class KeptFile:
    """What rosbags writes to: bytes are kept until settle has written them, all of them or none.

    file: of which the beginning is written; what follows it goes through this object alone.
    """

    def __init__(self, file: BinaryIO):
        file.flush()
        self._file, self._written, self._kept = file, file.tell(), bytearray()

    def write(self, data: bytes) -> int:
        """Keep data; how many bytes that was."""
        self._kept += data
        return len(data)

    def tell(self) -> int:
        """Where the next byte will be."""
        return self._written + len(self._kept)

    @property
    def waiting(self) -> bool:
        """Whether anything is kept."""
        return bool(self._kept)

    def settle(self) -> None:
        """Write what is kept. Raises OSError where it cannot be written: the file is then as it was before, and it stays kept."""
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
        """Settle and close the file; it is closed in any case."""
        try:
            self.settle()
        finally:
            self._file.close()


class LiveBag(BagWriter):
    """As BagWriter, with a file that is whole after each flush: a full disk costs the messages of that time, the death of the process
    those since the last flush. Some space is kept free from the start, so that there is an index in the end."""

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
        """Append one serialised message. Raises OSError, and does not take it, while what came before it cannot be written."""
        if self._full is not None:
            self._settle()
        super().write(topic, type_name, stamp_ns, data)
        if self._file.waiting:
            self.flush(end_chunk=False)

    def flush(self, end_chunk: bool = True) -> None:
        """Write what waits, as far as the disk takes it; end_chunk: also messages that rosbags gathers, up to 1 MB, before it hands them
        on."""
        if end_chunk and self._storage.chunk.msgs and self._full is None:
            self._storage.close_chunk()
        try:
            self._settle()
        except OSError:  # it is kept, and whoever writes the next message will hear of it
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
