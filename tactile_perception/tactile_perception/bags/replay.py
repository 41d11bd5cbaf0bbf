# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording run through the stage of its sensor, without ROS middleware: what the live node does, on messages of a bag."""
from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Collection, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

from sensor_msgs.msg import CameraInfo

from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import TRUTH_TYPES, BagReader, LeftOut, RawMessage, recorded_frame
from tactile_driver.recordings.serialization import decode, encode, type_name_of, unusable

from ..core.errors import BadArgument, BadFrame, BadRecording, TactileError, by_name
from ..core.parameter_files import all_values, check_sections, read_parameters
from ..core.sensor_type import NODES, SENSOR_TYPES
from ..core.stage import Stage
from ..dots.parameters import DOTS
from .stamped import find_prefix
from .stitched_bag import bag_opener

#: Topics that go with the estimates, in the sensor's namespace except /tf_static.
KEPT = ('/tf_static', 'description', 'camera_info', *(f'ground_truth/{name}' for name in TRUTH_TYPES))


def read_sensor_type(params: Path) -> str:
    """The sensor type that a parameter file states, for all nodes or for any of them; touchpad where it states none.

    Raises BadArgument for a file that cannot be read, or that states two.
    """
    stated = sorted({str(value) for name, value in all_values(params) if name == 'sensor_type'})
    if len(stated) > 1:
        raise BadArgument(f'{params}: it states the sensor types {", ".join(stated)}; a parameter file is of one sensor')
    return stated[0] if stated else 'touchpad'


def make_stage(params: Path, calibration: Path | None = None, **own: object) -> Stage:
    """The stage that a parameter file describes; calibration: replaces the file that params names; own: parameters that replace those of
    the file, where the stage has them. Raises TactileError."""
    kind = NODES[by_name(SENSOR_TYPES, read_sensor_type(params), f'{params}: sensor_type').perception]
    check_sections(params, kind.node)
    own |= {'calibration': str(calibration)} if calibration else {}
    names = {parameter.name for parameter in kind.parameters}
    return kind(read_parameters(params, kind.node, kind.parameters) | {name: value for name, value in own.items() if name in names})


class Replay:
    """The messages that come of a recording, one list for each message of the bag that is used: itself where it is kept, and the estimates
    where it is a raw one.

    bag: of raw data, or of dots alone; params, calibration: files as for make_stage; namespace: of the sensor, '' for the only one; topics:
    estimates that are wanted, None for all. prefix: '/ns/' of the sensor; raw: topic of its raw data; open(): a reader of the bag, with
    stitched views where the stitching is known. In the course of the iteration: done: number of raw messages; left_out: what could not be
    used; stages: s of thread time for each frame that was not refused, by stage. Raises TactileError for an unusable bag.
    """

    def __init__(self, bag: Path, params: Path, calibration: Path | None = None, namespace: str = '',
                 topics: Collection[str] | None = None):
        with BagReader(bag) as reader:
            own = {'input': DOTS} if _holds_dots_alone(reader.topics, namespace) else {}
        self._wanted, self._stage = topics, make_stage(params, calibration, reference_file='', **own)
        self.open = partial(bag_opener(params, self._stage.stitching), bag)
        with self.open() as reader:
            self.topics = reader.topics
            source = self._stage.input
            self.prefix = find_prefix(self.topics, namespace, source.topic, type_name_of(source.type))
            problems = {topic: unusable(kind, reader.hashes.get(topic, '')) for topic, kind in self.topics.items()}
        self.raw, self._info = self.prefix + source.topic, self.prefix + 'camera_info'
        for topic in (self.raw, self._info):
            if problems.get(topic):
                raise BadRecording(f'bag {bag}: {problems[topic]}')
        self._unusable = {topic: why for topic, why in problems.items() if why}
        self._side_topics = {side.topic for side in self._stage.side_inputs}
        self.done, self.left_out, self.stages = 0, LeftOut(), defaultdict(list)

    @property
    def outputs(self) -> set[str]:
        """Topics of the estimates."""
        return set(self._stage.outputs)

    def __iter__(self) -> Iterator[list[RawMessage]]:
        names = {name if name.startswith('/') else self.prefix + name: name for name in (*KEPT, *self._side_topics)}
        with self.open() as reader:
            self._stage.use_frame(recorded_frame(reader, self.prefix))
            with suppress(BadFrame):  # an unusable camera_info is reported when it is reached
                if 'camera_info' in self._side_topics:
                    self._stage.take('camera_info', self._first_camera_info(reader))
            for item in reader.messages({self.raw, *names}):
                yield self._estimated(item) if item.topic == self.raw else self._kept(item, names[item.topic])
            self.left_out.merge(reader.left_out)

    def _first_camera_info(self, reader: BagReader) -> CameraInfo:
        """The first camera_info of the recording, which may follow the first images; without one that which camera_node publishes for a
        camera that is not calibrated. Raises BadFrame for a damaged one."""
        for first in reader.messages({self._info} & set(self.topics)):
            return decode(first.data, first.type_name)
        for first in reader.messages({self.raw}):
            with suppress(BadFrame):
                height, width = image_to_array(decode(first.data, first.type_name)).shape[:2]
                return CameraInfo(width=width, height=height)
        return CameraInfo()

    def _kept(self, item: RawMessage, name: str) -> list[RawMessage]:
        """The message, which the stage takes, where it can be written again. A camera_info that contradicts the calibration raises
        BadCalibration, because no result would be valid."""
        try:
            if name in self._side_topics:
                item = item._replace(message=decode(item.data, item.type_name))
                self._stage.take(name, item.message)
        except BadFrame as error:
            self.left_out.add(name, str(error), item.stamp_ns)
            return []
        if name in KEPT and item.topic in self._unusable:
            self.left_out.add(name, self._unusable[item.topic], item.stamp_ns)
        return [item] if name in KEPT and item.topic not in self._unusable else []

    def _estimated(self, item: RawMessage) -> list[RawMessage]:
        """All that the stage estimates from a raw message."""
        self.done += 1
        name, begin = item.topic.removeprefix(self.prefix), time.thread_time()
        try:
            message = decode(item.data, item.type_name)
            decoded, refused = time.thread_time(), False
            found = self._stage.process(message, self._wanted and [topic for topic in self._stage.outputs if topic in self._wanted])
        except TactileError as error:
            self.left_out.add(name, str(error), item.stamp_ns)
            refused, found = True, getattr(error, 'partial', {})
        if not refused:
            end = time.thread_time()
            for stage, seconds in (('decoding', decoded - begin), ('estimating', end - decoded), ('all', end - begin)):
                self.stages[stage].append(seconds)
        return [RawMessage(self.prefix + topic, type_name, item.stamp_ns, data) for topic, results in found.items()
                for type_name, data in map(encode, results)]


def _holds_dots_alone(topics: Collection[str], namespace: str) -> bool:
    """Whether a sensor has dots among the topics, but neither images nor other raw data."""
    own = {topic.rsplit('/', 1)[-1] for topic in topics if topic.startswith(f'/{namespace.strip("/")}')}
    return 'dots' in own and not own & {'image_raw', 'compressed', 'voltages'}
