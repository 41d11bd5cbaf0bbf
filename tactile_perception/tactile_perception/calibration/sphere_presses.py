# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses of a known sphere on a touchpad: dots that lie on the sphere, whose positions it defines, and the fit of an unknown radius."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import sphere_ranges
from ..errors import BadCalibration
from ..touchpad.optics.absorption import WaterModel
from ..touchpad.optics.colour import log_ratios
from ..touchpad.optics.identification import Colours, ring_covariances

SMALLEST, LARGEST = 2e-3, 30e-3  # m, chosen: bounds of the sphere's radius
TOLERANCE = 0.01  # relative, chosen: accuracy of the radius


def find_sphere_radius(misfit: Callable[[float], float]) -> float:
    """Radius, m, that minimises misfit(radius), m. Raises BadCalibration without a minimum between 2 and 30 mm."""
    def at(log_radius: float) -> float:
        """Misfit, m, at exp(log_radius); 1 where the fit fails."""
        try:
            return misfit(float(np.exp(log_radius)))
        except BadCalibration:
            return 1.0
    coarse = np.linspace(np.log(SMALLEST), np.log(LARGEST), 9)
    values = [at(x) for x in coarse]
    best = int(np.argmin(values))
    if best in (0, len(coarse) - 1) or values[best] >= 1.0:
        raise BadCalibration(f'touchpad calibration: no sphere of {SMALLEST * 1e3:.0f} to {LARGEST * 1e3:.0f} mm radius fits the presses; '
                             'give its radius with --sphere-radius, and check that ground_truth/contacts holds the tips of sphere presses')
    found = scipy.optimize.minimize_scalar(at, bounds=(coarse[best - 1], coarse[best + 1]), method='bounded', options={'xatol': TOLERANCE})
    return float(np.exp(found.x))


PENETRATION = 0.5  # of the deepest penetration, chosen: where the sphere is this deep inside the cap at rest, the membrane lies on it
RING = 8           # points on the sampling ring of a dot that must lie on the sphere, chosen


@dataclass
class Press:
    """A static frame of the touchpad with the pose of the sphere that the stage reports.

    image: (H, W, 3) uint8 BGR; tracks: its dots; tip: (3,) m, contact point of the sphere in the sensor frame, NaN without contact; depth:
    m, 0 without contact; normal: (3,) unit vector from the tip to the sphere's centre (the stage's axis, not the membrane's normal); name:
    for messages.
    """

    image: np.ndarray
    tracks: DotTracks
    tip: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    depth: float = 0.0
    normal: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    name: str = ''

    @property
    def touching(self) -> bool:
        """Whether the sphere touches in this frame."""
        return bool(self.depth > 0 and np.isfinite(self.tip).all())

    @property
    def label(self) -> str:
        """Name of the press in messages."""
        return self.name or 'press at ({:.1f}, {:.1f}) mm, {:.2f} mm deep'.format(*np.asarray(self.tip)[:2] * 1e3, self.depth * 1e3)


@dataclass
class OnSphere:
    """Dots of one press that lie on the sphere.

    colours: at the mean positions of their sampling rings; count: (M,) ring pixels used; tip: (3,) m; depth: m; label: name of the press
    in messages.
    """

    colours: Colours
    count: np.ndarray
    tip: np.ndarray
    depth: float
    label: str = ''

    def select(self, keep: np.ndarray) -> 'OnSphere':
        """The same press with only the dots where keep, (M,) bool, is True."""
        return OnSphere(self.colours.select(keep), self.count[keep], self.tip, self.depth, self.label)


def dots_on_sphere(press: Press, radius: float, model: WaterModel, camera: CameraModel) -> OnSphere:
    """Dots of a press whose sampling rings lie on the sphere (radius, m): where it is deep inside the cap at rest (PENETRATION).

    The result may hold no dot. Raises BadFrame for an image without colour.
    """
    centre = np.asarray(press.tip) + radius * np.asarray(press.normal)
    angle = np.arange(RING) * (2 * np.pi / RING)
    ring = model.ring * np.column_stack([np.cos(angle), np.sin(angle)])
    rays = camera.rays((press.tracks.uv[:, None] + ring).reshape(-1, 2))
    near, _ = sphere_ranges(camera.centre, rays, centre, radius)
    inside = np.nan_to_num(model.cap.ranges(camera.centre, rays) - near, nan=-1.0).reshape(-1, RING)
    rings = log_ratios(press.image, press.tracks.uv, model.ring)
    on = (inside.min(1) > PENETRATION * max(inside.max(initial=0.0), 1e-6)) & np.isfinite(rings.ratios).all(1)
    places = (camera.centre + near[:, None] * rays).reshape(-1, RING, 3)[on].mean(1)
    normals = centre - places
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colours = Colours(rings.ratios[on], ring_covariances(model.noise, rings.count[on]), places, normals)
    return OnSphere(colours, rings.count[on], np.asarray(press.tip, float), float(press.depth), press.label)
