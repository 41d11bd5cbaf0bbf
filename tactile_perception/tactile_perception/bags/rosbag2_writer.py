# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writer of rosbag2 folders (metadata version 9, after rosbag2_storage): that of the library rosbags, completed for ROS 2 Jazzy.

`ros2 bag play` of Jazzy reads the distribution, and chooses its QoS by the recorded one of each topic.
"""
from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter

_DISTRO = 'ros_distro: jazzy'
_RECORDED_BY_LIBRARY = 'ros_distro: rosbags'
_FOR_EVER = QosTime(9223372036, 854775807)  # RMW_DURATION_INFINITE of rmw
_DEPTH = 10  # chosen
_LATCHED = ('/tf_static', '/description', '/camera_info')


def usual_qos(topic: str) -> Qos:
    """QoS that this software offers on a topic: reliable; transient local on topics whose last message late subscribers need."""
    durability = QosDurability.TRANSIENT_LOCAL if topic.endswith(_LATCHED) else QosDurability.VOLATILE
    return Qos(QosHistory.KEEP_LAST, _DEPTH, QosReliability.RELIABLE, durability, _FOR_EVER, _FOR_EVER, QosLiveliness.AUTOMATIC, _FOR_EVER,
               False)


def recorded_qos(profile) -> Qos:
    """Convert a publisher's rclpy.qos.QoSProfile to the form of a bag. The history is unknown where the middleware does not report it."""
    return Qos(QosHistory(profile.history.value), profile.depth, QosReliability(profile.reliability.value),
               QosDurability(profile.durability.value), _time(profile.deadline), _time(profile.lifespan),
               QosLiveliness(profile.liveliness.value), _time(profile.liveliness_lease_duration), profile.avoid_ros_namespace_conventions)


def _time(duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, 10**9))


class _JazzyMcap(McapWriter):
    """The writer of rosbags, which also writes the metadata to the MCAP file."""

    def close(self, version: int, metadata: str) -> None:
        """Close the file."""
        super().close(version, _of_jazzy(metadata))


class Rosbag2Writer(Writer):
    """Writes a new folder at path (MCAP); store: message definitions, which the file includes."""

    STORAGE_PLUGINS = {StoragePlugin.MCAP: _JazzyMcap}

    def __init__(self, path: Path, store):
        super().__init__(path, version=9, storage_plugin=StoragePlugin.MCAP)
        self._store = store

    def add_topic(self, topic: str, type_name: str, offered: Sequence[Qos] = ()) -> Connection:
        """Connection that write() takes for a topic; offered: QoS of its publishers, usual_qos when empty."""
        return self.add_connection(topic, type_name, typestore=self._store, offered_qos_profiles=list(offered) or [usual_qos(topic)])

    def close(self) -> None:
        """Close the file and write metadata.yaml."""
        super().close()
        partial = self.metapath.with_suffix('.part')
        partial.write_text(_of_jazzy(self.metapath.read_text()))
        os.replace(partial, self.metapath)


def _of_jazzy(metadata: str) -> str:
    return metadata.replace(_RECORDED_BY_LIBRARY, _DISTRO)
