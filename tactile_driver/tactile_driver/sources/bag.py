# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The raw data of rosbag2 recordings, with their recorded stamps: images, voltages, taxel images."""
from __future__ import annotations

import posixpath
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import BadArgument, BadFrame, BadRecording
from ..frame import COMPRESSED, CameraCalibration, Frame, frame_of, matrix_frame
from ..nodes.messages.images import grey_to_array, image_to_array
from ..recordings.reader import BagReader, COMPRESSED_IMAGE, RawMessage, RecordedTruth, recorded_description, truth_topics, with_truth
from ..recordings.serialization import decode
from ..samples import CHANNELS, SampleBlock
from .source import NS, EndOfSource, EvenPace, Source, StampPace, wait_until

_IMAGE, _INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'


def choose_topic(types: dict[str, str], wanted: str, path: str, kinds: tuple[str, ...] = (_IMAGE, COMPRESSED_IMAGE),
                 content: str = 'image') -> str:
    """The topic to play, of types (topic -> type name).

    wanted: name of the topic, or its last part if that is unique; '': the only topic of the message types kinds, or the only image_raw
    among several. content: for error messages. Raises BadRecording, listing the topics, without a unique match.
    """
    images = sorted(name for name, kind in types.items() if kind in kinds)
    fitting = _named(images, wanted) or _named(images, wanted.removesuffix(COMPRESSED))
    if not wanted and len(fitting) > 1:
        fitting = [name for name in images if name.endswith('/image_raw')]
    if len(fitting) == 1:
        return fitting[0]
    listed = ', '.join(images) or 'none'
    if wanted:
        raise BadRecording(f'topic: {path} has no {content}s on {wanted!r}; its {content} topics: {listed}')
    raise BadRecording(f'topic: {path} has {len(images)} {content} topics ({listed}); ' + ('name one' if images else 'choose another bag'))


def _named(topics: list[str], wanted: str) -> list[str]:
    """The topics of that name, else those whose last part it is."""
    return [name for name in topics if wanted in ('', name, name.lstrip('/'))] or [name for name in topics if name.endswith('/' + wanted)]


