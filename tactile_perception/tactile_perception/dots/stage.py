# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of all sensors with dots: images in; numbered dots, and what the sensor's model of contact makes of them, out."""
from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import ClassVar, NamedTuple

from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from tactile_driver.nodes.messages.images import image_to_array
from tactile_msgs.msg import DotTracks as DotTracksMessage

from ..common import messages as convert
from ..common.camera_stage import CameraStage, Matrices
from ..common.dots import DotTracks
from ..core.errors import BadFrame
from ..core.stage import Input
from .kept_image import KeptImage
from .parameters import DOT_PARAMETERS, DOTS
from .tracker import DotTracker, tracker_options

_IMAGES = Input('image_raw', Image, depth=10)  # after a retransmission several arrive at once
_DOTS = Input('dots', DotTracksMessage, depth=1)


class Estimators(NamedTuple):
    """tracker: of dots in images, None where dots are the input; contact: the sensor's model, None where there is none yet."""

    tracker: DotTracker | None
    contact: object = None


class DotStage(CameraStage):
    """image_raw -> dots, in the sensor frame: dot_tracker_node, for patterns that belong to no other sensor type.

    The stage of a sensor type with a model of contact derives from it, names `contact_outputs`, and makes the model in `make_contact`. It
    takes dots in place of images where the parameter input says so. Raises BadArgument for wrong values.
    """

    node, parameters = 'dot_tracker_node', DOT_PARAMETERS
    input: Input = _IMAGES
    #: Topic -> type of what the model of contact estimates.
    contact_outputs: ClassVar[Mapping[str, type]] = {}
    needs_camera = False
    #: What is missing where there is no model of contact.
    without_contact: ClassVar[str] = ''

    def __init__(self, values: Mapping):
        super().__init__(values)
        self._takes_dots = values.get('input') == DOTS
        self.input = _DOTS if self._takes_dots else _IMAGES
        self.has_reference = not self._takes_dots
        self.outputs = ({} if self._takes_dots else {'dots': DotTracksMessage}) | dict(self.contact_outputs)
        self._frame_id = values['frame_id'] or values['sensor_type']
        self._kept = KeptImage(values.get('reference_file', ''))
        self._far = 0  # frames too far apart until the last call of health

    def use_frame(self, frame_id: str) -> None:
        """Name the sensor frame, unless the parameter frame_id does."""
        self._frame_id = self.values['frame_id'] or frame_id or self._frame_id

    def make_tracker(self, matrices: Matrices | None, size: tuple[int, int] | None) -> DotTracker:
        """The tracker of dots for a camera; see make_estimator."""
        return DotTracker(**tracker_options(self.values, image_only=True))

    def make_contact(self, matrices: Matrices | None, size: tuple[int, int] | None, tracker: DotTracker | None) -> object | None:
        """The model of contact for a camera, with process(tracks, stamp_s); None where there can be none. tracker: of the dots."""
        return None

    def make_estimator(self, matrices: Matrices | None, size: tuple[int, int] | None) -> Estimators:
        """See CameraStage."""
        tracker = None if self._takes_dots else self.make_tracker(matrices, size)
        return Estimators(tracker, self.make_contact(matrices, size, tracker))

    def estimate(self, message: Image | CompressedImage | DotTracksMessage, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of one image, or of the dots of one, under its stamp. A BadFrame of the model of contact holds the dots."""
        tracks, header = self._given(message) if self._takes_dots else self._tracked(message, stamp_s)
        found = {}
        try:
            if topics:
                found = self.estimate_contact(tracks, stamp_s, header, topics)
        except BadFrame as error:
            error.partial = self._dots(tracks, header, topics)
            raise
        return self._dots(tracks, header, topics) | found

    def estimate_contact(self, tracks: DotTracks, stamp_s: float, header: Header, topics: Collection[str]) -> dict[str, list]:
        """What the model of contact makes of the dots of one frame, for those of the topics that are its outputs. Raises BadFrame."""
        topics = [topic for topic in topics if topic in self.contact_outputs]
        if not topics:
            return {}
        if self.estimator.contact is None:
            raise BadFrame(self.without_contact)
        return convert.results_to_messages(self.estimator.contact.process(tracks, stamp_s), header, topics)

    def _given(self, message: DotTracksMessage) -> tuple[DotTracks, Header]:
        tracks = convert.tracks_from_message(message)
        self.use_camera_of(tracks)
        self._make_missing()
        return tracks, message.header

    def _tracked(self, message: Image | CompressedImage, stamp_s: float) -> tuple[DotTracks, Header]:
        image = image_to_array(message)
        self.use_camera(lambda size: not any(size) or size == image.shape[1::-1])
        self._make_missing()
        self.check_size(image)
        tracker = self.estimator.tracker
        kept = None if tracker.reference.taken else self._kept.read(image.shape)
        if kept is not None:
            with suppress(BadFrame):  # of other parameters
                tracker.process(kept, stamp_s - 1.0)
        tracks = tracker.process(image, stamp_s)
        self._kept.add(image)
        return tracks, Header(stamp=message.header.stamp, frame_id=self._frame_id)

    def _make_missing(self) -> None:
        """Do without a camera_info that has not come."""
        if self.estimator is None:
            self.estimator = self.make_estimator(None, None)

    def _dots(self, tracks: DotTracks, header: Header, topics: Collection[str]) -> dict[str, list]:
        return {'dots': [convert.tracks_to_message(tracks, header)]} if 'dots' in topics and not self._takes_dots else {}

    def check_change(self, values: Mapping) -> None:
        """Raise BadArgument for values with which no tracker can be made."""
        DotTracker(**tracker_options(values, image_only=True))

    def change(self, values: Mapping) -> None:
        """Make a new tracker, whose first images are its reference."""
        self.values.update(values)
        self.reset()

    def set_reference(self) -> None:
        """Take the next frame as the untouched state; an estimator that does not exist yet starts with that."""
        self._kept.remove()
        if self.estimator is not None:
            self.estimator.tracker.set_reference()

    def health(self) -> tuple[str, dict]:
        """Warns of a missing camera_info, of a reference that may have been taken under a contact, of dots without numbers, and of frames
        since the last call that were too far apart to follow all dots; reports which dots are tracked."""
        tracker = self.estimator and self.estimator.tracker
        if tracker is None:
            return '', {}
        warning, unnumbered, jumps = tracker.warning, tracker.unnumbered, tracker.jumps
        blind = 'no camera_info: dots have no 3D positions; publish camera_info beside image_raw' if (
            self.needs_camera and not self._camera) else ''
        before, self._far = self._far, tracker.links.far
        return unnumbered or blind or warning or (jumps if self._far > before else ''), {
            'reference': warning or 'in order', 'dots': tracker.found, 'numbers': unnumbered or 'certain', 'links': jumps or 'certain'}
