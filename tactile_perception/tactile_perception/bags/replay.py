# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the processing of a sensor's nodes without ROS middleware: messages in, (topic, message) out."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from tactile_driver.parameters.table import Parameter
from tactile_driver.recordings.serialization import type_name_of
from tactile_driver.stitching.calibration import Stitching, stitching_from_dict

from ..press.calibration import read_touch
from ..calibration.files.taxel import SENSOR as TAXEL_ARRAY
from ..finger.model import SENSOR as PSD_FINGER
from ..finger.stage import FingerStage
from ..press.sensor import MARKER_SENSORS
from ..nodes.stages.markers import TouchMessages
from ..nodes.stages.taxel import TaxelMessages
from ..nodes.stages.touchpad import ContactMessages, DotMessages
from ..parameters.file import read_parameters
from ..press.parameters import POINT_PARAMETERS
from ..parameters.taxel import TAXEL_PARAMETERS
from ..parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from ..stage import Stage
from .stamped import DOTS, IMAGE

SENSOR_TYPE = (Parameter('sensor_type', str, 'touchpad', '', 'kind of sensor'),)


class ReplayStage(Protocol):
    """Processing of one node; raw, raw_type: topic and type of its input."""

    raw: str
    raw_type: str

    def on_camera_info(self, message) -> None:
        """Use a camera's calibration. Raises TactileError for an unusable one."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Yield (topic, message) of all estimates from one message. Raises TactileError where the node would refuse it."""


class Replay:
    """Chain of the nodes of a sensor; each takes what the one before publishes.

    stages: at least one; stitching: of two cameras, None for one; raw, raw_type: topic and type of the driver's output.
    """

    def __init__(self, stages: Sequence[ReplayStage], stitching: Stitching | None = None):
        self.stages, self.stitching = list(stages), stitching
        self.raw, self.raw_type = stages[0].raw, stages[0].raw_type

    def on_camera_info(self, message) -> None:
        """Pass a camera's calibration to all stages."""
        for stage in self.stages:
            stage.on_camera_info(message)

    def on_right_time(self, message) -> None:
        """Pass the right exposure of a picture of two cameras to the dots. Raises BadFrame for an invalid time."""
        for stage in self.stages:
            if isinstance(stage, DotReplay):
                stage.on_right_time(message)

    def use_frame(self, frame_id: str) -> None:
        """Name the sensor frame, in which all results are; '' leaves what the stages have."""
        for stage in self.stages:
            if frame_id and isinstance(stage, DotReplay):
                stage.use_frame(frame_id)

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Yield all estimates from one raw message. Raises TactileError where a node would refuse it."""
        yield from self._from_stage(0, message)

    def _from_stage(self, number: int, message) -> Iterator[tuple[str, object]]:
        for name, result in self.stages[number].on_raw(message):
            yield name, result
            if number + 1 < len(self.stages) and name == self.stages[number + 1].raw:
                yield from self._from_stage(number + 1, result)


class StageReplay:
    """A Stage as a ReplayStage, until all sensors have one."""

    def __init__(self, stage: Stage):
        self._stage = stage
        self.raw, self.raw_type, self.on_camera_info = stage.input.topic, type_name_of(stage.input.type), stage.on_camera_info

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Yield the estimates from one message."""
        for topic, results in self._stage.process(message).items():
            yield from ((topic, result) for result in results)


class TaxelReplay:
    """Processing of a taxel array's node; values: of TAXEL_PARAMETERS."""

    raw, raw_type = 'image_raw', IMAGE

    def __init__(self, values: dict):
        self._messages = TaxelMessages(values)

    def on_camera_info(self, message) -> None:
        """Ignored: the sensor has no camera."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Yield all estimates from one image."""
        yield from self._messages.on_image(message).items()

    def on_transforms(self, message) -> None:
        """Use frame transforms, which locate the grasped object. Raises BadFrame for a transform that the node would skip."""
        self._messages.on_transforms(message)


class DotReplay:
    """Processing of the dot tracker's node."""

    raw, raw_type = 'image_raw', IMAGE

    def __init__(self, dots: DotMessages):
        self._dots = dots

    def on_camera_info(self, message) -> None:
        """See ReplayStage."""
        self._dots.on_camera_info(message)

    def on_right_time(self, message) -> None:
        """Use the right exposure of a picture of two cameras. Raises BadFrame for an invalid time."""
        self._dots.on_right_time(message)

    def use_frame(self, frame_id: str) -> None:
        """See Replay."""
        self._dots.frame_id = frame_id

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Yield the dots of one image."""
        yield 'dots', self._dots.on_image(message)


class ContactReplay:
    """Processing of the contact node, which follows the dot tracker."""

    raw, raw_type = 'dots', DOTS

    def __init__(self, contact: ContactMessages | TouchMessages):
        self._contact = contact

    def on_camera_info(self, message) -> None:
        """See ReplayStage."""
        self._contact.on_camera_info(message)

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Yield all estimates from the dots of one frame."""
        yield from self._contact.on_dots(message).items()


def make_replay(params: Path, calibration: Path | None = None) -> Replay:
    """The nodes that a parameter file describes; calibration: replaces the file that it names. Raises TactileError.

    The contact node is left out for dots without 3D positions, and for a sheet or a dome without a calibration.
    """
    own = {'calibration': str(calibration)} if calibration else {}
    sensor_type = read_parameters(params, 'dot_tracker_node', SENSOR_TYPE)['sensor_type']
    if sensor_type == TAXEL_ARRAY:
        return Replay([TaxelReplay(read_parameters(params, 'taxel_contact_node', TAXEL_PARAMETERS) | own)])
    if sensor_type == PSD_FINGER:
        return Replay([StageReplay(FingerStage(read_parameters(params, FingerStage.node, FingerStage.parameters) | own))])
    dots = DotMessages(read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS) | own)
    markers, stitching, contact = dots.values['sensor_type'] in MARKER_SENSORS, None, None
    if markers and dots.values['calibration']:
        known = read_touch(dots.values['calibration'], dots.values['sensor_type'])
        stitching = known.stitching and stitching_from_dict(known.stitching, 'calibration: stitching')
        contact = TouchMessages(read_parameters(params, 'contact_point_node', POINT_PARAMETERS) | own) if known.methods else None
    elif not markers and dots.sensor.cap is not None:
        contact = ContactMessages(read_parameters(params, 'contact_region_node', REGION_PARAMETERS) | own)
    return Replay([DotReplay(dots), ContactReplay(contact)] if contact else [DotReplay(dots)], stitching)
