# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of a recording, accumulated frame by frame."""
from __future__ import annotations

from collections import defaultdict

import numpy as np

from ..common.estimates import ContactRegionEstimate, SlipEstimate
from .frames import Instant
from .quantities import QUANTITIES, Errors, over_surface, over_time, spread
from .scores import label_f1, macro_f1, region_iou, relative_errors
from .touches import TouchCounts, pairs, touch_errors

DOT_STATES = ('untouched', 'sticking', 'slipping')
SLIP_STATES = ('none', 'incipient', 'gross')
_WEAK = 0.05  # chosen, of the largest force and moment: relative errors of smaller ones mean little


class Evaluation:
    """Accumulates frames; summary() reports.

    errors: by name of QUANTITIES; dots: (3, 4) counts, true state by estimated state, last column: dots not seen; slip: (3, 3) counts,
    true by estimated; context: (stamp s, touched, depth m) of the truth of each frame.
    """

    def __init__(self):
        self.errors: dict[str, Errors] = defaultdict(Errors)
        self.touches = TouchCounts()
        self.dots, self.slip = np.zeros((3, 4), int), np.zeros((3, 3), int)
        self.context: list[tuple[float, float, float]] = []
        self._wrenches: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []

    def add(self, stamp: float, told: Instant, true: Instant) -> None:
        """Add one frame: estimate (told) and truth; stamp: s."""
        place = true.place
        if true.contacts is not None:
            depths = [contact.depth for contact in true.contacts if np.isfinite(contact.depth)]
            self.context.append((stamp, float(bool(true.contacts)), max(depths, default=np.nan)))
            if told.contacts is not None:
                self._add_touches(stamp, told.contacts, true.contacts)
        if told.region is not None and true.region is not None:
            self._add_region(stamp, place, told.region, true.region)
        if told.slip is not None and true.slip is not None and true.touched is not False:
            self._add_slip(stamp, place, told, true)
        if told.wrench is not None and true.wrench is not None and true.touched is not False and np.isfinite(true.wrench).any():
            self._wrenches.append((stamp, place, told.wrench, true.wrench))

    def _add_touches(self, stamp: float, told: list, true: list) -> None:
        matched = pairs(told, true)
        self.touches.add(stamp, told, true, matched)
        for touch, there in matched:
            for name, error in touch_errors(touch, there).items():
                self.errors[name].add(stamp, there.position[:2], error)

    def _add_region(self, stamp: float, place: np.ndarray, told: ContactRegionEstimate, true: ContactRegionEstimate) -> None:
        if len(true.dot_id) and len(told.dot_id):
            found = dict(zip(told.dot_id.tolist(), told.dot_state.tolist()))
            columns = [found.get(number, 3) for number in true.dot_id.tolist()]
            np.add.at(self.dots, (true.dot_state, columns), 1)
        if not true.area > 0:
            return
        if true.outlines:
            self.errors['region_overlap'].add(stamp, place, region_iou(told.outlines + told.holes, true.outlines + true.holes))
        self.errors['region_area'].add(stamp, place, told.area / true.area - 1)
        if np.isfinite(true.centroid[:2]).all():
            self.errors['region_centroid'].add(stamp, place, float(np.hypot(*(told.centroid - true.centroid)[:2])))

    def _add_slip(self, stamp: float, place: np.ndarray, told: Instant, true: Instant) -> None:
        self.slip[true.slip.state, told.slip.state] += 1
        if np.isfinite(true.slip.slipping_fraction):
            self.errors['slipping_fraction'].add(stamp, place, told.slip.slipping_fraction - true.slip.slipping_fraction)
        if not true.slip.state:
            return
        at = true.region.centroid if true.region is not None else np.full(3, np.nan)
        there = _velocity(true.slip, at)
        if np.isfinite(there[:2]).all():
            self.errors['slip_velocity'].add(stamp, place, float(np.hypot(*(_velocity(told.slip, at) - there)[:2])))

    def _add_wrenches(self) -> dict[str, Errors]:
        """Errors of force and moment; relative ones need the largest of the recording."""
        found = {name: Errors() for name in ('force', 'force_relative', 'moment', 'moment_relative')}
        for name, part in (('force', slice(3)), ('moment', slice(3, 6))):
            rows = [(stamp, place, told[part], true[part]) for stamp, place, told, true in self._wrenches if np.isfinite(true[part]).all()]
            strongest = max((np.linalg.norm(true) for *_, true in rows), default=0.0)
            for stamp, place, told, true in rows:
                found[name].add(stamp, place, _told_length(told - true))
                if np.linalg.norm(true) > _WEAK * strongest:
                    share = float(relative_errors(told[None], true[None])[0])
                    found[f'{name}_relative'].add(stamp, place, share if np.isfinite(share) else np.nan)
        return {name: errors for name, errors in found.items() if errors.rows or errors.untold}

    def all_errors(self) -> dict[str, Errors]:
        """Errors by name, in the order of QUANTITIES, for the quantities that were compared."""
        known = {**self.errors, **self._add_wrenches()}
        return {name: known[name] for name in QUANTITIES if name in known}

    def summary(self) -> dict:
        """All results by name, in the units of QUANTITIES; NaN for a quantity that was not compared."""
        errors = {name: (QUANTITIES[name], e.table(), e.untold) for name, e in self.all_errors().items()}
        return {
            **self.touches.summary(),
            'errors': {name: {'text': q.text, 'unit': q.unit, **spread(t[:, 3], q), 'not_told': untold}
                       for name, (q, t, untold) in errors.items()},
            'covariance': self.touches.honesty(),
            'dot_states': _confused(self.dots, DOT_STATES, 'not seen') if self.dots.any() else None,
            'slip_states': {**_confused(self.slip, SLIP_STATES), 'macro_f1': macro_f1(self.slip)} if self.slip.any() else None,
            'over_time': {name: over_time(t, q) for name, (q, t, _) in errors.items()},
            'over_surface': {name: over_surface(t, q) for name, (q, t, _) in errors.items()},
        }


def _told_length(error: np.ndarray) -> float:
    """Norm of the known components; NaN without one."""
    known = np.isfinite(error)
    return float(np.linalg.norm(error[known])) if known.any() else np.nan


def _velocity(slip: SlipEstimate, at: np.ndarray) -> np.ndarray:
    """Velocity (3,), m/s, of the object relative to the sensor at a point (3,), m; an unknown rotation counts as 0."""
    angular = np.nan_to_num(slip.angular)
    return slip.linear + (np.cross(angular, at) if angular.any() else np.zeros(3))


def _confused(confusion: np.ndarray, names: tuple[str, ...], *more: str) -> dict:
    return {'true': list(names), 'told': [*names, *more], 'counts': confusion.tolist(),
            'f1': dict(zip(names, label_f1(confusion).tolist()))}
