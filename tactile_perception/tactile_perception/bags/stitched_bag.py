# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads a recording of two cameras' views as if dual_camera_node had stitched them during recording."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from tactile_driver.camera.pairs import Pairer
from tactile_driver.frame import CameraCalibration, Frame, PairFrame, as_encoding
from tactile_driver.frame_names import stitched_frame
from tactile_driver.nodes.messages.conversions import (
    RIGHT_TIME,
    calibration_to_message,
    frame_of_message,
    header_of,
    image_to_message,
    right_time_message,
)
from tactile_driver.parameters.drivers import DUAL_CAMERA_PARAMETERS
from tactile_driver.recordings.reader import BagReader, RawMessage
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.stitching.calibration import Stitching, stitching_from_dict
from tactile_driver.stitching.methods import make_stitcher

from ..core.calibration_file import read_calibration
from ..core.errors import BadFrame
from ..core.parameter_files import read_parameters
from .stamped import IMAGES

VIEWS = ('left/image_raw', 'right/image_raw')
_MADE = {'image_raw': 'sensor_msgs/msg/Image', 'camera_info': 'sensor_msgs/msg/CameraInfo', RIGHT_TIME: 'sensor_msgs/msg/TimeReference'}


class StitchedBag(BagReader):
    """A bag in which left/image_raw and right/image_raw of a sensor appear as its image_raw, camera_info and right/time_reference.

    stitching, method: of the stitched picture; max_skew: largest difference of the stamps of a pair, s (see Pairer). A picture has the
    stamp of the left view. Recorded pictures of the same sensor, unusable views and views without a pair are left out. Raises as BagReader
    does.
    """

    def __init__(self, path: str | Path, stitching: Stitching, method: str, max_skew: float):
        super().__init__(path)
        self._stitcher = make_stitcher(method, stitching)
        self._max_skew = int(max_skew * 1e9)
        self._frame_ids: dict[str, str] = {}

    @property
    def topics(self) -> dict[str, str]:
        """Message type by topic."""
        recorded = super().topics
        for prefix in self._prefixes(recorded):
            recorded = {name: kind for name, kind in recorded.items() if name not in [prefix + view for view in VIEWS]}
            recorded |= {prefix + name: kind for name, kind in _MADE.items()}
        return recorded

    def messages(self, topics: set[str] | None = None) -> Iterator[RawMessage]:
        """Yield the messages of the given topics (None: all); a picture comes once both views have been read."""
        prefixes = [prefix for prefix in self._prefixes(super().topics) if topics is None or prefix + 'image_raw' in topics]
        sides = {prefix + view: (prefix, side) for prefix in prefixes for side, view in enumerate(VIEWS)}
        made = {prefix + name for prefix in prefixes for name in _MADE}
        pairers = {prefix: Pairer(self._max_skew) for prefix in prefixes}
        wanted = {*super().topics, *made} if topics is None else topics
        for raw in super().messages((wanted - made) | set(sides)):
            if raw.topic not in sides:
                yield raw
                continue
            prefix, side = sides[raw.topic]
            try:
                message = decode(raw.data, raw.type_name)
                self._frame_ids[prefix] = stitched_frame(message.header.frame_id)
                pairers[prefix].add(side, frame_of_message(message, 'image'))
            except BadFrame as error:
                self.left_out.add(raw.topic, str(error), raw.stamp_ns)
                continue
            yield from (one for one in self._pictures(prefix, pairers[prefix].take) if one.topic in wanted)
        for prefix, pairer in pairers.items():
            yield from (one for one in self._pictures(prefix, partial(pairer.take, last=True)) if one.topic in wanted)
            pairer.clear()
            if pairer.unpaired:
                why = pairer.warning or 'one camera\'s view without the other\'s'
                self.left_out.add(f'{prefix}left and right/image_raw', why, count=pairer.unpaired)

    @staticmethod
    def _prefixes(topics: dict[str, str]) -> list[str]:
        """'/ns/' of each sensor that has both views."""
        lefts = [name.removesuffix(VIEWS[0]) for name in topics if name.endswith('/' + VIEWS[0])]
        return sorted(prefix for prefix in lefts if all(topics.get(prefix + view) in IMAGES for view in VIEWS))

    def _pictures(self, prefix: str, take: Callable[[], PairFrame | None]) -> Iterator[RawMessage]:
        """Yield camera_info, right/time_reference and the stitched picture of each complete pair."""
        while (pair := take()) is not None:
            header = header_of(pair.stamp_ns, self._frame_ids[prefix])
            encoding = 'mono8' if pair.left.encoding == pair.right.encoding == 'mono8' else 'bgr8'
            try:
                picture = self._stitcher.stitch(as_encoding(pair.left, encoding), as_encoding(pair.right, encoding))
            except BadFrame as error:
                self.left_out.add(prefix + 'image_raw', str(error), pair.stamp_ns)
                continue
            info = calibration_to_message(CameraCalibration(*self._stitcher.size), header)
            for name, message in (('camera_info', info), (RIGHT_TIME, right_time_message(pair.right.stamp_ns, header)),
                                  ('image_raw', image_to_message(Frame(picture, pair.stamp_ns, encoding), '', header))):
                type_name, data = encode(message)
                yield RawMessage(prefix + name, type_name, pair.stamp_ns, data)


def bag_opener(params: Path, stitching: Stitching | None) -> Callable[[Path], BagReader]:
    """Function that opens a bag, with stitched views if a stitching is given. params: parameter file with those of dual_camera_node."""
    if stitching is None:
        return BagReader
    values = read_parameters(params, 'dual_camera_node', DUAL_CAMERA_PARAMETERS)
    return partial(StitchedBag, stitching=stitching, method=values['stitching'], max_skew=values['max_skew'])


def stitching_in(calibration: str | Path, sensor: str) -> Stitching | None:
    """Stitching in a calibration file of a sensor type; None without one or without a file.

    Raises BadCalibration for a bad file, BadArgument for an invalid stitching.
    """
    if not str(calibration):
        return None
    numbers = read_calibration(calibration, sensor).fitted.get('stitching')
    return None if numbers is None else stitching_from_dict(numbers, f'{calibration}: stitching')
