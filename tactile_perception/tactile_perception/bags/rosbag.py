# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads and writes rosbag2 recordings as raw messages; the reader is that of tactile_driver."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rosbags.interfaces import Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode
from tactile_driver.recordings.compressed import ImageBagReader as BagReader
from tactile_driver.recordings.reader import RawMessage

from ..errors import BadArgument
from .rosbag2_writer import Rosbag2Writer

__all__ = ['BagReader', 'BagWriter', 'RawMessage']


class BagWriter:
    """Writes a new rosbag2 folder (MCAP); a context manager. Raises BadArgument for an existing folder: nothing recorded is overwritten.

    compressed: chunks compressed by zstd, a feature of MCAP that every reader supports.
    """

    def __init__(self, path: str | Path, store, compressed: bool = False):
        if Path(path).exists():
            raise BadArgument(f'bag {path}: exists already; choose another name or remove it')
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        self._writer = Rosbag2Writer(Path(path), store)
        if compressed:
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._connections = {}

    def __enter__(self) -> BagWriter:
        self._writer.open()
        return self

    def __exit__(self, *_exc) -> None:
        self._writer.close()

    def add_topic(self, topic: str, type_name: str, offered: Sequence[Qos] = ()) -> None:
        """Add a topic with the QoS that its publishers offer, before its first message; default: usual_qos."""
        self._connections[topic] = self._writer.add_topic(topic, type_name, offered)

    def write(self, topic: str, type_name: str, stamp_ns: int, data: bytes) -> None:
        """Append one serialised message; type_name such as 'sensor_msgs/msg/Image'."""
        if topic not in self._connections:
            self.add_topic(topic, type_name)
        self._writer.write(self._connections[topic], stamp_ns, data)
