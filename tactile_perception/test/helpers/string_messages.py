# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Strings as serialised messages, for the tests of writers of bags."""
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPE = 'std_msgs/msg/String'


def encoded(text):
    return bytes(STORE.serialize_cdr(STORE.types[TYPE](data=text), TYPE))
