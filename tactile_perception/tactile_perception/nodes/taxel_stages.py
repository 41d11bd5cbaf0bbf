# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel array's stage from message to message: what taxel_contact_node computes, process_bag computes by the same lines."""
from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Image
from tactile_msgs.msg import ContactRegion, Contacts, Slip

from ..errors import BadFrame
from ..pipeline.clock import StampClock
from ..pipeline.taxel_parameters import grasped_object, taxel_estimator
from . import conversions as convert

RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}
_TYPES = {'mono8': np.dtype(np.uint8), 'mono16': np.dtype(np.uint16)}


def taxel_values(message: Image) -> np.ndarray:
    """(rows, columns) uint8 or uint16 of an Image, a pixel a taxel. Raises BadFrame for another encoding or a cut frame."""
    if message.encoding not in _TYPES:
        raise BadFrame(f'taxel image: encoding {message.encoding!r} is not supported; the driver has to publish one of {", ".join(_TYPES)}')
    kind = _TYPES[message.encoding].newbyteorder('>' if message.is_bigendian else '<')
    width = message.width * kind.itemsize
    if message.height * message.step != len(message.data) or message.step < width or not message.height * message.width:
        raise BadFrame(f'taxel image: {len(message.data)} bytes do not make {message.height} rows of {message.width} {message.encoding} '
                       f'with {message.step} bytes a row; the frame is cut')
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)[:, :width]
    return np.ascontiguousarray(rows).view(kind)


class TaxelMessages:
    """image_raw -> contact_region, contacts, slip, wrench; values: of TAXEL_PARAMETERS."""

    def __init__(self, values: Mapping):
        self._values = dict(values)
        self._clock = StampClock()
        self.estimator = taxel_estimator(self._values)

    def on_image(self, message: Image, topics: Collection[str] = tuple(RESULTS)) -> dict[str, object]:
        """Topic -> message under the image's header, for the topics asked for. Raises BadFrame for an image that cannot be used."""
        values = taxel_values(message)
        stamp_s = convert.stamp_seconds(message.header)
        if self._clock.begins_anew(stamp_s):
            self.estimator = taxel_estimator(self._values)
        return convert.results_to_messages(self.estimator.process(values, stamp_s), message.header, topics)

    def set_object(self, changes: Mapping) -> None:
        """Take what has become known of the object; changes: of OBJECT_PARAMETERS. Raises BadArgument."""
        known = grasped_object(self._values | dict(changes))
        self._values.update(changes)
        self.estimator.grasped = known
