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

_WIDTH = 160  # px of the reduced image: small motions of a dot change it smoothly, and the noise of pixels is averaged
_DEPTH_POWER = 5  # of the weight of a dot: the position is 0.35 mm RMS off on a sheet; with 3 it is 0.6, with 12 0.45


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
    return cv2.resize(grey, (_WIDTH, max(_WIDTH * height // width, 1)), interpolation=cv2.INTER_AREA).astype(np.float32)


def image_shift(before: np.ndarray, now: np.ndarray) -> float:
    """Shift of a reduced image of the untouched sensor, over its width; 0 for an image of another size, which others report."""
    return float(np.hypot(*cv2.phaseCorrelate(before, now)[0])) / _WIDTH if before.shape == now.shape else 0.0


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
    weight = np.maximum(np.nan_to_num(np.subtract(np.take(before.z, rest), np.take(now.z, pressed))), 0)**_DEPTH_POWER
    if not weight.sum() > 0:
        return np.full(2, np.nan)
    return np.array([np.nansum(weight * np.take(values, rest)) for values in (before.x, before.y)]) / weight.sum()
