# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of a touchpad's dots.

Untouched, they follow from the image positions and the cap's shape; touched, from the ranges measured by colour and regularised by the
membrane's force balance.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .._core.touchpad import DotLocator
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.geometry import Cap
from ..core.errors import BadArgument, BadFrame
from ..dots.tracker import DotTracker, tracker_options
from .constants import TOUCHPAD
from .identification import identify
from .membrane import Membrane
from .sensor import Touchpad
from .water import WaterModel, check_image

CHANGED_LIGHT = ('the light or the white balance has changed, or something touched the pad in the reference: the colours of all dots '
                 'have changed as no press changes them; forces and positions are unknown; shield the pad, or call set_reference while '
                 'untouched')


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
        self._calibrated = water
        self.rest = RestPositions(sensor.cap, camera, sensor.rows, sensor.columns)
        self._version = 0  # of the rest positions that the locator has
        self._locator: DotLocator | None = None
        self._initialised, self.warning = False, ''

    def reset(self) -> None:
        """Identify the water's colour again from the next image, which is the new reference."""
        self._initialised = False

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
        self._update_rest(tracks)
        if not self._initialised:
            self._initialise(image, tracks)
        found = self._locator.locate(check_image(image), tracks.uv, tracks.id)
        if found.is_known:
            self.warning = CHANGED_LIGHT if found.is_lit_otherwise else ''
        return found.xyz

    def _update_rest(self, tracks: DotTracks) -> None:
        """Update the rest positions of the locator."""
        version = self.rest.update(tracks)
        if version == self._version:
            return
        try:
            membrane = Membrane(self.rest.xyz, self._sensor.rows, self._sensor.columns, self._camera.centre, self._sensor.material).core
        except BadArgument as error:
            raise BadFrame(f'the dots get no 3D positions: {error}') from error
        if self._locator is None:
            self._locator = DotLocator(self._camera.kernel, membrane, self.rest.xyz)
        else:
            self._locator.take_rest(membrane, self.rest.xyz)
        self._version = version

    def _initialise(self, image: np.ndarray, tracks: DotTracks) -> None:
        """Identify the water's colour from an untouched image, or adapt the calibrated model to its illumination and white balance."""
        water, glare = identify(image, tracks.uv, self._camera, self._sensor.cap, self._calibrated)
        self._locator.take_water(water.kernel, glare and glare.kernel, water.scale_sigma)
        self._initialised = True


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