class BagSource(Source):
    """Plays a rosbag2 folder or file, sqlite3 or MCAP; an unfinished one as far as rosbag2 reads it.

    topic: of sensor_msgs/Image or CompressedImage, '' if the bag has only one; rate: Hz; -1: as recorded; 0: as fast as consumed; loop:
    restart at the end (the stamps then go back). Raises BadArgument for an empty path.
    """

    kinds, content = (_IMAGE, COMPRESSED_IMAGE), 'image'

    def __init__(self, path: str, topic: str, rate: float, loop: bool):
        if not path:
            raise BadArgument('path: source bag needs the path of a rosbag2 folder')
        self.on_demand = rate == 0
        self._path, self._wanted, self._rate, self._loop = Path(path).expanduser(), topic, rate, loop
        self._reader = self._messages = self._calibration = self._pace = None
        self._topic, self._recorded = '', {}
        self._truth_topics: dict[str, str] = {}

    def open(self) -> None:
        """Open the bag at its start. Raises BadRecording if it is missing, unreadable or lacks the topic."""
        self.close()
        try:
            self._reader = BagReader(self._path).__enter__()
        except (BadRecording, OSError) as error:
            raise BadRecording(f'path: {self._path} is not a readable rosbag2 recording: {error}') from error
        types = self._reader.topics
        self._topic = choose_topic(types, self._wanted, str(self._path), self.kinds, self.content)
        self._calibration = self._recorded_calibration(types)
        self._truth_topics = truth_topics(types, self._topic)
        self._recorded = recorded_description(self._reader, self._topic)
        self._pace = EvenPace(self._rate, skip=False) if self._rate > 0 else StampPace() if self._rate < 0 else None
        self._start()

    def _start(self) -> None:
        self._messages = with_truth(self._reader.messages({self._topic, *self._truth_topics}), self._topic, self._truth_topics)

    def _recorded_calibration(self, types: dict[str, str]) -> CameraCalibration | None:
        beside = posixpath.join(posixpath.dirname(self._topic), 'camera_info')
        if types.get(beside) != _INFO:
            return None
        for found in self._reader.messages({beside}):
            try:
                info = decode(found.data, found.type_name)
            except BadFrame:
                continue
            numbers = (tuple(map(float, x)) for x in (info.k, info.d, info.r, info.p))
            return CameraCalibration(info.width, info.height, *numbers, info.distortion_model)
        return None

    @property
    def warning(self) -> str:
        """Damage found in the bag so far, '' without any."""
        return '; '.join(self._reader.left_out.lines()) if self._reader is not None else ''

    def read(self, wanted: bool = True) -> Frame | None:
        """The next frame, when it is due; None if not wanted. Raises EndOfSource, or BadFrame for a message without a valid image."""
        found, truth = self._next()
        message = self._decoded(found)
        stamp = message.header.stamp.sec * NS + message.header.stamp.nanosec or found.stamp_ns
        due = 0 if self._pace is None else self._pace.next(stamp)
        frame = self._frame(message, stamp) if wanted else None
        if frame is not None and truth is not None:
            frame = replace(frame, truth=truth)
        wait_until(due)
        return frame

    @property
    def truths(self) -> tuple[str, ...]:
        """See Source."""
        return tuple(self._truth_topics.values())

    def _next(self) -> tuple[RawMessage, RecordedTruth | None]:
        found = next(self._messages, None) if self._messages is not None else None
        if found is None and self._loop and self._reader is not None:
            self._start()
            found = next(self._messages, None)
        if found is None:
            raise EndOfSource(f'{self._path} is over')
        return found

    def _decoded(self, found: RawMessage):
        try:
            return decode(found.data, found.type_name)
        except BadFrame as error:
            raise BadFrame(f'a message of {self._topic} in {self._path} is broken ({error}); it is skipped') from error

    def _frame(self, message, stamp: int) -> Frame:
        place = f'the image of {self._topic} at {stamp} ns'
        return frame_of(image_to_array(message, place), place, stamp)

    def close(self) -> None:
        """Close the bag."""
        if self._reader is not None:
            self._reader.__exit__(None, None, None)
        self._reader = self._messages = None

    def describe(self) -> dict:
        """The path, the topic, the rate, Hz (-1: as recorded) and, once open, recorded: the recorded description of the sensor."""
        return {'source': 'bag', 'path': str(self._path), 'topic': self._topic, 'rate': self._rate, 'loop': self._loop,
                **({'recorded': self._recorded} if self._recorded else {})}

    def calibration(self) -> CameraCalibration | None:
        """The calibration in camera_info next to the image topic, None without one."""
        return self._calibration


_VOLTAGES = 'tactile_msgs/msg/PsdVoltages'


class PsdBagSource(BagSource):
    """A rosbag2 folder or file with tactile_msgs/PsdVoltages. Parameters as of BagSource; rate: messages/s."""

    kinds, content = (_VOLTAGES,), 'voltage'

    def _frame(self, message, stamp: int) -> SampleBlock:
        if len(message.voltages) % CHANNELS or not len(message.voltages):
            raise BadFrame(f'{len(message.voltages)} voltages at {stamp} ns; a sample has four; the message is skipped')
        volts = np.array(message.voltages, np.float32).reshape(-1, CHANNELS)
        return SampleBlock(volts, stamp, float(message.sample_period))


class TaxelBagSource(BagSource):
    """A rosbag2 folder or file with sensor_msgs/Image or CompressedImage in grey. Parameters as of BagSource; shape: (rows, columns)."""

    def __init__(self, path: str, topic: str, rate: float, loop: bool, shape: tuple[int, int]):
        super().__init__(path, topic, rate, loop)
        self._shape = shape

    def _frame(self, message, stamp: int) -> Frame:
        place = f'the image of {self._topic} at {stamp} ns'
        return matrix_frame(grey_to_array(message, place), self._shape, stamp, place)
