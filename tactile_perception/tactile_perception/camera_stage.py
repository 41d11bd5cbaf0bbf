# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The base of the stages of camera sensors: what they compute depends on the camera, which its camera_info describes."""
from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.ma  # noqa: F401 - np.median loads it, 0.1 s for which the first image would wait otherwise
from sensor_msgs.msg import CameraInfo

from .common import dots
from .errors import BadFrame
from .nodes.messages import conversions as convert
from .stage import Input, Stage

#: Latched: the camera_info from before the subscription counts.
CAMERA_INFO = Input('camera_info', CameraInfo, depth=10, latched=True)
Matrices = tuple[np.ndarray, np.ndarray]  # K (3, 3) and distortion (5,)


class CameraStage(Stage):
    """Makes its estimator once the camera is known, and again for another camera_info.

    needs_camera: whether it has none without a camera. A camera_info takes effect with the next message, so that a single stray one has
    no effect.
    """

    needs_camera = True

    def __init__(self, values: Mapping):
        super().__init__(values)
        self.estimator = None
        self._camera, self._size = None, (0, 0)
        self._matrices: Matrices | None = None
        self._pending: tuple | None = None  # a camera_info without effect yet: key, matrices, size, estimator

    @abstractmethod
    def make_estimator(self, matrices: Matrices | None, size: tuple[int, int] | None):
        """The estimator for a camera (None: not calibrated) with images of size (width, height) px; None where there can be none."""

    @property
    def side_inputs(self) -> Sequence[Input]:
        """The camera's calibration."""
        return (CAMERA_INFO,)

    @property
    def waits(self) -> bool:
        """Whether the first message should wait for camera_info."""
        return self._camera is None and self._pending is None and self.estimator is None and self.needs_camera

    def take(self, topic: str, message: CameraInfo) -> None:
        """Take K and distortion of the camera. Raises BadFrame for invalid ones."""
        key = (tuple(message.k), tuple(message.d), message.distortion_model, message.width, message.height)
        if key == self._camera:
            self._pending = None
        elif self._pending is None or key != self._pending[0]:
            size, matrices = (message.width, message.height), convert.camera_matrices(message)
            if matrices is None and self._matrices is not None and size in ((0, 0), self._size):
                raise BadFrame('camera_info: k is zero, but the camera was calibrated before; the earlier camera_info stays in effect: '
                               'make sure that only one node publishes camera_info')
            self._pending = key, matrices, size, self.make_estimator(matrices, size)

    def use_camera(self, fits: Callable[[tuple[int, int]], bool]) -> None:
        """Put the camera_info that arrived since the last message into effect; fits: whether the present message matches an image size
        (width, height), px. One that does not match is discarded where the earlier one does."""
        if self._pending is not None and (self._camera is None or fits(self._pending[2]) or not fits(self._size)):
            self._camera, self._matrices, self._size, self.estimator = self._pending
        self._pending = None

    def use_camera_of(self, tracks: dots.DotTracks) -> None:
        """use_camera for dots, which must lie within the image."""
        self.use_camera(lambda size: not any(size) or bool((tracks.uv < size).all()))

    def reset(self) -> None:
        """Drop all but the camera."""
        self.estimator = self.make_estimator(self._matrices, self._size if self._camera else None)

    def check_size(self, image: np.ndarray) -> None:
        """Raise BadFrame where an image (H, W, ...) has not the size of camera_info, px (0 x 0: not known)."""
        if any(self._size) and image.shape[1::-1] != self._size:
            found, expected = (f'{width} x {height} px' for width, height in (image.shape[1::-1], self._size))
            raise BadFrame(f'image is {found}, camera_info is for {expected}; positions in 3D would be wrong; publish one of this size')
