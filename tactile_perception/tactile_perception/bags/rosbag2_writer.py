# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The library rosbags' writer of rosbag2 folders, with what `ros2 bag play` of Jazzy looks for: the distribution, and the QoS that was
offered on each topic, by which it chooses its own (rosbag2_storage, metadata version 9)."""
from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter

_DISTRO = 'ros_distro: jazzy'
_RECORDED_BY_LIBRARY = 'ros_distro: rosbags'
_FOR_EVER = QosTime(9223372036, 854775807)  # rmw's RMW_DURATION_INFINITE
_DEPTH = 10
_LATCHED = ('/tf_static', '/description')


def usual_qos(topic: str) -> Qos:
    """What is offered on a topic by all of this software: reliable; transient local where the last message has to reach late comers."""
    durability = QosDurability.TRANSIENT_LOCAL if topic.endswith(_LATCHED) else QosDurability.VOLATILE
    return Qos(QosHistory.KEEP_LAST, _DEPTH, QosReliability.RELIABLE, durability, _FOR_EVER, _FOR_EVER, QosLiveliness.AUTOMATIC, _FOR_EVER,
               False)


def recorded_qos(profile) -> Qos:
    """A publisher's rclpy.qos.QoSProfile as a bag tells it. History is unknown where the middleware does not tell it of others."""
    return Qos(QosHistory(profile.history.value), profile.depth, QosReliability(profile.reliability.value),
               QosDurability(profile.durability.value), _time(profile.deadline), _time(profile.lifespan),
               QosLiveliness(profile.liveliness.value), _time(profile.liveliness_lease_duration), profile.avoid_ros_namespace_conventions)


def _time(duration) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, 10**9))


class _JazzyMcap(McapWriter):
    """rosbags' own, whose file carries the metadata too."""

    def close(self, version: int, metadata: str) -> None:
        """End the file."""
        super().close(version, _of_jazzy(metadata))


class Rosbag2Writer(Writer):
    """Writes a new folder at path (MCAP); store: message definitions, which the file carries."""

    STORAGE_PLUGINS = {StoragePlugin.MCAP: _JazzyMcap}

    def __init__(self, path: Path, store):
        super().__init__(path, version=9, storage_plugin=StoragePlugin.MCAP)
        self._store = store

    def add_topic(self, topic: str, type_name: str, offered: Sequence[Qos] = ()) -> Connection:
        """What write() takes for messages of a topic. offered: by its publishers, the usual QoS where they are not known."""
        return self.add_connection(topic, type_name, typestore=self._store, offered_qos_profiles=list(offered) or [usual_qos(topic)])

    def close(self) -> None:
        """End the file and write metadata.yaml."""
        super().close()
        partial = self.metapath.with_suffix('.part')
        partial.write_text(_of_jazzy(self.metapath.read_text()))
        os.replace(partial, self.metapath)


def _of_jazzy(metadata: str) -> str:
    return metadata.replace(_RECORDED_BY_LIBRARY, _DISTRO)
