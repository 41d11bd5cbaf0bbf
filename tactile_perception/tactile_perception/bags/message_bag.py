# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that are made here as a new bag."""
from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..nodes.messages.serialization import MessageCodec
from .rosbag import BagWriter


def write_messages(path: str | Path, namespace: str, messages: Iterable[tuple[int, str, object]]) -> None:
    """Write (stamp, ns, topic, message), with topics that do not begin with / under /namespace, to a new bag. Raises BadArgument for one
    that exists."""
    codec, prefix = MessageCodec(), f'/{namespace.strip("/")}/'
    with BagWriter(path, codec.store) as writer:
        for stamp_ns, topic, message in messages:
            type_name, data = codec.encode(message)
            writer.write(topic if topic.startswith('/') else prefix + topic, type_name, stamp_ns, data)
