# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From pairs of estimate and truth to errors: what is compared, how contacts are matched, and the statistics of a recording."""
from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import chdtri  # of chi-square; scipy.stats takes seconds to import

from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, SATURATED, ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.geometry import error_angle
from .scores import label_f1, macro_f1, normalised_square, region_iou

DOT_STATES = ('untouched', 'sticking', 'slipping')
SLIP_STATES = ('none', 'incipient', 'gross')
FLAGS = {'OUT_OF_RANGE': OUT_OF_RANGE, 'AT_EDGE': AT_EDGE, 'AMBIGUOUS': AMBIGUOUS, 'SATURATED': SATURATED}


@dataclass
class Instant:
    """The results of one time. contacts, region, slip: as in the messages; wrench: (6,) N and N m. None without a message."""

    contacts: list[ContactEstimate] | None = None
    region: ContactRegionEstimate | None = None
    slip: SlipEstimate | None = None
    wrench: np.ndarray | None = None

    @property
    def touched(self) -> bool | None:
        """Whether anything touches; None when unknown."""
        if self.contacts is not None:
            return bool(self.contacts)
        return None if self.region is None else self.region.area > 0

    @property
    def position(self) -> np.ndarray:
        """Position (2,), m, of the first contact, otherwise of the region's centroid; NaN when unknown."""
        known = [c.position[:2] for c in self.contacts or []] + ([self.region.centroid[:2]] if self.region is not None else [])
        return next((position for position in known if np.isfinite(position).all()), np.full(2, np.nan))


@dataclass(frozen=True)
class Quantity:
    """text: description; unit: for display; factor: display units per SI unit; low: whether low values are good; signed: whether errors
    keep their sign, so that a bias is reported.
    """

    text: str
    unit: str
    factor: float
    low: bool = True
    signed: bool = False


QUANTITIES = {
    'position': Quantity('position of the contact', 'mm', 1e3),
    'depth': Quantity('depth of the contact', 'mm', 1e3, signed=True),
    'normal': Quantity('normal of the contact', 'degrees', 180 / np.pi),
    'touch_force': Quantity('normal force of the contact', 'N', 1.0, signed=True),
    'region_overlap': Quantity('overlap of the regions (intersection over union)', '1', 1.0, low=False),
    'region_area': Quantity('area of the region', '% of it', 100.0, signed=True),
    'region_centroid': Quantity('centroid of the region', 'mm', 1e3),
    'slipping_fraction': Quantity('part of the contact that slips', '%', 100.0, signed=True),
    'slip_velocity': Quantity('velocity of the slip', 'mm/s', 1e3),
    'force': Quantity('force of the wrench', 'N', 1.0),
    'force_relative': Quantity('force of the wrench', '% of it', 100.0),
    'moment': Quantity('moment of the wrench', 'N mm', 1e3),
    'moment_relative': Quantity('moment of the wrench', '% of it', 100.0),
}


def spread(values: np.ndarray, quantity: Quantity) -> dict[str, float]:
    """Statistics of errors (N,), in the quantity's unit, NaN: no estimate. median, within_95 (95 % of the errors are no worse), worst and
    count of the absolute errors, and how many are not_reported; for a signed quantity also bias, the median of the signed errors.
    """
    known = values[~np.isnan(values)]
    found = {'median': np.nan, 'within_95': np.nan, 'worst': np.nan, 'count': len(known), 'not_reported': len(values) - len(known)}
    if len(known):
        sizes = quantity.factor * np.abs(known)
        middle, most = np.percentile(sizes, [50, 95 if quantity.low else 5])
        found.update(median=float(middle), within_95=float(most), worst=float(sizes.max() if quantity.low else sizes.min()))
        if quantity.signed:
            found['bias'] = float(quantity.factor * np.median(known))
    return found


def pairs(estimated: list[ContactEstimate], true: list[ContactEstimate]) -> list[tuple[ContactEstimate, ContactEstimate]]:
    """Pairs (estimated, true) with the smallest sum of distances in x and y; as many as the shorter list holds."""
    if not estimated or not true:
        return []
    distances = np.array([[np.hypot(*(found.position - known.position)[:2]) for known in true] for found in estimated])
    return [(estimated[a], true[b]) for a, b in zip(*linear_sum_assignment(np.nan_to_num(distances)))]


def touch_errors(estimated: ContactEstimate, true: ContactEstimate) -> dict[str, float]:
    """Errors by quantity, SI units; quantities of unknown truth are left out; NaN for those without an estimate.

    The position error is measured in x and y; in 3D for a contact of unknown depth, because nothing else reports its error along z.
    """
    difference = estimated.position - true.position
    is_flat = np.isfinite(estimated.depth) or not np.isfinite(difference[2])
    errors = {'position': np.hypot(*difference[:2]) if is_flat else np.linalg.norm(difference),
              'depth': estimated.depth - true.depth, 'normal': float(error_angle(estimated.normal, true.normal)),
              'touch_force': estimated.force - true.force}
    known = {'position': true.position[:2], 'depth': true.depth, 'normal': true.normal, 'touch_force': true.force}
    return {name: float(error) for name, error in errors.items() if np.isfinite(known[name]).all()}


