# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel array's stage on messages; taxel_contact_node and process_bag both run it."""
from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import CompressedImage, Image
from tactile_driver.nodes.messages.images import grey_to_array
from tactile_msgs.msg import ContactRegion, Contacts, Slip
from tf2_msgs.msg import TFMessage

from ...common.frame_tree import FrameTree
from ...errors import BadFrame
from ..messages import conversions as convert
from ..messages.point_cloud import POINTS
from ...parameters.taxel import frames_of, grasped_object, taxel_estimator
from ...pipeline.clock import StampClock

RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}


def taxel_values(message: Image | CompressedImage) -> np.ndarray:
    """(rows, columns) uint8 or uint16 of a grey image, a pixel a taxel. Raises BadFrame for another encoding or a truncated frame."""
    return grey_to_array(message, 'taxel image')


class TaxelMessages:
    """image_raw -> contact_region, contacts, slip, wrench, points; values: of TAXEL_PARAMETERS."""

    def __init__(self, values: Mapping):
        self._values = dict(values)
        self._clock, self._tree = StampClock(), FrameTree()
        self._placed: tuple[int, str] = (0, '')  # version of the tree, and sensor frame, in which the object is given
        self.estimator = taxel_estimator(self._values)

    def on_image(self, message: Image | CompressedImage, topics: Collection[str] = (*RESULTS, *POINTS)) -> dict[str, object]:
        """Topic -> message under the image's header, for the requested topics. Raises BadFrame for an image that cannot be used."""
        values = taxel_values(message)
        stamp_s = convert.stamp_seconds(message.header)
        with self._clock.at(stamp_s) as anew:
            if anew:
                self.begin_anew()
            self._place_object(message.header.frame_id)
            result = self.estimator.process(values, stamp_s)
        return convert.results_to_messages(result, message.header, topics)

    def begin_anew(self) -> None:
        """Forget all earlier frames."""
        self.estimator = taxel_estimator(self._values)
        self._placed = -1, ''

    def on_transforms(self, message: TFMessage) -> None:
        """Take transforms. Raises BadFrame for an invalid one, after the others of the message are taken."""
        refused = None
        for one in message.transforms:
            place, turn = one.transform.translation, one.transform.rotation
            try:
                self._tree.take(one.header.frame_id.lstrip('/'), one.child_frame_id.lstrip('/'), np.array([turn.x, turn.y, turn.z, turn.w]),
                                np.array([place.x, place.y, place.z]))
            except BadFrame as error:
                refused = error
        if refused is not None:
            raise refused

    def set_object(self, changes: Mapping) -> None:
        """Take new properties of the object; changes: of OBJECT_PARAMETERS. Raises BadArgument."""
        values = self._values | dict(changes)
        self.estimator.grasped = grasped_object(values, self._tree, self._placed[1])
        self._values = values

    @property
    def suspicion(self) -> str:
        """Why results may be wrong or missing; '' for no reason."""
        lost = [frame for frame in sorted(frames_of(self._values)) if self._tree.pose(frame, self._placed[1]) is None]
        missing = f'no transform leads from {" or ".join(lost)} to {self._placed[1]!r}: friction is NaN; publish it' if lost else ''
        return '; '.join(filter(None, (self.estimator.baseline.suspicion, missing)))

    def _place_object(self, sensor_frame: str) -> None:
        placed = self._tree.changes, sensor_frame.lstrip('/')
        if placed != self._placed and frames_of(self._values):
            self._placed = placed
            self.estimator.grasped = grasped_object(self._values, self._tree, placed[1])
