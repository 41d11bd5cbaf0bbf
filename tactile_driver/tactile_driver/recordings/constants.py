# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of recordings and of their format."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class RecordingConstants:
    """Constants of recordings and of their format."""

    max_reasons: int = constant(50, '1', 'limit', 'distinct reasons of skipped messages that are kept; further ones are counted together')
    header_bytes: int = constant(4, 'byte', 'numeric', 'encapsulation, from the end of which CDR counts its alignment')
    nested_type: int = constant(1, '1', 'numeric', 'type id of a nested message in a type description')
    types_per_kind: int = constant(48, '1', 'numeric',
                                   'type ids are those of one value, then of arrays, of bounded and of unbounded sequences, so far apart')
    metadata_version: int = constant(9, '1', 'numeric', 'version of the metadata of rosbag2 in Jazzy, in which QoS policies have names')
    depth: int = constant(10, '1', 'numeric', 'depth of the history that the metadata state for every topic')
    free_bytes: int = constant(1 << 20, 'byte', 'limit',
                               'no message is begun without so much room on the disk, because rosbag2 does not notice that one is cut')


RECORDINGS = RecordingConstants()
