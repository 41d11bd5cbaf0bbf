# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a recording of a hand says about its sensors: where each one's bag is, and whether it was simulated."""
from __future__ import annotations

from pathlib import Path

from tactile_driver.errors import BadArgument, TactileError
from tactile_perception.offline.bags import BagReader
from tactile_perception.offline.descriptions import descriptions


def bag_of(recording: str, namespace: str) -> str:
    """The bag with a sensor's topics: the recording itself, or the one in it that is named as the sensor's frame. Raises BadArgument where
    it holds nothing under that namespace."""
    whole = Path(recording).expanduser()
    own = whole / namespace.replace('/', '_')
    path = own if own.is_dir() else whole
    try:
        with BagReader(path) as bag:
            topics = set(bag.topics)
    except TactileError as error:
        raise BadArgument(' '.join(str(error).split())) from error
    if not any(topic.startswith(f'/{namespace}/') for topic in topics):
        raise BadArgument(f'{path} has no topic under /{namespace}; it has {", ".join(sorted(topics)) or "none"}')
    return str(path)


def was_simulated(bag_path: str, namespace: str) -> bool:
    """Whether the description in the bag says that the sensor was simulated."""
    return next(descriptions(bag_path, namespace), {}).get('source') == 'sim'
