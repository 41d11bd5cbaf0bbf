# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The base of the stages of camera sensors: what they compute depends on the camera, which its camera_info describes."""
from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.ma  # noqa: F401 - np.median loads it, 0.1 s for which the first image would wait otherwise
from sensor_msgs.msg import CameraInfo

from ..core.errors import BadFrame
from ..core.messages import camera_matrices
from ..core.stage import Input, Stage
from . import dots

#: Latched: the camera_info from before the subscription counts.
CAMERA_INFO = Input('camera_info', CameraInfo, depth=10, latched=True)
Matrices = tuple[np.ndarray, np.ndarray]  # K (3, 3) and distortion (5,)


class CameraStage(Stage):
    """Base of a stage whose estimator depends on the camera.

    The estimator is made once the camera is known, and again for another camera_info. A camera_info takes effect with the next message, so
    that a single stray one has no effect.

    Parameters
    ----------
    values : Mapping
        Values of the stage's parameters.

    Attributes
    ----------
    needs_camera : bool
        Whether there is no estimator without a calibrated camera.
    estimator : object or None
        What `make_estimator` returned.
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
        """Make the estimator for a camera.

        Parameters
        ----------
        matrices : tuple of ndarray, or None
            K (3, 3) in px and distortion (5,); None: not calibrated.
        size : tuple of int, or None
            Width and height of the images in px.

        Returns
        -------
        object or None
            None where there can be no estimator.
        """

    @property
    def side_inputs(self) -> Sequence[Input]:
        """The camera's calibration."""
        return (CAMERA_INFO,)

    @property
    def waits(self) -> bool:
        """Whether the first message should wait for camera_info."""
        return self._camera is None and self._pending is None and self.estimator is None and self.needs_camera

    def take(self, topic: str, message: CameraInfo) -> None:
        """Take K and distortion of the camera.

        Parameters
        ----------
        topic : str
            camera_info.
        message : CameraInfo
            Description of the camera.

        Raises
        ------
        BadFrame
            If the description is invalid, or a calibrated camera becomes uncalibrated.
        """
        key = (tuple(message.k), tuple(message.d), message.distortion_model, message.width, message.height)
        if key == self._camera:
            self._pending = None
        elif self._pending is None or key != self._pending[0]:
            size, matrices = (message.width, message.height), camera_matrices(message)
            if matrices is None and self._matrices is not None and size in ((0, 0), self._size):
                raise BadFrame('camera_info: k is zero, but the camera was calibrated before; the earlier camera_info stays in effect: '
                               'make sure that only one node publishes camera_info')
            self._pending = key, matrices, size, self.make_estimator(matrices, size)

    def use_camera(self, fits: Callable[[tuple[int, int]], bool]) -> None:
        """Put the camera_info that arrived since the last message into effect.

        Parameters
        ----------
        fits : callable
            Whether the present message matches an image size (width, height) in px. A camera_info that does not match is discarded if
            the earlier one matches.
        """
        if self._pending is not None and (self._camera is None or fits(self._pending[2]) or not fits(self._size)):
            self._camera, self._matrices, self._size, self.estimator = self._pending
        self._pending = None

    def use_camera_of(self, tracks: dots.DotTracks) -> None:
        """Put a new camera_info into effect for dots, which must lie within the image.

        Parameters
        ----------
        tracks : DotTracks
            Dots of the present message.
        """
        self.use_camera(lambda size: not any(size) or bool((tracks.uv < size).all()))

    def reset(self) -> None:
        """Drop all but the camera."""
        self.estimator = self.make_estimator(self._matrices, self._size if self._camera else None)

    def check_size(self, image: np.ndarray) -> None:
        """Check that an image has the size of camera_info.

        Parameters
        ----------
        image : ndarray, shape (H, W, ...)
            Present image; any size passes if that of camera_info is 0 x 0.

        Raises
        ------
        BadFrame
            If the sizes differ.
        """
        if any(self._size) and image.shape[1::-1] != self._size:
            found, expected = (f'{width} x {height} px' for width, height in (image.shape[1::-1], self._size))
            raise BadFrame(f'image is {found}, camera_info is for {expected}; positions in 3D would be wrong; publish one of this size')
