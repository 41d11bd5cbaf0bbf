# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a pad full of red water, made by ray and lamp: what tests of the optics and of calibration measure themselves against."""
import cv2
import numpy as np
import pytest

from tactile_perception.common.camera import CameraModel
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.geometry import Cap

WIDTH, HEIGHT, FOCAL = 480, 360, 525.0
ROWS = COLUMNS = 17
SPACING = 1.7e-3
INK, DOT_PX, LAMPS = 0.12, 5.0, 9


class WaterPad:
    """A camera 40 mm below the rim of a cap, lamps around it, a window, red water; each lamp and each channel fades on its own.

    A ball pressed in dents the pad sharply: the wall is where ball or cap comes first, so every range is known without a membrane.
    """

    def __init__(self, absorption=(43.0, 33.0, 5.0), window=-0.011, lamp_radius=0.014, ambient=0.3, gain=(400, 330, 230),
                 noise=1.0, seed=1):
        self.absorption, self.window, self.lamp_radius, self.ambient = np.array(absorption), window, lamp_radius, ambient
        self.gain, self.noise, self.rng = np.array(gain, float), noise, np.random.default_rng(seed)
        matrix = np.array([[FOCAL, 0, WIDTH / 2 - 3], [0, FOCAL, HEIGHT / 2 + 2], [0, 0, 1.0]])
        self.camera = CameraModel(matrix, translation=np.array([2e-4, -1e-4, 0.040]))
        self.cap = Cap()
        v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
        self.pixels = np.column_stack([u.ravel(), v.ravel()]).astype(float)
        self.pixel_rays = self.camera.rays(self.pixels)
        side = (np.arange(ROWS) - ROWS // 2) * SPACING
        x, y = (part.ravel() for part in np.meshgrid(side, side))
        rest = np.column_stack([x, y, self.cap.centre_z + np.sqrt(self.cap.curvature_radius**2 - x**2 - y**2)])
        self.rest_uv = self.camera.project(rest)
        self.ink = self._ink()

    def _ink(self):
        distance = np.full(HEIGHT * WIDTH, np.inf)
        for position in self.rest_uv:
            distance = np.minimum(distance, np.hypot(*(self.pixels - position).T))
        return 1 - (1 - INK) / (1 + np.exp((distance - DOT_PX) / 0.4))

    def wall(self, rays, tip=None, radius=0.008):
        """Ranges (N,) along rays to the wall and its outward normals (N, 3); a ball of that radius stands with its tip at tip."""
        origin = self.camera.centre
        ranges = self.cap.ranges(origin, rays)
        normals = origin + ranges[:, None] * rays - [0, 0, self.cap.centre_z]
        if tip is not None:
            offset = origin - tip - [0, 0, radius]
            along = rays @ offset
            ball = -along - np.sqrt(np.maximum(along**2 - offset @ offset + radius**2, 0))
            on_ball = (along**2 > offset @ offset - radius**2) & (ball < ranges)
            ranges = np.where(on_ball, ball, ranges)
            normals = np.where(on_ball[:, None], -(offset + ranges[:, None] * rays), normals)
        return ranges, normals / np.linalg.norm(normals, axis=1, keepdims=True)

    def image(self, tip=None, radius=0.008):
        """The camera's picture (HEIGHT, WIDTH, 3), uint8 BGR."""
        ranges, normals = self.wall(self.pixel_rays, tip, radius)
        positions = self.camera.centre + ranges[:, None] * self.pixel_rays
        depth = positions[:, 2] - self.window
        seen = np.isfinite(ranges) & (positions[:, 2] > 0)
        light = np.zeros((len(positions), 3))
        for angle in np.arange(LAMPS) * 2 * np.pi / LAMPS:
            lamp = self.camera.centre + self.lamp_radius * np.array([np.cos(angle), np.sin(angle), 0])
            ray = positions - lamp
            distance = np.linalg.norm(ray, axis=1)
            power = (np.maximum((ray * normals).sum(1) / distance, 0) + self.ambient) / distance**2 * 0.0025 / LAMPS
            light += power[:, None] * np.exp(-np.outer(depth * distance / ray[:, 2], self.absorption))
        light *= np.exp(-np.outer(depth / self.pixel_rays[:, 2], self.absorption)) * self.gain
        light *= (self.ink * self.pixel_rays[:, 2]**3)[:, None]
        grey = np.where(seen[:, None], light, 0) + self.noise * self.rng.normal(size=light.shape)
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8).reshape(HEIGHT, WIDTH, 3)

    def tracks(self):
        """The dots, which the ball pushes along their rays: their picture stays where it is."""
        count = len(self.rest_uv)
        return DotTracks(ROWS, COLUMNS, np.arange(count), self.rest_uv, np.full(count, np.pi * DOT_PX**2), np.full(count, 0.02),
                         np.zeros((count, 2)))

    def ranges(self, tip=None, radius=0.008):
        """True ranges (N,) of the dots, m."""
        return self.wall(self.camera.rays(self.rest_uv), tip, radius)[0]

    def tip(self, x, y, depth, radius=0.008):
        """Where the foremost point of a ball at (x, y) is when it is depth beyond first touching the cap."""
        reach = self.cap.curvature_radius + radius
        touch = self.cap.centre_z + np.sqrt(reach**2 - x**2 - y**2) - radius
        return np.array([x, y, touch - depth])


@pytest.fixture(scope='session')
def water_pad():
    """Makes pads: water_pad(absorption=..., window=..., ...)."""
    return WaterPad


def _stored_420(image):
    whole = cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb)
    half = cv2.resize(whole[..., 1:], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    whole[..., 1:] = cv2.resize(half, image.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    return cv2.cvtColor(whole, cv2.COLOR_YCrCb2BGR)


@pytest.fixture(scope='session')
def stored_420():
    """What is left of an image (H, W, 3) after four pixels have shared a colour each (4:2:0, as video and most JPEG store it)."""
    return _stored_420


@pytest.fixture(scope='session')
def stored_jpeg():
    """What is left of an image (H, W, 3) after JPEG of quality 90, 4:2:0."""
    return lambda image: cv2.imdecode(cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, 90])[1], cv2.IMREAD_COLOR)
