# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Streams a recording with the results that the stages of a sensor compute from it."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tactile_driver.nodes.messages.conversions import RIGHT_TIME
from tactile_driver.recordings.description import recorded_frame
from tactile_driver.recordings.left_out import LeftOut
from tactile_driver.recordings.reader import BagReader, RawMessage
from tactile_driver.recordings.serialization import decode, encode, unusable

from ..errors import BadFrame, BadRecording, TactileError
from .replay import DotReplay, Replay, ReplayStage, TaxelReplay, make_replay
from .stamped import find_prefix
from .stitched_bag import bag_opener

TRANSFORMS = ('/tf', '/tf_static')  # these locate a grasped object
#: Topics copied to the output, in the sensor's namespace except /tf_static.
KEPT = ('/tf_static', 'description', 'camera_info', 'ground_truth/contacts', 'ground_truth/contact_region', 'ground_truth/slip',
        'ground_truth/wrench')


class Head(NamedTuple):
    """First item of a stream.

    prefix: '/ns/' of the sensor; frames: number of raw messages in the bag; unusable: reason by topic that cannot be written again;
    camera: first camera_info, which may follow the first images; None without one.
    """

    prefix: str
    frames: int
    unusable: dict[str, str]
    camera: RawMessage | None = None


class Skipped(NamedTuple):
    """A message that could not be used."""

    topic: str
    reason: str
    stamp_ns: int


class FrameDone(NamedTuple):
    """Marks the end of the results of one raw message."""


Item = Head | RawMessage | Skipped | FrameDone | LeftOut


@dataclass(frozen=True)
class Task:
    """A recording to process. source: bag; params, calibration: files as for make_replay; namespace: of the sensor, '' for the only one."""

    source: Path
    params: Path
    calibration: Path | None = None
    namespace: str = ''

    def replay(self) -> Replay:
        """The stages of the sensor. Raises TactileError."""
        return make_replay(self.params, self.calibration)

    def open(self, replay: Replay) -> BagReader:
        """Open the bag, with stitched views if the stitching is known. Raises TactileError."""
        return bag_opener(self.params, replay.stitching)(self.source)


def stream(task: Task) -> Iterator[Item]:
    """Yield a Head, then messages and results, and at last what of the bag could not be read. Raises TactileError for an unusable bag."""
    replay = task.replay()
    with task.open(replay) as reader:
        prefix = find_prefix(reader.topics, task.namespace, replay.raw, replay.raw_type)
        replay.use_frame(recorded_frame(reader, prefix))
        kept = {name if name.startswith('/') else prefix + name for name in KEPT}
        problems = {topic: unusable(kind, reader.hashes.get(topic, '')) for topic, kind in reader.topics.items()}
        for topic in (prefix + replay.raw, prefix + 'camera_info'):
            if problems.get(topic):
                raise BadRecording(f'bag {task.source}: {problems[topic]}')
        camera = {prefix + 'camera_info'} & set(reader.topics)
        head = Head(prefix, reader.count({prefix + replay.raw}), {topic: why for topic, why in problems.items() if why},
                    next(reader.messages(camera), None) if camera else None)
        yield head
        told = {*kept, *TRANSFORMS} if any(isinstance(stage, TaxelReplay) for stage in replay.stages) else kept
        items: Iterator[Item] = reader.messages({*told, prefix + replay.raw, prefix + RIGHT_TIME})
        for number, stage in enumerate(replay.stages):
            items = _computed(items, _begun(stage, head), number == 0, prefix)
        yield from items
        yield reader.left_out


def _computed(items: Iterator[Item], stage: ReplayStage, first: bool, prefix: str) -> Iterator[Item]:
    """Yield the items and, after each raw message of the stage, its results; the raw messages of the first stage are dropped."""
    raw, camera = prefix + stage.raw, prefix + 'camera_info'
    for item in items:
        if isinstance(item, RawMessage) and item.topic in TRANSFORMS:
            if isinstance(stage, TaxelReplay):
                yield from _tried(stage.on_transforms, item)
            if item.topic in KEPT:
                yield item
        elif isinstance(item, RawMessage) and item.topic == prefix + RIGHT_TIME:
            if isinstance(stage, DotReplay):
                yield from _tried(stage.on_right_time, item)
        elif isinstance(item, RawMessage) and item.topic in (raw, camera):
            yield from _taken(item, stage, item.topic == camera, first, prefix)
        else:
            yield item


def _tried(take: Callable[[object], None], item: RawMessage) -> Iterator[Item]:
    """Pass a message beside the raw ones to take; yield Skipped for an unusable one."""
    try:
        take(decode(item.data, item.type_name))
    except BadFrame as error:
        yield Skipped(item.topic, str(error), item.stamp_ns)


def _begun(stage: ReplayStage, head: Head) -> ReplayStage:
    """The stage with the recording's camera; an unusable camera_info is reported when the stream reaches it."""
    if head.camera is not None:
        with suppress(BadFrame):
            stage.on_camera_info(decode(head.camera.data, head.camera.type_name))
    return stage


def _taken(item: RawMessage, stage: ReplayStage, is_camera: bool, first: bool, prefix: str) -> Iterator[Item]:
    """Yield the items that result from one message of a stage.

    An unusable camera_info is skipped. One that contradicts the calibration raises BadCalibration, because no result would be valid.
    """
    topic = item.topic.removeprefix(prefix)
    if is_camera:
        try:
            message = item.message or decode(item.data, item.type_name)
            stage.on_camera_info(message)
            yield item._replace(message=message)
        except BadFrame as error:
            yield Skipped(topic, str(error), item.stamp_ns)
        return
    if not first:
        yield item
    try:
        for name, result in stage.on_raw(item.message or decode(item.data, item.type_name)):
            type_name, data = encode(result)
            yield RawMessage(prefix + name, type_name, item.stamp_ns, data, result)
    except TactileError as error:
        yield Skipped(topic, str(error), item.stamp_ns)
    if first:
        yield FrameDone()
