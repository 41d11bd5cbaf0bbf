# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The raw data of rosbag2 recordings, with their recorded stamps: images, voltages, taxel images."""
from __future__ import annotations

import posixpath
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..errors import BadFrame, BadRecording
from ..frame import CHANNELS, COMPRESSED, CameraCalibration, Frame, SampleBlock, calibration_of_info, frame_of, matrix_frame, sent_shape
from ..nodes.messages.images import grey_to_array, image_to_array
from ..recordings.reader import COMPRESSED_IMAGE, BagReader, RawMessage, RecordedTruth, recorded_description, truth_topics, with_truth
from ..recordings.serialization import decode
from .source import NS, Clock, PlayedSource

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


class BagSource(PlayedSource):
    """Plays a rosbag2 folder or file, sqlite3 or MCAP; an unfinished one as far as rosbag2 reads it. Its stamps are those recorded.

    values: as of PlayedSource, and topic: of sensor_msgs/Image or CompressedImage, '' if the bag has only one.
    """

    kinds, content = (_IMAGE, COMPRESSED_IMAGE), 'image'

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._values, self._topic, self._reader, self._calibration = values, '', None, None
        self._about, self._truth_topics = {}, {}

    def open(self) -> None:
        """Open the bag at its start. Raises BadRecording if it is missing, unreadable or lacks the topic."""
        try:
            self._reader = BagReader(self._path).__enter__()
        except (BadRecording, OSError) as error:
            raise BadRecording(f'path: {self._path} is not a readable rosbag2 recording: {error}') from error
        types = self._reader.topics
        self._topic = choose_topic(types, self._values['topic'], str(self._path), self.kinds, self.content)
        self._calibration, self._truth_topics = self._recorded_calibration(types), truth_topics(types, self._topic)
        recorded = recorded_description(self._reader, self._topic)
        self._about = {'recorded': recorded} if recorded else {}
        super().open()

    def _recorded_calibration(self, types: dict[str, str]) -> CameraCalibration | None:
        beside = posixpath.join(posixpath.dirname(self._topic), 'camera_info')
        for found in self._reader.messages({beside}) if types.get(beside) == _INFO else ():
            with suppress(BadFrame):
                return calibration_of_info(decode(found.data, found.type_name))
        return None

    def _items(self) -> Iterator[tuple[RawMessage, RecordedTruth | None]]:
        return with_truth(self._reader.messages({self._topic, *self._truth_topics}), self._topic, self._truth_topics)

    def _recorded(self, item: tuple[RawMessage, RecordedTruth | None]) -> tuple[int, tuple]:
        found, truth = item
        try:
            message = decode(found.data, found.type_name)
        except BadFrame as error:
            raise BadFrame(f'a message of {self._topic} in {self._path} is broken ({error}); it is skipped') from error
        stamp = message.header.stamp.sec * NS + message.header.stamp.nanosec or found.stamp_ns
        return stamp, (message, stamp, truth)

    def _frame(self, content: tuple, _due_ns: int) -> Frame | SampleBlock:
        message, stamp, truth = content
        return replace(self._of_message(message, stamp, f'the image of {self._topic} at {stamp} ns'), truth=truth)

    def _of_message(self, message, stamp: int, label: str) -> Frame | SampleBlock:
        return frame_of(image_to_array(message, label), label, stamp)

    @property
    def warning(self) -> str:
        """Damage found in the bag so far, '' without any."""
        return '; '.join(self._reader.left_out.lines()) if self._reader is not None else ''

    @property
    def truths(self) -> tuple[str, ...]:
        """See Source."""
        return tuple(self._truth_topics.values())

    def describe(self) -> dict:
        """The path, the topic, the rate, Hz (-1: as recorded) and, once open, recorded: the recorded description of the sensor."""
        return {**super().describe(), 'topic': self._topic, **self._about}

    def calibrations(self) -> tuple[CameraCalibration | None]:
        """The calibration in camera_info next to the image topic, None without one."""
        return (self._calibration,)


class PsdBagSource(BagSource):
    """A rosbag2 folder or file with tactile_msgs/PsdVoltages; rate: messages/s."""

    kinds, content = ('tactile_msgs/msg/PsdVoltages',), 'voltage'

    def _of_message(self, message, stamp: int, label: str) -> SampleBlock:
        if len(message.voltages) % CHANNELS or not len(message.voltages):
            raise BadFrame(f'{len(message.voltages)} voltages at {stamp} ns; a sample has four; the message is skipped')
        volts = np.array(message.voltages, np.float32).reshape(-1, CHANNELS)
        return SampleBlock(volts, stamp, float(message.sample_period))


class TaxelBagSource(BagSource):
    """A rosbag2 folder or file with sensor_msgs/Image or CompressedImage in grey, of the array's rows and columns."""

    def _of_message(self, message, stamp: int, label: str) -> Frame:
        return matrix_frame(grey_to_array(message, label), sent_shape(self._values), stamp, label)
