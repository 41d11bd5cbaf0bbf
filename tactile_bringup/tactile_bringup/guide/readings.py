# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor without calibration shows: that something touches, where its dots are deepest, and that its camera has moved."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from tactile_driver.nodes.messages.images import image_to_array
from tactile_msgs.msg import DotTracks, PsdVoltages
from tactile_perception.bags.replay import make_stage
from tactile_perception.core.errors import TactileError

from .constants import GUIDE


def signal_of(raw: Sequence[tuple[str, object]]) -> np.ndarray:
    """(M,) signal of the images, or of the block of voltages, of one time. Raises BadFrame for a damaged image."""
    parts = []
    for _, message in raw:
        if isinstance(message, PsdVoltages):
            parts.append(np.reshape(message.voltages, (-1, 4)).mean(axis=0))
            continue
        parts.append(reduced(message).ravel())
    return np.concatenate(parts).astype(np.float32)


def reduced(message: Image | CompressedImage) -> np.ndarray:
    """(H, 160) float32 grey of an image. Raises BadFrame for a damaged one."""
    image = image_to_array(message)
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.ndim == 3 else image
    height, width = grey.shape
    size = GUIDE.reduced_width, max(GUIDE.reduced_width * height // width, 1)
    return cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(np.float32)


def image_shift(before: np.ndarray, now: np.ndarray) -> float:
    """Shift of a reduced image of the untouched sensor, over its width; 0 for an image of another size, which others report."""
    return float(np.hypot(*cv2.phaseCorrelate(before, now)[0])) / GUIDE.reduced_width if before.shape == now.shape else 0.0


class CameraWatch:
    """Whether the cameras are calibrated and stand where they stood before the first press.

    info_topics: their topics of camera_info, none for sensors without; infos: the newest messages of these; untouched: an image of each
    camera before the first press, empty before it, None if the cameras may move.
    """

    def __init__(self, info_topics: Sequence[str], untouched: Sequence[Image] | None):
        self.info_topics, self.infos = info_topics, dict[str, CameraInfo]()
        self._views = None if untouched is None else [reduced(message) for message in untouched]

    def problem(self, untouched: Sequence[tuple[str, object]]) -> str:
        """The reason why a press after these untouched images does not count, or ''."""
        if not self.infos.keys() >= set(self.info_topics):
            return 'no camera_info arrived; calibrate the camera first'
        if self._views is None:
            return ''
        views = [reduced(message) for _, message in untouched if isinstance(message, Image)]
        self._views = self._views or views
        shift = max((image_shift(*pair) for pair in zip(self._views, views)), default=0.0)
        if shift > GUIDE.max_image_shift:
            return f'the camera has moved by {100 * shift:.1f} % of its image; put it back, or restart with another output'
        return ''


def pressed_position(params: Path, camera_info: CameraInfo, untouched: Sequence[object], touched: object) -> np.ndarray:
    """(2,) m, x and y in the sensor frame where the dots of a touched image are deepest below those of untouched images.

    Near the border the position is drawn towards the middle. NaN where the dots are not found or their heights are unknown.
    """
    stage = make_stage(params)
    try:
        stage.take('camera_info', camera_info)
        *_, before, now = [stage.process(image, ['dots'])['dots'][0] for image in (*untouched, touched)]
    except TactileError:
        return np.full(2, np.nan)
    return _deepest(before, now)


def _deepest(before: DotTracks, now: DotTracks) -> np.ndarray:
    if not len(before.x) or not len(now.x):
        return np.full(2, np.nan)
    _, rest, pressed = np.intersect1d(before.id, now.id, return_indices=True)
    weight = np.maximum(np.nan_to_num(np.subtract(np.take(before.z, rest), np.take(now.z, pressed))), 0)**GUIDE.depth_power
    if not weight.sum() > 0:
        return np.full(2, np.nan)
    return np.array([np.nansum(weight * np.take(values, rest)) for values in (before.x, before.y)]) / weight.sum()
