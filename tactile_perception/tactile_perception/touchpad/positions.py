# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of a touchpad's dots.

Untouched, they follow from the image positions and the cap's shape; touched, from the ranges measured by colour and regularised by the
membrane's force balance.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap
from ..core.errors import BadArgument, BadFrame
from ..dots.tracker import DotTracker, tracker_options
from .constants import TOUCHPAD
from .identification import identify
from .membrane import Membrane
from .sensor import Touchpad
from .water import GlaringPad, RestLight, RingColours, SeenGlare, WaterModel, log_ratios


class RestPositions:
    """Reference positions of all K dots of a grid.

    Attributes
    ----------
    xyz : ndarray, shape (K, 3)
        Positions in m in the sensor frame; NaN for dots without a reference.
    uv : ndarray, shape (K, 2)
        Positions in the image in px.
    version : int
        Increases with each change.
    """

    def __init__(self, cap: Cap, camera: CameraModel, rows: int, columns: int):
        self._cap, self._camera = cap, camera
        self.uv = np.full((rows * columns, 2), np.nan)
        self.xyz = np.full((rows * columns, 3), np.nan)
        self.version = 0

    def update(self, tracks: DotTracks) -> int:
        """Take the reference positions of the dots in tracks, and return the version."""
        if not tracks.rest_moved(self.uv, TOUCHPAD.min_drift):
            return self.version
        rest = tracks.rest_uv
        known = np.isfinite(rest).all(axis=1)
        ids, rest = tracks.id[known], rest[known]
        self.uv[ids] = rest
        self.xyz[ids] = self._cap.meet(self._camera.centre, self._camera.rays(rest))
        self.version += 1
        return self.version


class DotPositions:
    """Positions of the dots frame by frame.

    Parameters
    ----------
    sensor : Touchpad
        Geometry and material.
    camera : CameraModel
        The camera and its pose in the sensor frame.
    water : WaterModel, optional
        A calibrated model; by default a model is fitted to the first untouched image.

    Attributes
    ----------
    rest : RestPositions
        Positions of the untouched dots.
    warning : str
        Why the last image has no positions; empty if it has.
    """

    def __init__(self, sensor: Touchpad, camera: CameraModel, water: WaterModel | None = None):
        self._sensor, self._camera = sensor, camera
        self._calibrated = self._water = water
        self.rest = RestPositions(sensor.cap, camera, sensor.rows, sensor.columns)
        self._version = 0  # of the rest positions that the membrane has
        self._membrane: Membrane | None = None
        self._unknown = np.ones(len(self.rest.xyz), bool)  # dots without a rest position
        self._light: RestLight | None = None
        self._glare: GlaringPad | None = None
        self._initialised, self.warning = False, ''

    def reset(self) -> None:
        """Identify the water's colour again from the next image, which is the new reference."""
        self._water, self._initialised = self._calibrated, False

    def locate(self, image: np.ndarray, tracks: DotTracks, _stamp_s: float = 0.0) -> np.ndarray:
        """Estimate the positions of the dots in one image.

        Parameters
        ----------
        image : ndarray, shape (H, W, 3) or (H, W), uint8
            The image; a grey one shows no ranges.
        tracks : DotTracks
            Its N dots.

        Returns
        -------
        ndarray, shape (N, 3)
            Positions in m in the sensor frame; NaN in a grey image and for dots without a reference position.

        Raises
        ------
        BadFrame
            If too few dots have a reference position.
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
        rest = self._light.take(tracks.id)
        ranges, sigma = self._water.solve(colours, rays, rest, tracks, self._glaring(colours, rays, tracks))
        if not np.isfinite(ranges).any() or _coincide(tracks.uv):
            return np.full((len(tracks), 3), np.nan)
        self.warning = self._changed_light(ranges, rest.ranges)
        if self.warning:
            return np.full((len(tracks), 3), np.nan)
        xyz = self._membrane.solve(rays, ranges, sigma, tracks.id).xyz.take(tracks.id, axis=0)
        if self._unknown.any():
            xyz[self._unknown[tracks.id]] = np.nan
        return xyz

    @staticmethod
    def _changed_light(ranges: np.ndarray, rest_ranges: np.ndarray) -> str:
        """Return a message if the ranges (N,), m, and those at rest (N,), m, contradict the constant volume of the water; else empty."""
        change = ranges - rest_ranges
        change = float(change[np.isfinite(change)].mean())
        return '' if abs(change) < TOUCHPAD.max_mean_change else (
            'the light or the white balance has changed, or something touched the pad in the reference: the colours of all dots have '
            'changed as no press changes them; forces and positions are unknown; shield the pad, or call set_reference while untouched')

    def _glaring(self, colours: RingColours, rays: np.ndarray, tracks: DotTracks) -> SeenGlare | None:
        """Estimate the glare of this frame from the shape of the skin in the previous one; None for a pad without glare."""
        if self._glare is None:
            return None
        membrane = self._membrane.core
        return self._glare.seen(colours.brightness, rays, tracks.id, membrane.state.xyz if membrane.started else self.rest.xyz)

    def _update_rest(self, tracks: DotTracks) -> bool:
        """Update the rest positions of the membrane; return whether they have changed."""
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
            raise BadFrame(f'the dots get no 3D positions: {error}') from error
        return True

    def _initialise(self, image: np.ndarray, tracks: DotTracks) -> None:
        """Identify the water's colour from an untouched image, or adapt the calibrated model to its illumination and white balance."""
        self._water, glare = identify(image, tracks.uv, self._camera, self._sensor.cap, self._calibrated)
        self._membrane.core.reset(self._water.scale_sigma)
        self._light, self._initialised = None, True
        self._glare = None
        if glare is not None:
            self._glare = GlaringPad(glare, self._water.path, self._water.absorptions, self._sensor.rows, self._sensor.columns)
            self._glare.set_rest(self.rest.xyz, self._water.at_rest(self.rest.xyz).normals)


def _coincide(uv: np.ndarray) -> bool:
    """Whether all of two or more dots at uv (N, 2), px, coincide. The last is compared first, which settles it for most frames."""
    return len(uv) > 1 and all(np.abs(some - uv[0]).max() < TOUCHPAD.min_extent for some in (uv[-1], uv))


def touchpad_tracker(sensor: Touchpad, camera: CameraModel | None, values: Mapping, water: WaterModel | None = None) -> DotTracker:
    """Make the dot tracker of a touchpad, whose dots have 3D positions.

    Parameters
    ----------
    sensor : Touchpad
        Geometry and material.
    camera : CameraModel or None
        The camera and its pose in the sensor frame; None for an uncalibrated camera, whose dots have no 3D positions.
    values : Mapping
        Values of TOUCHPAD_PARAMETERS.
    water : WaterModel, optional
        Colour model of a calibration.

    Returns
    -------
    DotTracker
        The tracker.
    """
    return DotTracker(**tracker_options(values), positions=None if camera is None else DotPositions(sensor, camera, water))
