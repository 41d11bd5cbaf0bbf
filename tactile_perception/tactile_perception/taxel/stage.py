# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel array's stage: images in, contact regions, contacts, slip and wrench out."""
from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from sensor_msgs.msg import CompressedImage, Image
from tactile_driver.nodes.messages.images import grey_to_array
from tf2_msgs.msg import TFMessage

from ..common.geometry import FrameTree
from ..errors import BadFrame
from ..nodes.messages import conversions as convert
from ..nodes.messages.point_cloud import POINTS
from ..stage import Input, Stage
from .parameters import TAXEL_PARAMETERS, frames_of, grasped_object, taxel_estimator

_TRANSFORMS = Input('/tf', TFMessage, depth=100), Input('/tf_static', TFMessage, depth=100, latched=True)


class TaxelStage(Stage):
    """image_raw -> contact_region, contacts, slip, wrench, points. Raises BadArgument for wrong values, BadCalibration for a bad file."""

    node, parameters = 'taxel_contact_node', TAXEL_PARAMETERS
    # Longer than usual, since slip is estimated from motion, so that no frame should be lost; chosen.
    input = Input('image_raw', Image, depth=100, patience_s=0.15)
    outputs = convert.RESULTS | POINTS

    def __init__(self, values: Mapping):
        super().__init__(values)
        self._tree = FrameTree()
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames."""
        self.estimator = taxel_estimator(self.values)
        self._placed: tuple[int, str] = (-1, '')  # version of the tree, and sensor frame, in which the object is given

    def set_reference(self) -> None:
        """Take the untouched reference from the next frames."""
        self.estimator.set_reference()

    @property
    def side_inputs(self) -> Sequence[Input]:
        """Frame transforms, where they locate the grasped object."""
        return _TRANSFORMS if frames_of(self.values) else ()

    def take(self, topic: str, message: TFMessage) -> None:
        """Take transforms. Raises BadFrame for an invalid one, after the others of the message are taken."""
        refused = None
        for one in message.transforms:
            at, turn = one.transform.translation, one.transform.rotation
            try:
                self._tree.take(one.header.frame_id.lstrip('/'), one.child_frame_id.lstrip('/'), np.array([turn.x, turn.y, turn.z, turn.w]),
                                np.array([at.x, at.y, at.z]))
            except BadFrame as error:
                refused = error
        if refused is not None:
            raise refused

    def estimate(self, message: Image | CompressedImage, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """The estimates of one image, under its header."""
        values = grey_to_array(message, 'taxel image')
        self._place_object(message.header.frame_id)
        return convert.results_to_messages(self.estimator.process(values, stamp_s), message.header, topics)

    def check_change(self, values: Mapping) -> None:
        """Raise BadArgument unless values describe an object."""
        grasped_object(values)

    def change(self, values: Mapping) -> None:
        """Take new properties of the object. Raises BadArgument."""
        self.estimator.grasped = grasped_object(values, self._tree, self._placed[1])
        self.values = dict(values)

    def health(self) -> tuple[str, dict]:
        """Warns of a reference that may have been taken under a touch, and of missing transforms."""
        baseline, sensor_frame = self.estimator.baseline, self._placed[1]
        lost = [frame for frame in sorted(frames_of(self.values)) if self._tree.pose(frame, sensor_frame) is None]
        missing = f'no transform leads from {" or ".join(lost)} to {sensor_frame!r}: friction is NaN; publish it' if lost else ''
        return '; '.join(filter(None, (baseline.warning, missing))), {'reference': baseline.warning or 'in order',
                                                                        'noise (values)': baseline.sigma}

    def _place_object(self, sensor_frame: str) -> None:
        placed = self._tree.changes, sensor_frame.lstrip('/')
        if placed != self._placed and frames_of(self.values):
            self._placed = placed
            self.estimator.grasped = grasped_object(self.values, self._tree, placed[1])
