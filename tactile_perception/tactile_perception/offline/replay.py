# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sensor's nodes without a middleware: messages in, (topic, message) out."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from tactile_driver.nodes.parameters import Parameter
from tactile_driver.stitching import Stitching, stitching_from_dict

from ..calibration.touch_file import read_touch
from ..calibration.psd_file import SENSOR as PSD_FINGER
from ..calibration.taxel_file import SENSOR as TAXEL_ARRAY
from ..nodes.psd_stages import PsdMessages
from ..nodes.taxel_stages import TaxelMessages
from ..nodes.touch_stages import TouchMessages
from ..nodes.touchpad_stages import ContactMessages, DotMessages
from ..pipeline.marker_parameters import POINT_PARAMETERS
from ..pipeline.parameter_file import read_parameters
from ..pipeline.parameters import DOT_PARAMETERS, REGION_PARAMETERS
from ..pipeline.psd_parameters import PSD_PARAMETERS
from ..pipeline.taxel_parameters import TAXEL_PARAMETERS
from ..touch.sensor import MARKER_SENSORS
from .stamped import IMAGE, VOLTAGES

SENSOR_TYPE = (Parameter('sensor_type', str, 'touchpad', '', 'kind of sensor'),)


class ContactSide(Protocol):
    """What follows the tracker: ContactMessages or TouchMessages."""

    def on_camera_info(self, message) -> None:
        """Take the camera."""

    def on_dots(self, message) -> dict[str, object]:
        """Topic -> message for one frame's dots."""


class Replay(Protocol):
    """The nodes of any sensor. raw, raw_type: topic and type of what its driver publishes; stitching: of two cameras, None of one."""

    raw: str
    raw_type: str
    stitching: Stitching | None

    def on_camera_info(self, message) -> None:
        """Take the camera."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one raw message."""


class PsdReplay:
    """The node of a PSD finger; values: of PSD_PARAMETERS."""

    raw, raw_type, stitching = 'voltages', VOLTAGES, None

    def __init__(self, values: dict):
        self._messages = PsdMessages(values)

    def on_camera_info(self, message) -> None:
        """There is no camera."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """The contacts of one block. Raises TactileError where the node would refuse it."""
        for contacts in self._messages.on_voltages(message):
            yield 'contacts', contacts


class TaxelReplay:
    """The node of a taxel array; values: of TAXEL_PARAMETERS."""

    raw, raw_type, stitching = 'image_raw', IMAGE, None

    def __init__(self, values: dict):
        self._messages = TaxelMessages(values)

    def on_camera_info(self, message) -> None:
        """There is no camera."""

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one image. Raises TactileError where the node would refuse it."""
        yield from self._messages.on_image(message).items()


class DotReplay:
    """The nodes of a sensor with printed dots; contact: None for one whose dots have no places in 3D,
    or that is not calibrated where it has to be; stitching: of two cameras, None of one."""

    raw, raw_type = 'image_raw', IMAGE

    def __init__(self, dots: DotMessages, contact: ContactSide | None, stitching: Stitching | None = None):
        self._dots, self._contact, self.stitching = dots, contact, stitching

    def on_camera_info(self, message) -> None:
        """As the nodes do."""
        self._dots.on_camera_info(message)
        if self._contact is not None:
            self._contact.on_camera_info(message)

    def on_raw(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one image. Raises TactileError where a node would refuse it."""
        dots = self._dots.on_image(message)
        yield 'dots', dots
        if self._contact is not None:
            yield from self._contact.on_dots(dots).items()


def make_replay(params: Path, calibration: Path | None = None) -> Replay:
    """The nodes that a parameter file describes; calibration: in place of the file that it names. Raises TactileError."""
    own = {'calibration': str(calibration)} if calibration else {}
    sensor_type = read_parameters(params, 'dot_tracker_node', SENSOR_TYPE)['sensor_type']
    if sensor_type == TAXEL_ARRAY:
        return TaxelReplay(read_parameters(params, 'taxel_contact_node', TAXEL_PARAMETERS) | own)
    if sensor_type == PSD_FINGER:
        return PsdReplay(read_parameters(params, 'psd_contact_node', PSD_PARAMETERS) | own)
    dots = DotMessages(read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS) | own)
    markers = dots.values['sensor_type'] in MARKER_SENSORS
    if markers and dots.values['calibration']:
        known = read_touch(dots.values['calibration'], dots.values['sensor_type'])
        touches = TouchMessages(read_parameters(params, 'contact_point_node', POINT_PARAMETERS) | own) if known.methods else None
        return DotReplay(dots, touches, known.stitching and stitching_from_dict(known.stitching, 'calibration: stitching'))
    if markers or dots.sensor.cap is None:
        return DotReplay(dots, None)
    return DotReplay(dots, ContactMessages(read_parameters(params, 'contact_region_node', REGION_PARAMETERS) | own))
