# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording run through the stages of its sensor, without ROS middleware: what live nodes do, on messages of a bag."""
from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

from sensor_msgs.msg import CameraInfo
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.parameters.table import Parameter
from tactile_driver.recordings.reader import TRUTH_TYPES, BagReader, LeftOut, RawMessage, recorded_frame
from tactile_driver.recordings.serialization import decode, type_name_of, unusable

from ..errors import BadArgument, BadFrame, BadRecording, TactileError, by_name
from ..parameters.file import all_values, read_parameters
from ..sensor_type import NODES, SENSOR_TYPES
from ..stage import Stage
from .stamped import find_prefix
from .stitched_bag import bag_opener

_SURFACE = (Parameter('surface', str, 'cap', '', 'untouched shape'),)
#: Topics that go with the estimates, in the sensor's namespace except /tf_static.
KEPT = ('/tf_static', 'description', 'camera_info', *(f'ground_truth/{name}' for name in TRUTH_TYPES))


class Chain:
    """Stages of which each takes what the one before estimates; at least one. side_topics: those beside the raw one that they take."""

    def __init__(self, stages: Sequence[Stage]):
        self.stages = list(stages)
        self.side_topics = {side.topic for stage in self.stages for side in stage.side_inputs}

    def take(self, topic: str, message) -> None:
        """Pass a message of a side topic to the stages that take it. Raises TactileError for one that cannot be used."""
        for stage in self.stages:
            if topic in (side.topic for side in stage.side_inputs):
                stage.take(topic, message)

    def process(self, message, number: int = 0, topics: Collection[str] | None = None) -> Iterator[tuple[Stage, str, object]]:
        """Yield (stage, topic, estimate) of all that the stages from a number on estimate from one message, and (stage, its input, error)
        where a stage refuses its message; topics: those that are wanted, None for all."""
        stage = self.stages[number]
        inputs = {each.input.topic for each in self.stages}
        try:
            found = stage.process(message, topics and [topic for topic in stage.outputs if topic in topics or topic in inputs])
        except TactileError as error:
            yield stage, stage.input.topic, error
            return
        for topic, results in found.items():
            for result in results:
                yield stage, topic, result
                if number + 1 < len(self.stages) and topic == self.stages[number + 1].input.topic:
                    yield from self.process(result, number + 1, topics)


def read_sensor_type(params: Path) -> str:
    """The sensor type that a parameter file states, for all nodes or for any of them; touchpad where it states none.

    Raises BadArgument for a file that cannot be read, or that states two.
    """
    stated = sorted({str(value) for name, value in all_values(params) if name == 'sensor_type'})
    if len(stated) > 1:
        raise BadArgument(f'{params}: it states the sensor types {", ".join(stated)}; a parameter file is of one sensor')
    return stated[0] if stated else 'touchpad'


def make_chain(params: Path, calibration: Path | None = None) -> Chain:
    """The stages that a parameter file describes, without those whose parameters are not enough for them; calibration: replaces the file
    that params names. Raises TactileError."""
    name = read_sensor_type(params)
    if name not in SENSOR_TYPES and read_parameters(params, 'dot_tracker_node', _SURFACE)['surface'] in ('none', 'pins'):
        name = 'touchpad'  # a camera over dots of another sensor, as touchpad.launch.py plays it
    kinds = [NODES[node] for node in by_name(SENSOR_TYPES, name, f'{params}: sensor_type').perception]
    own = {'calibration': str(calibration)} if calibration else {}
    values = [read_parameters(params, kind.node, kind.parameters) | own for kind in kinds]
    return Chain([kind(given) for kind, given in zip(kinds, values) if kind.can_run(given)])


class Replay:
    """The messages that come of a recording, one list for each message of the bag that is used: itself where it is kept, and the estimates,
    not serialised yet, where it is a raw one.

    bag; params, calibration: files as for make_chain; namespace: of the sensor, '' for the only one; topics: estimates that are wanted,
    None for all. prefix: '/ns/' of the sensor; raw: topic of its raw data; open(): a reader of the bag, with stitched views where the
    stitching is known. In the course of the iteration: done: number of raw messages; left_out: what could not be
    used; stages: s of thread time for each frame that was not refused, by stage. Raises TactileError for an unusable bag.
    """

    def __init__(self, bag: Path, params: Path, calibration: Path | None = None, namespace: str = '',
                 topics: Collection[str] | None = None):
        self._wanted, self._chain = topics, make_chain(params, calibration)
        source, opened = self._chain.stages[0].input, bag_opener(params, self._chain.stages[0].stitching)
        self.open = partial(opened, bag)
        with self.open() as reader:
            self.topics = reader.topics
            self.prefix = find_prefix(self.topics, namespace, source.topic, type_name_of(source.type))
            problems = {topic: unusable(kind, reader.hashes.get(topic, '')) for topic, kind in self.topics.items()}
        self.raw, self._info = self.prefix + source.topic, self.prefix + 'camera_info'
        for topic in (self.raw, self._info):
            if problems.get(topic):
                raise BadRecording(f'bag {bag}: {problems[topic]}')
        self._unusable = {topic: why for topic, why in problems.items() if why}
        self.done, self.left_out, self.stages = 0, LeftOut(), defaultdict(list)

    @property
    def outputs(self) -> set[str]:
        """Topics of the estimates."""
        return {topic for stage in self._chain.stages for topic in stage.outputs}

    def __iter__(self) -> Iterator[list[RawMessage]]:
        names = {name if name.startswith('/') else self.prefix + name: name for name in (*KEPT, *self._chain.side_topics)}
        with self.open() as reader:
            for stage in self._chain.stages:
                stage.use_frame(recorded_frame(reader, self.prefix))
            with suppress(BadFrame):  # an unusable camera_info is reported when it is reached
                if 'camera_info' in self._chain.side_topics:
                    self._chain.take('camera_info', self._first_camera_info(reader))
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
        """The message, which the stages take, where it can be written again. A camera_info that contradicts the calibration raises
        BadCalibration, because no result would be valid."""
        try:
            if name in self._chain.side_topics:
                item = item._replace(message=decode(item.data, item.type_name))
                self._chain.take(name, item.message)
        except BadFrame as error:
            self.left_out.add(name, str(error), item.stamp_ns)
            return []
        if name in KEPT and item.topic in self._unusable:
            self.left_out.add(name, self._unusable[item.topic], item.stamp_ns)
        return [item] if name in KEPT and item.topic not in self._unusable else []

    def _estimated(self, item: RawMessage) -> list[RawMessage]:
        """All that the stages estimate from a raw message."""
        self.done += 1
        found, seconds, refused, last = [], defaultdict(float), False, time.thread_time()
        try:
            message = decode(item.data, item.type_name)
        except BadFrame as error:
            self.left_out.add(item.topic.removeprefix(self.prefix), str(error), item.stamp_ns)
            return []
        seconds['decoding'], last = time.thread_time() - last, time.thread_time()
        for stage, topic, result in self._chain.process(message, topics=self._wanted):
            seconds['dots' if 'dots' in stage.outputs else 'contact'] += time.thread_time() - last
            if isinstance(result, TactileError):
                refused = True
                self.left_out.add(topic, str(result), item.stamp_ns)
            else:
                found.append(RawMessage(self.prefix + topic, '', item.stamp_ns, b'', result))
            last = time.thread_time()
        for name, value in {} if refused else {**seconds, 'all': sum(seconds.values())}.items():
            self.stages[name].append(value)
        return found
