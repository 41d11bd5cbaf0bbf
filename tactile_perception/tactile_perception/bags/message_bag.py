# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes messages to a new bag."""
from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..nodes.messages.serialization import MessageCodec
from .rosbag import BagWriter


def write_messages(path: str | Path, namespace: str, messages: Iterable[tuple[int, str, object]]) -> None:
    """Write (stamp in ns, topic, message) to a new bag; topics without a leading / go under /namespace.

    Raises BadArgument for an existing bag.
    """
    codec, prefix = MessageCodec(), f'/{namespace.strip("/")}/'
    with BagWriter(path, codec.store) as writer:
        for stamp_ns, topic, message in messages:
            type_name, data = codec.encode(message)
            writer.write(topic if topic.startswith('/') else prefix + topic, type_name, stamp_ns, data)
