# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Streams a recording with the results that the stages of a sensor compute from it."""
from __future__ import annotations

import time
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tactile_driver.recordings.reader import BagReader, LeftOut, RawMessage, recorded_frame
from tactile_driver.recordings.serialization import decode, unusable

from ..errors import BadFrame, BadRecording, TactileError
from .chain import Chain, make_chain
from .stamped import find_prefix
from .stitched_bag import bag_opener

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
    """Marks the end of the results of one raw message. seconds: of thread time, by stage; {} where it was refused."""

    seconds: dict[str, float]


Item = Head | RawMessage | Skipped | FrameDone | LeftOut


@dataclass(frozen=True)
class Task:
    """A recording to process. source: bag; params, calibration: files as for make_chain; namespace: of the sensor, '' for the only one;
    topics: estimates that are wanted, None for all."""

    source: Path
    params: Path
    calibration: Path | None = None
    namespace: str = ''
    topics: Collection[str] | None = None

    def chain(self) -> Chain:
        """The stages of the sensor. Raises TactileError."""
        return make_chain(self.params, self.calibration)

    def open(self, chain: Chain) -> BagReader:
        """Open the bag, with stitched views if the stitching is known. Raises TactileError."""
        return bag_opener(self.params, chain.stitching)(self.source)


def stream(task: Task) -> Iterator[Item]:
    """Yield a Head, then messages, and results, which are not serialised yet, and at last what of the bag could not be read. Raises
    TactileError for an unusable bag."""
    chain = task.chain()
    with task.open(chain) as reader:
        prefix = find_prefix(reader.topics, task.namespace, chain.raw, chain.raw_type)
        chain.use_frame(recorded_frame(reader, prefix))
        names = {name if name.startswith('/') else prefix + name: name for name in (chain.raw, *KEPT, *chain.side_topics)}
        problems = {topic: unusable(kind, reader.hashes.get(topic, '')) for topic, kind in reader.topics.items()}
        for topic in (prefix + chain.raw, prefix + 'camera_info'):
            if problems.get(topic):
                raise BadRecording(f'bag {task.source}: {problems[topic]}')
        camera = {prefix + 'camera_info'} & set(reader.topics)
        head = Head(prefix, reader.count({prefix + chain.raw}), {topic: why for topic, why in problems.items() if why},
                    next(reader.messages(camera), None) if camera else None)
        yield head
        _begin(chain, head)
        for item in reader.messages(set(names)):
            yield from _used(item, names[item.topic], chain, prefix, task.topics)
        yield reader.left_out


def _begin(chain: Chain, head: Head) -> None:
    """Give the stages the recording's camera; an unusable camera_info is reported when the stream reaches it."""
    if head.camera is not None:
        with suppress(BadFrame):
            chain.take('camera_info', decode(head.camera.data, head.camera.type_name))


def _used(item: RawMessage, name: str, chain: Chain, prefix: str, topics: Collection[str] | None) -> Iterator[Item]:
    """Yield the items that result from one message of a topic called name: itself if it is kept, estimates if it is a raw one.

    An unusable message is skipped. A camera_info that contradicts the calibration raises BadCalibration, because no result would be valid.
    """
    if name in chain.side_topics:
        try:
            message = item.message or decode(item.data, item.type_name)
            chain.take(name, message)
            item = item._replace(message=message)
        except BadFrame as error:
            yield Skipped(name, str(error), item.stamp_ns)
            return
    if name in KEPT:
        yield item
    elif name == chain.raw:
        yield from _estimated(item, chain, prefix, topics)


def _estimated(item: RawMessage, chain: Chain, prefix: str, topics: Collection[str] | None) -> Iterator[Item]:
    """Yield the estimates of one raw message, and that it is done."""
    last, seconds, refused = time.thread_time(), {}, False
    try:
        message = item.message or decode(item.data, item.type_name)
    except BadFrame as error:
        yield Skipped(chain.raw, str(error), item.stamp_ns)
        yield FrameDone({})
        return
    seconds['decoding'] = time.thread_time() - last
    last = time.thread_time()
    for stage, topic, result in chain.process(message, topics=topics):
        name = 'dots' if 'dots' in stage.outputs else 'contact'
        seconds[name] = seconds.get(name, 0.0) + time.thread_time() - last
        if isinstance(result, TactileError):
            refused = True
            yield Skipped(topic, str(result), item.stamp_ns)
        else:
            yield RawMessage(prefix + topic, '', item.stamp_ns, b'', result)
        last = time.thread_time()
    yield FrameDone({} if refused else seconds)
