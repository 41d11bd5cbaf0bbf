# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the stages of all camera sensors share on the side of messages: the camera, the clock, and when a stage begins anew."""
from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np
from sensor_msgs.msg import CameraInfo, Image
from tactile_msgs.msg import DotTracks

from ...common import dots
from ...errors import BadFrame
from ..messages import conversions as convert
from ...pipeline.clock import StampClock

Matrices = tuple[np.ndarray, np.ndarray]  # K (3, 3) and distortion (5,)


class CameraSide:
    """A stage that begins once the camera is known, and anew when another camera_info comes.

    values: of the node's parameters. Subclasses say in make_stage what the stage is, and in needs_places whether it can do without. A
    camera_info counts from the next message on: one among others that nothing follows changes nothing.
    """

    def __init__(self, values: Mapping):
        self.values = values
        self.stage = None
        self._camera, self._size = None, (0, 0)
        self._matrices: Matrices | None = None
        self._told: tuple | None = None  # of a camera_info that does not count yet: as told, matrices, size, stage
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
        """Whether messages have to wait for a camera_info: none has come, and the stage cannot do without."""
        return self._camera is None and self._told is None and self.stage is None and self.needs_places

    def on_camera_info(self, message: CameraInfo) -> None:
        """Take the camera's K and distortion. Raises BadFrame where they cannot be used."""
        key = (tuple(message.k), tuple(message.d), message.distortion_model, message.width, message.height)
        if key == self._camera:
            self._told = None
        elif self._told is None or key != self._told[0]:
            size, matrices = (message.width, message.height), convert.camera_matrices(message)
            if matrices is None and self._matrices is not None and size in ((0, 0), self._size):
                raise BadFrame('camera_info: k is zero, as of a camera that is not calibrated, but this one was: what it told before '
                               'stays; see that one publisher alone tells camera_info')
            self._told = key, matrices, size, self.make_stage(matrices, size)

    def take_camera(self, fits: Callable[[tuple[int, int]], bool]) -> None:
        """Let a camera_info that came since the last message count; fits: whether the present message can be of a camera of that size
        (width, height), px. One that does not fit is let go where the one before does."""
        if self._told is not None and (self._camera is None or fits(self._told[2]) or not fits(self._size)):
            self._camera, self._matrices, self._size, self.stage = self._told
        self._told = None

    def take_camera_of(self, tracks: dots.DotTracks) -> None:
        """take_camera for dots, which have to lie in the image."""
        self.take_camera(lambda size: not any(size) or bool((tracks.uv < size).all()))

    def begin_anew(self) -> None:
        """Forget all but the camera."""
        self.stage = self.make_stage(self._matrices, self._size if self._camera else None)

    @contextmanager
    def stamp_of(self, message: Image | DotTracks) -> Iterator[float]:
        """The message's stamp, s; the stage begins anew where stamps do. Raises ClockSetBack for the first that went back."""
        stamp_s = convert.stamp_seconds(message.header)
        with self._clock.at(stamp_s) as anew:
            if anew:
                self.begin_anew()
            yield stamp_s

    def check_size(self, image: np.ndarray) -> None:
        """Raise BadFrame where an image (H, W, ...) is not of the size, px, that camera_info is for (0 x 0: it does not say)."""
        if any(self._size) and image.shape[1::-1] != self._size:
            found, told = (f'{width} x {height} px' for width, height in (image.shape[1::-1], self._size))
            raise BadFrame(f'image is {found}, camera_info is for {told}; places in 3D would be wrong: publish camera_info of this size')
