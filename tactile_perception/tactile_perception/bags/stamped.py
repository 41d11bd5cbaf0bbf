# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Groups messages of a recording by stamp, and finds the sensor's namespace."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from tactile_driver.recordings.reader import COMPRESSED_IMAGE, BagReader
from tactile_driver.recordings.serialization import decode

from ..common.progress import progress
from ..core.errors import BadCalibration, BadRecording

TRUTH, TRUE_WRENCH = 'ground_truth/contacts', 'ground_truth/wrench'
IMAGE, VOLTAGES = 'sensor_msgs/msg/Image', 'tactile_msgs/msg/PsdVoltages'
IMAGES = IMAGE, COMPRESSED_IMAGE


def pairs_of(bag: Path, namespace: str, wanted: tuple[str, ...], on_camera_info: Callable,
             open_bag: Callable[[Path], BagReader] = BagReader) -> Iterator[tuple[str, dict]]:
    """Yield ('bag at stamp', {topic: message}) for each stamp that has all wanted topics, in the order of completion.

    ground_truth/wrench is required too when the bag has it. on_camera_info(message) is called for each camera_info; open_bag: opens the
    bag. Raises BadCalibration for a bag without ground truth, BadRecording for one without images.
    """
    with open_bag(bag) as reader:
        prefix = find_prefix(reader.topics, namespace)
        if prefix + TRUTH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUTH}: calibration needs to know where the tool was')
        extra = {TRUE_WRENCH} & {topic.removeprefix(prefix) for topic in reader.topics}
        needed, waiting = {*wanted, *extra}, {}
        for raw in progress(reader.messages({prefix + name for name in (*needed, 'camera_info')}), f'messages of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            topic = raw.topic.removeprefix(prefix)
            if topic == 'camera_info':
                on_camera_info(message)
                continue
            stamp = f'{message.header.stamp.sec}.{message.header.stamp.nanosec:09d}'
            found = waiting.setdefault(stamp, {})
            found[topic] = message
            if len(found) == len(needed):
                yield f'{bag.name} at {stamp} s', waiting.pop(stamp)


def find_prefix(topics: dict[str, str], namespace: str, images: str = 'image_raw', raw_type: str = IMAGE) -> str:
    """'/ns/' of the sensor among topics (topic -> type) whose raw data are on images with type raw_type (or compressed).

    Two views beside the image that was stitched from them are not taken for sensors. Raises BadRecording without one, and for several
    without a namespace.
    """
    kinds = IMAGES if raw_type == IMAGE else (raw_type,)
    found = {topic.removesuffix(images) for topic, kind in topics.items() if topic.endswith('/' + images) and kind in kinds}
    found -= {prefix + view for prefix in found for view in ('left/', 'right/')}  # of which the node made the stitched image
    return choose_prefix(found, namespace, images)


def choose_prefix(found: set[str], namespace: str, topic: str) -> str:
    """'/ns/' of the namespace among those found, which have the topic; of the only one without a namespace. Raises BadRecording."""
    wanted, known = f'/{namespace.strip("/")}/'.replace('//', '/'), ', '.join(sorted(prefix + topic for prefix in found))
    if namespace and wanted not in found:
        raise BadRecording(f'no {wanted}{topic} in the bag; it has {known or f"no {topic} at all"}')
    if not namespace and len(found) != 1:
        raise BadRecording(f'the bag has {len(found)} topics {topic} ({known or "none"}): name one with --namespace')
    return wanted if namespace else next(iter(found))
