# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force vectors of taxels in; contact region, contacts, slip and wrench out."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.surface_points import SLIPPING, UNKNOWN, SurfacePoints
from ..core.calibration_file import fitted_arrays
from ..core.errors import BadFrame
from .baseline import Baseline
from .constants import FORCE_TAXEL
from .contact import ContactFinder, Forces
from .slip import SlipFinder
from .taxels import Taxels


@dataclass(frozen=True)
class Response:
    """What a sensor reads for a force.

    Parameters
    ----------
    matrix : ndarray, shape (3, 3)
        Force in N from a reading, both along two tangents and inwards.
    error : float
        Relative standard deviation of the force of one taxel.
    """

    matrix: np.ndarray
    error: float = FORCE_TAXEL.usual_error

    @classmethod
    def from_dict(cls, fitted: Mapping, path: str) -> Response:
        """The response in a calibration file. Raises BadCalibration."""
        return cls(**fitted_arrays(fitted, {'matrix': (3, 3), 'error': ()}, path))


@dataclass(frozen=True)
class ForceTaxelsResult:
    """Estimates of one frame.

    Parameters
    ----------
    region : ContactRegionEstimate
        Its dots are the taxels.
    contacts : list of ContactEstimate
    slip : SlipEstimate
    wrench : ndarray, shape (6,)
        Force in N and torque in N m at the origin; NaN where forces are unknown.
    wrench_covariance : ndarray, shape (6, 6)
        Of that wrench.
    points : callable
        Makes the SurfacePoints.
    forces : ndarray, shape (N, 3)
        Of the object on each taxel, along two tangents and inwards, in N or in the unit of the device.
    """

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    slip: SlipEstimate
    wrench: np.ndarray
    wrench_covariance: np.ndarray
    points: partial
    forces: np.ndarray


class ForceTaxelsEstimator:
    """Estimates contact and slip from the force vectors of taxels, frame by frame.

    Parameters
    ----------
    response : Response or None
        None where forces in N are unknown: then contacts, region and slip are estimated alone.

    Attributes
    ----------
    taxels : Taxels or None
        Geometry of the sensor, known from the first frame on.
    baseline : Baseline
        Untouched readings.
    slip : SlipFinder
    """

    def __init__(self, response: Response | None):
        self._response = response
        self._matrix = np.eye(3) if response is None else np.asarray(response.matrix, float)
        self.taxels: Taxels | None = None

    def set_reference(self) -> None:
        """Take the untouched readings from the next second. All contacts end."""
        if self.taxels is not None:
            self._begin(self.taxels)

    def _begin(self, taxels: Taxels) -> None:
        count = len(taxels.positions)
        self.taxels, self.baseline, self.slip = taxels, Baseline(count), SlipFinder(taxels.tilt)
        self._contacts, self._stamp_s = ContactFinder(taxels), None
        self._reading, self._broken, self._near = np.zeros((count, 3)), np.zeros(count, bool), np.zeros(count, bool)

    def process(self, positions: np.ndarray, vectors: np.ndarray, normals: np.ndarray | None, stamp_s: float) -> ForceTaxelsResult | None:
        """Contact, slip and wrench of one frame; None before the untouched readings are known.

        Parameters
        ----------
        positions, vectors : ndarray, shape (N, 3)
            Positions in m, and forces of the object on the sensor, in the sensor frame; NaN for a taxel without a reading.
        normals : ndarray, shape (N, 3), or None
            Unit normals out of the sensor; None to estimate them from the positions.
        stamp_s : float
            Stamp in s.

        Raises
        ------
        BadFrame
            If no taxel has a reading, or two are at the same position.
        """
        if self.taxels is None or not self.taxels.fits(positions, normals):
            self._begin(Taxels(positions, normals))
        reading = self.taxels.local(vectors) @ self._matrix.T
        self._broken = ~np.isfinite(reading).all(axis=1)
        if self._broken.any():
            if self._broken.all():
                raise BadFrame('taxels: no taxel has a reading')
            reading = np.where(self._broken[:, None], self._reading, reading)
        self._reading = reading
        # a longer gap is one second of drift: what happened in it is unknown
        interval = min(max(stamp_s - self._stamp_s, 0.0), 1.0) if self._stamp_s is not None else 0.0
        self._stamp_s = stamp_s
        force = self.baseline.update(reading, interval, stamp_s, self._near)
        if not self.baseline.is_known:
            return None
        return self._estimate(force, interval, stamp_s)

    def _estimate(self, force: np.ndarray, interval: float, stamp_s: float) -> ForceTaxelsResult:
        baseline, taxels, response = self.baseline, self.taxels, self._response
        alive = baseline.alive & ~self._broken
        touched, probability = np.zeros(len(force), bool), np.zeros(len(force))
        if baseline.touch > 0.5:
            press = np.where(alive, force[:, 2], 0.0)
            touched = taxels.skin.touched(press, baseline.probabilities(self._near, interval) * alive)
            # A touch that begins on one taxel is as likely on those beside it.
            probability = baseline.probabilities(self._near | taxels.skin.beside(touched), interval) * alive
            touched = taxels.skin.touched(press, probability)
        self._near = taxels.skin.beside(touched)
        variance = np.where(alive[:, None], baseline.noise + baseline.variance, 0.0)
        forces = Forces(force, variance, touched, probability)
        contacts, region = self._contacts.find(forces, response is not None, stamp_s)
        slip, slips = self.slip.update(np.where(alive[:, None], force, 0.0), baseline.noise, baseline.variance, touched,
                                       baseline.is_new, interval)
        slipping = np.flatnonzero(slips > 0.5)
        region.dot_state[slipping] = SLIPPING
        if len(slipping):
            x, y, _ = taxels.positions[slipping].T
            slip.x, slip.y, slip.vx, slip.vy = x, y, np.full(len(x), np.nan), np.full(len(x), np.nan)
        if response is None:
            wrench, covariance = np.full(6, np.nan), np.full((6, 6), np.nan)
        else:
            wrench, covariance = taxels.skin.wrench(force, variance, touched, alive, response.error)
        shown = np.where(alive[:, None] & np.full(3, response is not None), np.where(touched[:, None], force, 0.0), np.nan)
        state = np.where(alive, region.dot_state, UNKNOWN).astype(np.uint8)
        return ForceTaxelsResult(region, contacts, slip, wrench, covariance, partial(self._points, shown, state), force)

    def _points(self, force: np.ndarray, state: np.ndarray) -> SurfacePoints:
        """The taxels as surface points."""
        taxels, count = self.taxels, len(force)
        unknown = np.full((count, 3), np.nan)
        return SurfacePoints((1, count), taxels.positions, taxels.normals, unknown, taxels.world(force), force[:, 2], state)

    @property
    def warning(self) -> str:
        """What is wrong with the sensor; '' for nothing."""
        if self.taxels is None or not self.baseline.is_known:
            return ''
        dead = np.flatnonzero(~self.baseline.alive | self._broken)
        return f'taxels without a signal are left out: {", ".join(map(str, dead))}; check the sensor' if len(dead) else ''
