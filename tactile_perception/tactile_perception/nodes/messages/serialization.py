# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Serialisation of messages without a node, for the tools that read and write bags."""
from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosidl_runtime_py.utilities import get_message

from ...errors import BadFrame


class MessageCodec:
    """Turns messages into bytes and back. store: the message definitions that a bag carries inside."""

    def __init__(self):
        self.store = get_typestore(Stores.ROS2_JAZZY)
        for file in sorted(Path(get_package_share_directory('tactile_msgs'), 'msg').glob('*.msg')):
            self.store.register(get_types_from_msg(file.read_text(), f'tactile_msgs/msg/{file.stem}'))

    def decode(self, data: bytes, type_name: str):
        """The message in CDR data. Raises BadFrame for data that cannot be decoded as that type."""
        try:
            return deserialize_message(data, get_message(type_name))
        except Exception as error:  # rclpy raises RuntimeError and others, by middleware
            raise BadFrame(f'{len(data)} bytes are no {type_name}: {error}') from error

    def encode(self, message) -> tuple[str, bytes]:
        """Type name and CDR bytes; equal messages give equal bytes (the middleware does not clear its padding)."""
        type_name = type_name_of(type(message))
        return type_name, bytes(self.store.serialize_cdr(self.store.deserialize_cdr(serialize_message(message), type_name), type_name))


def type_name_of(message_type: type) -> str:
    """'sensor_msgs/msg/Image' of a message class."""
    package, kind = message_type.__module__.split('.')[:2]
    return f'{package}/{kind}/{message_type.__name__}'
