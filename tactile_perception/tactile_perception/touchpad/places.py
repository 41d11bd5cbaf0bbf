# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of a touchpad's dots: untouched, from their image positions and the cap's shape; touched, from their ranges by colour,
regularised by the membrane's force balance."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap
from ..dots.tracker import DotTracker, tracker_options
from ..errors import BadArgument, BadFrame
from .identification import identify
from .membrane import Membrane
from .sensor import Touchpad
from .water import GlaringPad, RestLight, RingColours, SeenGlare, WaterModel, log_ratios

_MOVED = 0.02  # px; chosen: a smaller drift of the reference does not update the membrane
_AT_ONE_PLACE = 1.0  # px from the first dot, within which all lie where the tracks are wrong: they show no shape. Chosen


class RestPlaces:
    """Rest positions of all K dots of a grid. xyz: (K, 3) m, NaN for dots without a reference; uv: (K, 2) px, in the image; version:
    increases with each change."""

    def __init__(self, cap: Cap, camera: CameraModel, rows: int, columns: int):
        self._cap, self._camera = cap, camera
        self.uv = np.full((rows * columns, 2), np.nan)
        self.xyz = np.full((rows * columns, 3), np.nan)
        self.version = 0

    def update(self, tracks: DotTracks) -> int:
        """Take the rest positions of the dots in tracks; the version."""
        if not tracks.rest_moved(self.uv, _MOVED):
            return self.version
        rest = tracks.rest_uv
        known = np.isfinite(rest).all(axis=1)
        ids, rest = tracks.id[known], rest[known]
        self.uv[ids] = rest
        self.xyz[ids] = self._cap.meet(self._camera.centre, self._camera.rays(rest))
        self.version += 1
        return self.version


class DotPlaces:
    """Positions frame by frame. water: a calibrated model, None: fitted to the first untouched image. rest: positions of the untouched
    dots.

    Grey images have no ranges by colour: their dots have no positions.
    """

    def __init__(self, sensor: Touchpad, camera: CameraModel, water: WaterModel | None = None):
        self._sensor, self._camera = sensor, camera
        self._calibrated = self._water = water
        self.rest = RestPlaces(sensor.cap, camera, sensor.rows, sensor.columns)
        self._version = 0  # of the rest positions that the membrane has
        self._membrane: Membrane | None = None
        self._unknown = np.ones(len(self.rest.xyz), bool)  # dots without a rest position
        self._light: RestLight | None = None
        self._glare: GlaringPad | None = None
        self._initialised = False

    def renew(self) -> None:
        """Identify the water's colour again in the next image, which is the new reference."""
        self._water, self._initialised = self._calibrated, False

    def locate(self, image: np.ndarray, tracks: DotTracks, _stamp_s: float = 0.0) -> np.ndarray:
        """Positions (N, 3), m, sensor frame, of tracks in image (H, W, 3) or (H, W) uint8; NaN for dots without a rest position and in a
        grey image. Raises BadFrame if too few dots have a rest position.
        """
        if image.ndim == 3 and len(tracks) and np.isfinite(tracks.uv).all():
            return self._located(image, tracks)
        seen, xyz = np.isfinite(tracks.uv).all(axis=1), np.full((len(tracks), 3), np.nan)
        if image.ndim == 3 and seen.any():
            xyz[seen] = self._located(image, tracks.take(seen))
        return xyz

    def _located(self, image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        moved = self._update_rest(tracks)
        if not self._initialised:
            self._initialise(image, tracks)
        if moved or self._light is None:
            self._light = self._water.at_rest(self.rest.xyz)
            if self._glare is not None:
                self._glare.set_rest(self.rest.xyz, self._light.normals)
        rays, colours = self._camera.rays(tracks.uv), log_ratios(image, tracks.uv, self._water.ring)
        ranges, sigma = self._water.solve(colours, rays, self._light.take(tracks.id), tracks, self._glaring(colours, rays, tracks))
        if not np.isfinite(ranges).any() or _are_at_one_place(tracks.uv):
            return np.full((len(tracks), 3), np.nan)
        xyz = self._membrane.solve(rays, ranges, sigma, tracks.id).xyz.take(tracks.id, axis=0)
        if self._unknown.any():
            xyz[self._unknown[tracks.id]] = np.nan
        return xyz

    def _glaring(self, colours: RingColours, rays: np.ndarray, tracks: DotTracks) -> SeenGlare | None:
        """The glare of this frame, by the skin's shape in the last one; None for a pad without."""
        if self._glare is None:
            return None
        membrane = self._membrane.core
        return self._glare.seen(colours.brightness, rays, tracks.id, membrane.state.xyz if membrane.started else self.rest.xyz)

    def _update_rest(self, tracks: DotTracks) -> bool:
        """Update the membrane's rest positions; whether they have changed."""
        version = self.rest.update(tracks)
        if version == self._version:
            return False
        try:
            if self._membrane is None:
                self._membrane = Membrane(self.rest.xyz, self._sensor.rows, self._sensor.columns, self._camera.centre,
                                          self._sensor.material)
            else:
                self._membrane.set_rest(self.rest.xyz)
            self._unknown, self._version = np.isnan(self.rest.xyz[:, 0]), version
        except BadArgument as error:
            raise BadFrame(f'dots cannot be placed: {error}') from error
        return True

    def _initialise(self, image: np.ndarray, tracks: DotTracks) -> None:
        """Identify the water's colour from an untouched image, or adapt the calibrated model to today's illumination and white balance."""
        self._water, glare = identify(image, tracks.uv, self._camera, self._sensor.cap, self._calibrated)
        self._membrane.core.reset(self._water.scale_sigma)
        self._light, self._initialised = None, True
        self._glare = None
        if glare is not None:
            self._glare = GlaringPad(glare, self._water.path, self._water.absorptions, self._sensor.rows, self._sensor.columns)
            self._glare.set_rest(self.rest.xyz, self._water.at_rest(self.rest.xyz).normals)


def _are_at_one_place(uv: np.ndarray) -> bool:
    """Whether more than one dot, at uv (N, 2) px, are at one place; the first and the last are compared first."""
    return len(uv) > 1 and all(np.abs(some - uv[0]).max() < _AT_ONE_PLACE for some in (uv[-1], uv))


class TouchpadDots(DotTracker):
    """DotTracker of a touchpad. camera: None if not calibrated, then its dots get no 3D positions; values, and known (pattern, rest): see
    tracker_options; water: of a calibration."""

    def __init__(self, sensor: Touchpad, camera: CameraModel | None, values: Mapping, water: WaterModel | None = None, **known):
        places = None if camera is None else DotPlaces(sensor, camera, water)
        super().__init__(**tracker_options(values, **known), places=places)