@dataclass
class TouchCounts:
    """Counts of detected, missed and false contacts, and the consistency of the covariances.

    frames: counts of frames judged, touched, missed (no contact estimated), too_few, too_many, untouched, false (a contact estimated
    without a true one). An estimated contact is false if it was never matched to a true one.
    """

    frames: Counter = field(default_factory=Counter)
    flagged: Counter = field(default_factory=Counter)
    squares: list[tuple[float, int]] = field(default_factory=list)
    uncertain: int = 0
    _begun: dict[int, float] = field(default_factory=dict)  # id of each true contact -> stamp of its first frame
    _numbers: dict[int, list[int]] = field(default_factory=dict)  # id of each true contact -> ids of the estimates, in their order
    _late: list[float] = field(default_factory=list)
    _estimated: set[int] = field(default_factory=set)

    def add(self, stamp: float, estimated: list[ContactEstimate], true: list[ContactEstimate], matched: list) -> None:
        """Add one frame; matched: its pairs."""
        here = {'judged': True, 'touched': bool(true), 'untouched': not true, 'missed': bool(true) and not estimated,
                'too_few': 0 < len(estimated) < len(true), 'too_many': 0 < len(true) < len(estimated),
                'false': bool(estimated) and not true}
        self.frames.update(name for name, so in here.items() if so)
        self._estimated.update(touch.id for touch in estimated)
        for touch in true:
            self._begun.setdefault(touch.id, stamp)
        for touch, there in matched:
            numbers = self._numbers.setdefault(there.id, [])
            if not numbers:
                self._late.append(stamp - self._begun[there.id])
            if numbers[-1:] != [touch.id]:
                numbers.append(touch.id)
            self.flagged.update(name for name, flag in FLAGS.items() if touch.flags & flag)
            square, directions = normalised_square(touch.position - there.position, touch.position_covariance)
            if directions:
                self.squares.append((square, directions))
            elif np.isfinite(there.position).all():
                self.uncertain += 1

    def summary(self) -> dict:
        """Counts of frames, of contacts and of flags, by name."""
        names = ('judged', 'touched', 'missed', 'too_few', 'too_many', 'untouched', 'false')
        late = 1e3 * np.array(self._late) if self._late else np.full(1, np.nan)
        return {'frames': {name: self.frames[name] for name in names},
                'touches': {'there': len(self._begun), 'never_reported': len(self._begun) - len(self._numbers),
                            'made_up': len(self._estimated.difference(*self._numbers.values())),
                            'renumbered': sum(len(numbers) - 1 for numbers in self._numbers.values()),
                            'reported_after_ms': {'median': float(np.median(late)), 'worst': float(late.max())}},
                'flagged': {name: self.flagged[name] for name in FLAGS}}

    def consistency(self) -> dict:
        """Consistency of the stated covariances; only counts without any.

        mean: of the normalised squared position errors per degree of freedom, 1 for consistent covariances; within_95: share of contacts
        within the 95 % region.
        """
        if not self.squares:
            return {'count': 0, 'not_stated': self.uncertain}
        square, directions = np.array(self.squares).T
        return {'count': len(square), 'not_stated': self.uncertain, 'mean': float((square / directions).mean()),
                'within_95': float((square < chdtri(directions, 0.05)).mean())}


