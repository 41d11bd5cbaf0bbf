# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two pictures of a small sheet of green discs, drawn from OpenCV's own projection of their outlines."""
import cv2
import numpy as np

from tactile_perception.common.marker_sensor import MarkerSensor

SENSOR = MarkerSensor(5, 8, (9.4e-3, 8.2e-3), (0.078, 0.046), type='areal_dual')
SIZE, FINE = (300, 330), 4
MATRIX = np.array([[286.0, 0, 151], [0, 285, 166], [0, 0, 1]])
DISTORTION = np.array([-0.03, 0.004, 0, 0, 0])
RADIUS = 2.1e-3
POSES = {'left': ((0.01, -0.02, -0.03), (-0.0165, 0.0, -0.046)), 'right': ((-0.01, 0.015, 0.02), (0.017, 0.001, -0.0455))}


def printed(tolerance=6e-5, seed=3):
    """(K, 2) m: where the markers really are."""
    grid = SENSOR.grid()
    return grid + np.random.default_rng(seed).normal(0, tolerance, grid.shape)


def pose(side):
    """Rotation (3, 3) and camera_centre (3,), m."""
    turn, camera_centre = POSES[side]
    return cv2.Rodrigues(np.array(turn))[0], np.array(camera_centre)


def picture(side, positions, brightness=150.0, noise=1.5, seed=0):
    """uint8 (H, W, 3) BGR of green discs at positions (K, 2), m."""
    rotation, camera_centre = pose(side)
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    fine = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    for position in positions:
        ring = np.column_stack([position + RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1), np.zeros(40)])
        uv = cv2.projectPoints(ring, rotation, -rotation @ camera_centre, MATRIX, DISTORTION)[0].reshape(-1, 2)
        cv2.fillPoly(fine, [np.round(((uv + 0.5) * FINE - 0.5) * 256).astype(np.int32)], 255, cv2.LINE_AA, 8)
    shape = cv2.GaussianBlur(cv2.resize(fine, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.8) / 255
    colour = 12 + shape[..., None] * brightness * np.array([0.35, 1.0, 0.3])
    return np.clip(colour + np.random.default_rng(seed).normal(0, noise, colour.shape), 0, 255).round().astype(np.uint8)
