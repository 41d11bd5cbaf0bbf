# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A press of a known sphere: what the stage knows, the dots that lie on the sphere, whose places it thereby tells, and the radius of the
sphere where nobody has measured it."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize_scalar

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.spherical_cap import sphere_ranges
from ..errors import BadCalibration
from ..touchpad.optics.absorption import WaterModel
from ..touchpad.optics.colour import log_ratios
from ..touchpad.optics.identification import Colours, ring_covariances

SMALLEST, LARGEST = 2e-3, 30e-3  # m
TOLERANCE = 0.01  # of the radius


def find_sphere_radius(misfit: Callable[[float], float]) -> float:
    """Radius, m, at which misfit(radius), m, is least. Raises BadCalibration where it has no least value between 2 and 30 mm."""
    def at(log_radius: float) -> float:
        """The misfit at exp(log_radius), m; 1 where there is none."""
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
    found = minimize_scalar(at, bounds=(coarse[best - 1], coarse[best + 1]), method='bounded', options={'xatol': TOLERANCE})
    return float(np.exp(found.x))


PENETRATION = 0.5  # of the deepest: where the sphere stands so far inside the cap at rest, the membrane lies on it
RING = 8           # points on a dot's sampling ring that must lie on the sphere as well


@dataclass
class Press:
    """One still frame of the touchpad, with what the stage knows about the sphere.

    image: (H, W, 3) uint8 BGR; tracks: its dots; tip: (3,) m, the sphere's foremost point in the sensor frame, NaN when it does not touch;
    depth: m, 0 when it does not touch; normal: (3,) unit vector from the tip to the sphere's centre (the stage's axis, not the
    membrane's normal); name: for messages.
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
        """How messages name this press."""
        return self.name or 'press at ({:.1f}, {:.1f}) mm, {:.2f} mm deep'.format(*np.asarray(self.tip)[:2] * 1e3, self.depth * 1e3)


@dataclass
class OnSphere:
    """Dots of one press that lie on the sphere: colours (at their rings' mean places), ring points that count (M,), where it was, and how
    messages name it."""

    colours: Colours
    count: np.ndarray
    tip: np.ndarray
    depth: float
    label: str = ''

    def select(self, keep: np.ndarray) -> 'OnSphere':
        """The same press with only the dots where keep (M,) bool."""
        return OnSphere(self.colours.select(keep), self.count[keep], self.tip, self.depth, self.label)


def dots_on_sphere(press: Press, radius: float, model: WaterModel, camera: CameraModel) -> OnSphere:
    """Dots of a press that lie, with their sampling ring, where the sphere (radius, m) stands well inside of the cap at rest.

    Raises BadFrame where the image has no colour. No dot at all is an empty result.
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
