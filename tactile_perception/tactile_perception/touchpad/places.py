# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the dots of a touchpad are in 3D: untouched, from their places in the image and the cap's shape; touched, by the colour that the
water leaves, made to agree with what a membrane can do."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.spherical_cap import Cap
from ..errors import BadArgument, BadFrame
from .membrane.range_scale import RangeScale
from .membrane.solver import Membrane, MembraneState
from .optics.absorption import RestLight, WaterModel
from .optics.colour import log_ratios
from .optics.identification import fit_rest, update_constants
from .optics.surface_shape import SurfaceShape
from .sensor import Touchpad

_MOVED = 0.02  # px: a smaller change of the reference is not worth a new membrane


class RestPlaces:
    """Rest places of all K dots of a grid. xyz: (K, 3) m, NaN for dots never seen untouched; uv: (K, 2) px, the same in the image."""

    def __init__(self, cap: Cap, camera: CameraModel, rows: int, columns: int):
        self._cap, self._camera = cap, camera
        self.uv = np.full((rows * columns, 2), np.nan)
        self.xyz = np.full((rows * columns, 3), np.nan)

    def update(self, tracks: DotTracks) -> bool:
        """Take the untouched places of the dots in tracks; whether any has moved or is new."""
        rest = tracks.rest_uv
        if (np.abs(rest - self.uv[tracks.id]) <= _MOVED).all():  # NaN is not
            return False
        known = np.isfinite(rest).all(axis=1)
        ids, rest = tracks.id[known], rest[known]
        if (np.abs(rest - self.uv[ids]) <= _MOVED).all():
            return False
        self.uv[ids] = rest
        self.xyz[ids] = self._cap.meet(self._camera.centre, self._camera.rays(rest))
        return True


class DotPlaces:
    """Places frame by frame. pace: a name in PACES; water: a calibrated model; None: fitted to the first untouched image.

    A grey image tells nothing of the water: its dots have no places.
    """

    def __init__(self, sensor: Touchpad, camera: CameraModel, pace: str = 'full', water: WaterModel | None = None):
        self._sensor, self._camera, self._pace = sensor, camera, pace
        self._calibrated = self._water = water
        self._rest = RestPlaces(sensor.cap, camera, sensor.rows, sensor.columns)
        self._membrane: Membrane | None = None
        self._last: MembraneState | None = None
        self._scale: RangeScale | None = None
        self._light: RestLight | None = None
        self._bled: np.ndarray | None = None
        self._shape = SurfaceShape()
        self._begun = False

    def renew(self) -> None:
        """A new reference is taken: what the water looks like is learnt anew with the next image."""
        self._water, self._begun, self._last, self._shape = self._calibrated, False, None, SurfaceShape()

    def locate(self, image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """Places (N, 3), m, sensor frame, of tracks in image (H, W, 3) or (H, W) uint8; NaN for a dot without a rest place, and in a
        grey image.

        Raises BadFrame where too few dots have a rest place.
        """
        seen = np.isfinite(tracks.uv).all(axis=1)
        xyz = np.full((len(tracks), 3), np.nan)
        if image.ndim == 3 and seen.any():
            xyz[seen] = self._located(image, tracks if seen.all() else tracks.take(seen))
        return xyz

    def _located(self, image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        moved = self._follow_reference(tracks)
        if not self._begun:
            self._begin(image, tracks)
        if moved or self._light is None:
            self._light = replace(self._water.at_rest(self._rest.xyz), bled=self._bled)
        rays, colours = self._camera.rays(tracks.uv), log_ratios(image, tracks.uv, self._water.ring)
        ranges, sigma = self._water.solve(colours, rays, self._light.take(tracks.id), tracks, self._shape)
        self._last = self._membrane.solve(self._camera.centre, rays, ranges, sigma, tracks.id, self._last, scale=self._scale)
        xyz = self._last.xyz[tracks.id]
        xyz[np.isnan(self._rest.xyz[tracks.id, 0])] = np.nan
        return xyz

    def _follow_reference(self, tracks: DotTracks) -> bool:
        """Whether the dots' untouched places are others than before."""
        if not self._rest.update(tracks):
            return False
        try:
            self._membrane = self._membrane.with_rest(self._rest.xyz) if self._membrane else self._new_membrane()
        except BadArgument as error:
            raise BadFrame(f'dots cannot be placed: {error}') from error
        return True

    def _new_membrane(self) -> Membrane:
        return Membrane(self._rest.xyz, self._sensor.rows, self._sensor.columns, self._sensor.material, self._pace)

    def _begin(self, image: np.ndarray, tracks: DotTracks) -> None:
        """Learn the water's colour from an untouched image; of a calibrated one what lamps and white balance have changed since."""
        self._water = fit_rest(image, tracks.uv, self._camera, self._sensor.cap) if self._calibrated is None else \
            update_constants(self._calibrated, image, tracks.uv, self._camera)
        self._scale, self._light, self._begun = RangeScale(self._water.scale_sigma), None, True
        bled, self._bled = self._water.bled(image, tracks, self._camera), None
        if bled is not None:
            self._bled = np.zeros(len(self._rest.xyz), np.float32)
            self._bled[tracks.id] = bled
