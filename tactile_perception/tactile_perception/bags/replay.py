# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's nodes without a middleware: messages in, (topic, message) out."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from tactile_driver.parameters.table import Parameter
from tactile_driver.stitching.calibration import Stitching, stitching_from_dict

from ..calibration.files.markers import read_touch
from ..calibration.files.psd import SENSOR as PSD_FINGER
from ..calibration.files.taxel import SENSOR as TAXEL_ARRAY
from ..markers.view.sensor import MARKER_SENSORS
from ..nodes.stages.markers import TouchMessages
from ..nodes.stages.psd import PsdMessages
from ..nodes.stages.taxel import TaxelMessages
from ..nodes.stages.touchpad import ContactMessages, DotMessages
from ..parameters.file import read_parameters
from ..parameters.markers import POINT_PARAMETERS
from ..parameters.psd import PSD_PARAMETERS
from ..parameters.taxel import TAXEL_PARAMETERS
from ..parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS
from .stamped import DOTS, IMAGE, VOLTAGES

SENSOR_TYPE = (Parameter('sensor_type', str, 'touchpad', '', 'kind of sensor'),)


class ReplayStage(Protocol):
    """One node without a middleware. raw, raw_type: topic and type of what it takes."""

    raw: str
    raw_type: str

    def on_camera_info(self, message) -> None:
        """Take the camera. Raises TactileError where it cannot be used."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one message. Raises TactileError where the node would refuse it."""


class Replay:
    """The nodes of any sensor, each of which takes what the one before makes.

    stages: at least one; stitching: of two cameras, None of one; raw, raw_type: topic and type of what the sensor's driver publishes.
    """

    def __init__(self, stages: Sequence[ReplayStage], stitching: Stitching | None = None):
        self.stages, self.stitching = list(stages), stitching
        self.raw, self.raw_type = stages[0].raw, stages[0].raw_type

    def on_camera_info(self, message) -> None:
        """As the nodes do."""
        for stage in self.stages:
            stage.on_camera_info(message)

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one raw message. Raises TactileError where a node would refuse it."""
        yield from self._from_stage(0, message)

    def _from_stage(self, number: int, message) -> Iterator[tuple[str, object]]:
        for name, result in self.stages[number].on_raw(message):
            yield name, result
            if number + 1 < len(self.stages) and name == self.stages[number + 1].raw:
                yield from self._from_stage(number + 1, result)


class PsdReplay:
    """The node of a PSD finger; values: of PSD_PARAMETERS."""

    raw, raw_type = 'voltages', VOLTAGES

    def __init__(self, values: dict):
        self._messages = PsdMessages(values)

    def on_camera_info(self, message) -> None:
        """There is no camera."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """The contacts of one block."""
        for contacts in self._messages.on_voltages(message):
            yield 'contacts', contacts


class TaxelReplay:
    """The node of a taxel array; values: of TAXEL_PARAMETERS."""

    raw, raw_type = 'image_raw', IMAGE

    def __init__(self, values: dict):
        self._messages = TaxelMessages(values)

    def on_camera_info(self, message) -> None:
        """There is no camera."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one image."""
        yield from self._messages.on_image(message).items()

    def on_transforms(self, message) -> None:
        """Where frames are, by which the grasped object is told. Raises BadFrame where the node would pass one over."""
        self._messages.on_transforms(message)


class DotReplay:
    """The node that tracks dots."""

    raw, raw_type = 'image_raw', IMAGE

    def __init__(self, dots: DotMessages):
        self._dots = dots

    def on_camera_info(self, message) -> None:
        """See ReplayStage."""
        self._dots.on_camera_info(message)

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """The dots of one image."""
        yield 'dots', self._dots.on_image(message)


class ContactReplay:
    """The node that follows the tracker."""

    raw, raw_type = 'dots', DOTS

    def __init__(self, contact: ContactMessages | TouchMessages):
        self._contact = contact

    def on_camera_info(self, message) -> None:
        """See ReplayStage."""
        self._contact.on_camera_info(message)

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one frame's dots."""
        yield from self._contact.on_dots(message).items()


def make_replay(params: Path, calibration: Path | None = None) -> Replay:
    """The nodes that a parameter file describes; calibration: in place of the file that it names. Raises TactileError.

    Nothing follows the tracker where dots have no places in 3D, or a sheet or dome is not calibrated.
    """
    own = {'calibration': str(calibration)} if calibration else {}
    sensor_type = read_parameters(params, 'dot_tracker_node', SENSOR_TYPE)['sensor_type']
    if sensor_type == TAXEL_ARRAY:
        return Replay([TaxelReplay(read_parameters(params, 'taxel_contact_node', TAXEL_PARAMETERS) | own)])
    if sensor_type == PSD_FINGER:
        return Replay([PsdReplay(read_parameters(params, 'psd_contact_node', PSD_PARAMETERS) | own)])
    dots = DotMessages(read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS) | own)
    markers, stitching, contact = dots.values['sensor_type'] in MARKER_SENSORS, None, None
    if markers and dots.values['calibration']:
        known = read_touch(dots.values['calibration'], dots.values['sensor_type'])
        stitching = known.stitching and stitching_from_dict(known.stitching, 'calibration: stitching')
        contact = TouchMessages(read_parameters(params, 'contact_point_node', POINT_PARAMETERS) | own) if known.methods else None
    elif not markers and dots.sensor.cap is not None:
        contact = ContactMessages(read_parameters(params, 'contact_region_node', REGION_PARAMETERS) | own)
    return Replay([DotReplay(dots), ContactReplay(contact)] if contact else [DotReplay(dots)], stitching)