class Evaluation:
    """Accumulates frames; summary() reports.

    dots: (3, 4) counts, true state by estimated state, last column: dots not seen; slip: (3, 3) counts, true by estimated; context:
    (stamp s, touched, depth m) of the truth of each frame.
    """

    def __init__(self):
        self._rows: dict[str, list[tuple[float, float, float, float]]] = defaultdict(list)
        self.touches = TouchCounts()
        self.dots, self.slip = np.zeros((3, 4), int), np.zeros((3, 3), int)
        self.context: list[tuple[float, float, float]] = []
        self._wrenches: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []

    def add(self, stamp: float, estimated: Instant, true: Instant) -> None:
        """Add one frame: estimate and truth; stamp: s."""
        position, errors = true.position, {}
        if true.contacts is not None:
            depths = [contact.depth for contact in true.contacts if np.isfinite(contact.depth)]
            self.context.append((stamp, float(bool(true.contacts)), max(depths, default=np.nan)))
            if estimated.contacts is not None:
                matched = pairs(estimated.contacts, true.contacts)
                self.touches.add(stamp, estimated.contacts, true.contacts, matched)
                for touch, there in matched:
                    self._keep(stamp, there.position[:2], touch_errors(touch, there))
        if estimated.region is not None and true.region is not None:
            errors |= self._region_errors(estimated.region, true.region)
        if estimated.slip is not None and true.slip is not None and true.touched is not False:
            errors |= self._slip_errors(estimated, true)
        self._keep(stamp, position, errors)
        if estimated.wrench is not None and true.wrench is not None and true.touched is not False:
            self._wrenches.append((stamp, position, estimated.wrench, true.wrench))

    def _keep(self, stamp: float, position: np.ndarray, errors: dict[str, float]) -> None:
        for name, error in errors.items():
            self._rows[name].append((stamp, *position.tolist(), float(error)))

    def _region_errors(self, estimated: ContactRegionEstimate, true: ContactRegionEstimate) -> dict[str, float]:
        if len(true.dot_id) and len(estimated.dot_id):
            found = dict(zip(estimated.dot_id.tolist(), estimated.dot_state.tolist()))
            columns = [found.get(number, 3) for number in true.dot_id.tolist()]
            np.add.at(self.dots, (true.dot_state, columns), 1)
        if not true.area > 0:
            return {}
        errors = {'region_area': estimated.area / true.area - 1}
        if true.outlines:
            errors['region_overlap'] = region_iou(estimated.outlines + estimated.holes, true.outlines + true.holes)
        if np.isfinite(true.centroid[:2]).all():
            errors['region_centroid'] = np.hypot(*(estimated.centroid - true.centroid)[:2])
        return errors

    def _slip_errors(self, estimated: Instant, true: Instant) -> dict[str, float]:
        self.slip[true.slip.state, estimated.slip.state] += 1
        errors = {}
        if np.isfinite(true.slip.slipping_fraction):
            errors['slipping_fraction'] = estimated.slip.slipping_fraction - true.slip.slipping_fraction
        at = true.region.centroid if true.region is not None else np.full(3, np.nan)
        there = _velocity(true.slip, at)[:2]
        if true.slip.state and np.isfinite(there).all():
            errors['slip_velocity'] = np.hypot(*(_velocity(estimated.slip, at)[:2] - there))
        return errors

    def _wrench_errors(self) -> dict[str, list]:
        """Rows of the errors of force and moment; relative ones need the largest of the recording."""
        found = defaultdict(list)
        for name, part in (('force', slice(3)), ('moment', slice(3, 6))):
            rows = [(stamp, position, estimated[part] - true[part], np.linalg.norm(true[part])) for stamp, position, estimated, true
                    in self._wrenches if np.isfinite(true[part]).all()]
            strongest = max((size for *_, size in rows), default=0.0)
            for stamp, position, difference, size in rows:
                estimated = difference[np.isfinite(difference)]
                error = np.linalg.norm(estimated) if len(estimated) else np.nan
                found[name].append((stamp, *position, error))
                if size > 0.05 * strongest:  # relative errors of smaller ones mean little
                    found[f'{name}_relative'].append((stamp, *position, error / size))
        return found

    def errors(self) -> dict[str, np.ndarray]:
        """Rows (N, 4) by name, in the order of QUANTITIES, of the quantities that were compared: stamp, s, x and y of the contact, m, and
        error, SI units, NaN: no estimate."""
        known = {**self._rows, **self._wrench_errors()}
        return {name: np.array(known[name], float) for name in QUANTITIES if name in known}

    def summary(self) -> dict:
        """All results by name, in the units of QUANTITIES; NaN for a quantity that was not compared."""
        return {
            **self.touches.summary(),
            'errors': {name: {'text': QUANTITIES[name].text, 'unit': QUANTITIES[name].unit, **spread(rows[:, 3], QUANTITIES[name])}
                       for name, rows in self.errors().items()},
            'covariance': self.touches.consistency(),
            'dot_states': _confused(self.dots, DOT_STATES, 'not seen') if self.dots.any() else None,
            'slip_states': {**_confused(self.slip, SLIP_STATES), 'macro_f1': macro_f1(self.slip)} if self.slip.any() else None,
        }


def _velocity(slip: SlipEstimate, at: np.ndarray) -> np.ndarray:
    """Velocity (3,), m/s, of the object relative to the sensor at a point (3,), m; an unknown rotation counts as 0."""
    angular = np.nan_to_num(slip.angular)
    return slip.linear + (np.cross(angular, at) if angular.any() else np.zeros(3))


def _confused(confusion: np.ndarray, names: tuple[str, ...], *more: str) -> dict:
    return {'true': list(names), 'reported': [*names, *more], 'counts': confusion.tolist(),
            'f1': dict(zip(names, label_f1(confusion).tolist()))}
