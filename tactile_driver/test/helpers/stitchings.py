# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A stitching for tests: two cameras 30 mm over a sheet of 40 x 20 mm that both see its middle, and pictures of what stands there."""
import cv2
import numpy as np

from tactile_driver.stitching.calibration import SideView, Stitching

SIZE = (96, 80)


def camera(x, turn, gain=1.0, distortion=(-0.05, 0.01, 0, 0, 0)):
    """A camera at (x, 0, -30 mm), turned by turn rad about its axis, that looks along z."""
    rotation, camera_centre = cv2.Rodrigues(np.array([0.0, 0.0, turn]))[0], np.array([x, 0.0, -0.03])
    matrix = np.array([[100.0, 0, 47.5], [0, 101, 39.5], [0, 0, 1]])
    homography = np.column_stack([rotation[:, :2], -rotation @ camera_centre])
    return SideView(SIZE, matrix, np.array(distortion, float), homography, camera_centre, gain)


def stitching(gains=(1.0, 1.0)):
    """131 x 61 px at 3 px/mm, the seam at the sensor's origin."""
    return Stitching(camera(-0.01, 0.03, gains[0]), camera(0.01, -0.02, gains[1]), (121, 61), 3000.0, np.array([60.0, 30.0]), 60.5,
                     (78.0, 17.0))


def view(side, level):
    """What a camera sees of a sheet with the grey level level(x, y), m: uint8 (H, W)."""
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    positions = side.place(np.stack([u, v], axis=-1).reshape(-1, 2))
    return np.clip(level(*positions.T).reshape(SIZE[::-1]).round(), 0, 255).astype(np.uint8)
