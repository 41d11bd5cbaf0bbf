# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The base of the message stages of all camera sensors: camera_info, stamps, restarts."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np
import numpy.ma  # noqa: F401 - np.median loads it, 0.1 s for which the first image would wait otherwise
from sensor_msgs.msg import CameraInfo, Image
from tactile_msgs.msg import DotTracks

from ...common import dots
from ...errors import BadFrame
from ..messages import conversions as convert
from ...pipeline.clock import StampClock

Matrices = tuple[np.ndarray, np.ndarray]  # K (3, 3) and distortion (5,)


class CameraSide:
    """Makes its stage once the camera is known, and again for another camera_info.

    values: of the node's parameters. Subclasses define make_stage, and by needs_places whether the stage needs a camera. A camera_info
    takes effect with the next message, so that a single stray one has no effect.
    """

    def __init__(self, values: Mapping):
        self.values = values
        self.stage = None
        self._camera, self._size = None, (0, 0)
        self._matrices: Matrices | None = None
        self._pending: tuple | None = None  # a camera_info without effect yet: key, matrices, size, stage
        self._clock = StampClock()

    def make_stage(self, matrices: Matrices | None, size: tuple[int, int] | None):
        """The stage for a camera (None: not calibrated) with images of size (width, height) px; None where there can be none."""
        raise NotImplementedError

    @property
    def needs_places(self) -> bool:
        """Whether the stage works only with a camera."""
        raise NotImplementedError

    @property
    def needs_camera(self) -> bool:
        """Whether messages must wait for the first camera_info."""
        return self._camera is None and self._pending is None and self.stage is None and self.needs_places

    def on_camera_info(self, message: CameraInfo) -> None:
        """Take K and distortion of the camera. Raises BadFrame for invalid ones."""
        key = (tuple(message.k), tuple(message.d), message.distortion_model, message.width, message.height)
        if key == self._camera:
            self._pending = None
        elif self._pending is None or key != self._pending[0]:
            size, matrices = (message.width, message.height), convert.camera_matrices(message)
            if matrices is None and self._matrices is not None and size in ((0, 0), self._size):
                raise BadFrame('camera_info: k is zero, but the camera was calibrated before; the earlier camera_info stays in effect: '
                               'make sure that only one node publishes camera_info')
            self._pending = key, matrices, size, self.make_stage(matrices, size)

    def take_camera(self, fits: Callable[[tuple[int, int]], bool]) -> None:
        """Put the camera_info that arrived since the last message into effect; fits: whether the present message matches an image size
        (width, height), px. One that does not match is discarded where the earlier one does."""
        if self._pending is not None and (self._camera is None or fits(self._pending[2]) or not fits(self._size)):
            self._camera, self._matrices, self._size, self.stage = self._pending
        self._pending = None

    def take_camera_of(self, tracks: dots.DotTracks) -> None:
        """take_camera for dots, which must lie within the image."""
        self.take_camera(lambda size: not any(size) or bool((tracks.uv < size).all()))

    def begin_anew(self) -> None:
        """Forget all but the camera."""
        self.stage = self.make_stage(self._matrices, self._size if self._camera else None)

    @contextmanager
    def stamp_of(self, message: Image | DotTracks) -> Iterator[float]:
        """The message's stamp, s; restarts the stage where stamps restart. Raises ClockSetBack for the first that went back."""
        stamp_s = convert.stamp_seconds(message.header)
        with self._clock.at(stamp_s) as anew:
            if anew:
                self.begin_anew()
            yield stamp_s

    def check_size(self, image: np.ndarray) -> None:
        """Raise BadFrame where an image (H, W, ...) has not the size of camera_info, px (0 x 0: not known)."""
        if any(self._size) and image.shape[1::-1] != self._size:
            found, expected = (f'{width} x {height} px' for width, height in (image.shape[1::-1], self._size))
            raise BadFrame(f'image is {found}, camera_info is for {expected}; places in 3D would be wrong; publish one of this size')
