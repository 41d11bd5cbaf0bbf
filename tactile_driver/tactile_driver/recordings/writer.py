# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes rosbag2 recordings (MCAP) with the QoS of their topics, by which `ros2 bag play` offers them again."""
from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

import yaml
from rosbag2_py import ConverterOptions, SequentialWriter, StorageOptions, TopicMetadata, to_rclcpp_qos_vector

from ..errors import BadArgument
from .constants import RECORDINGS
from .serialization import encode, type_hash

#: Presets of rosbag2's MCAP storage: compressed chunks; no chunks, so that each message goes to the file at once.
COMPRESSED, AT_ONCE = 'zstd_fast', 'fastwrite'
_FOR_EVER = {'sec': 9223372036, 'nsec': 854775807}  # RMW_DURATION_INFINITE of rmw
_TIMES = ('deadline', 'lifespan', 'liveliness_lease_duration')
_LATCHED = ('/tf_static', '/description', '/camera_info')


def usual_qos(topic: str) -> dict:
    """QoS that this software offers on a topic: reliable; transient local on topics whose last message late subscribers need."""
    durability = 'transient_local' if topic.endswith(_LATCHED) else 'volatile'
    return {'history': 'keep_last', 'depth': RECORDINGS.depth, 'reliability': 'reliable', 'durability': durability,
            'liveliness': 'automatic', **{name: dict(_FOR_EVER) for name in _TIMES}, 'avoid_ros_namespace_conventions': False}


def recorded_qos(profile) -> dict:
    """Convert a publisher's rclpy.qos.QoSProfile to the form of a bag. The history is unknown where the middleware does not report it."""
    names = {name: getattr(profile, name).name.lower() for name in ('history', 'reliability', 'durability', 'liveliness')}
    times = {name: dict(zip(('sec', 'nsec'), divmod(getattr(profile, name).nanoseconds, 10**9)))
             for name in _TIMES}
    return {**names, 'depth': profile.depth, **times, 'avoid_ros_namespace_conventions': profile.avoid_ros_namespace_conventions}


class BagWriter:
    """Writes a new rosbag2 folder; a context manager. preset: '', COMPRESSED or AT_ONCE.

    Raises BadArgument for an existing folder, as nothing recorded is overwritten, and for one that cannot be made.
    """

    def __init__(self, path: str | Path, preset: str = ''):
        if Path(path).exists():
            raise BadArgument(f'bag {path}: exists already; choose another name or remove it')
        self.path, self._preset, self._topics, self._writer = Path(path), preset, set(), SequentialWriter()

    def __enter__(self) -> BagWriter:
        try:
            self._writer.open(StorageOptions(uri=str(self.path), storage_id='mcap', storage_preset_profile=self._preset),
                              ConverterOptions())
        except RuntimeError as error:
            raise BadArgument(f'bag {self.path}: cannot be written: {error}') from error
        return self

    def __exit__(self, *_exc) -> None:
        try:
            self._writer.close()
        except RuntimeError as error:
            raise OSError(f'bag {self.path}: {error}') from error

    def add_topic(self, topic: str, type_name: str, offered: Sequence[dict] = ()) -> None:
        """Add a topic with the QoS that its publishers offer, before its first message; default: usual_qos."""
        qos = to_rclcpp_qos_vector(yaml.safe_dump(list(offered) or [usual_qos(topic)]), RECORDINGS.metadata_version)
        self._writer.create_topic(TopicMetadata(id=len(self._topics), name=topic, type=type_name, serialization_format='cdr',
                                                offered_qos_profiles=qos, type_description_hash=type_hash(type_name)))
        self._topics.add(topic)

    def write(self, topic: str, type_name: str, stamp_ns: int, data: bytes) -> None:
        """Append one serialised message; type_name such as 'sensor_msgs/msg/Image'. Raises OSError, and drops it, where that fails."""
        if shutil.disk_usage(self.path).free < len(data) + RECORDINGS.free_bytes:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.path))
        if topic not in self._topics:
            self.add_topic(topic, type_name)
        try:
            self._writer.write(topic, data, stamp_ns)
        except RuntimeError as error:
            raise OSError(f'bag {self.path}: {error}') from error


def write_messages(path: str | Path, namespace: str, messages: Iterable[tuple[int, str, object]]) -> None:
    """Write (stamp in ns, topic, message) to a new bag; topics without a leading / go under /namespace.

    Raises BadArgument for an existing bag.
    """
    prefix = f'/{namespace.strip("/")}/'
    with BagWriter(path) as writer:
        for stamp_ns, topic, message in messages:
            type_name, data = encode(message)
            writer.write(topic if topic.startswith('/') else prefix + topic, type_name, stamp_ns, data)
