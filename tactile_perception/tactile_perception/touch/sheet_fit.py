# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The few numbers of a sheet and of the calibrated tip, fitted to presses at known places: radius, prestretch, friction, bending, and where
the cameras stand.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import BadCalibration
from .field import MarkerField
from .presses import SAME_PLACE, Presses
from .sheet_appearance import disc_appearance, disc_points, read_field
from .sheet_eyes import EyeShifts
from .sheet_library import LibraryPlan
from .sheet_model import SheetMaterial, press_sheet
from .sheet_model_mesh import SheetMesh, uniform

MOST_PLACES = 4
ROUNDS = 3
SHIFT, GROWTH = 1e-5, 4e-3  # m and 1: what tells a marker's place and area apart from the model, beside its noise
SHARE = 2e-3           # and, of the depth (of the growth: per mm)
PRIOR = {'radius': (7.5e-3, 0.7), 'stretch': (0.03, 0.7), 'friction': (0.5, 0.5), 'bending': (2.5e-7, 0.7)}  # middle; sigma of the log
MOVE = 0.05            # of a logarithm, over which derivatives are taken
LARGEST = 0.5          # step of a logarithm
EYE_SIGMA, EYE_MOVE = 3e-4, 1e-5  # m: how far off eyes may be; over which derivatives are taken


@dataclass(frozen=True)
class SheetNumbers:
    """radius: m, of the calibrated tip; material; marker_radius: m; eyes: where the cameras stand."""

    radius: float
    material: SheetMaterial
    marker_radius: float
    eyes: EyeShifts


def fit_numbers(presses: Presses, plan: LibraryPlan) -> SheetNumbers:
    """The numbers that fit the presses best, given weak expectations of a rubber sheet and a fingertip.

    Raises BadCalibration where there are too few presses within plan.reach, or the mechanics find no balance.
    """
    fit = _NumbersFit(chosen_places(presses, plan), marker_radius(presses), plan, EyeShifts.of(presses.fields[0]))
    middle, sigma = (np.array([value[k] for value in PRIOR.values()]) for k in (0, 1))
    start = np.concatenate([np.log(middle), np.zeros(fit.eyes.shifts.size)])
    prior = np.concatenate([1 / sigma, np.full(fit.eyes.shifts.size, 1 / EYE_SIGMA)])
    values = start
    for turn in range(ROUNDS):
        residual = fit.residual(values)
        if turn < ROUNDS - 1:  # the last step goes by the slopes of the one before
            slopes = fit.slopes(values, residual)
        rows = np.concatenate([residual, (values - start) * prior])
        step = np.linalg.lstsq(np.vstack([slopes, np.diag(prior)]), -rows, rcond=None)[0]
        values = values + np.clip(step, -LARGEST, LARGEST)
    return fit.numbers(values)


def chosen_places(presses: Presses, plan: LibraryPlan) -> list[Presses]:
    """Presses at up to MOST_PLACES places, far from each other once the sheet is folded to one quarter, each by rising depth."""
    place = np.where(np.abs(presses.position[:, :2] / plan.reach).max(1) <= 1, presses.places(), -1)
    groups = [presses.select(place == number) for number in np.unique(place[place >= 0])]
    if not groups:
        raise BadCalibration(f'no press within {plan.reach * 1e3} mm of the middle: press farther from the clamp')
    folded = np.array([np.abs(group.position[0, :2]) / plan.reach for group in groups])
    chosen = [int(np.argmin(folded.sum(1)))]
    while len(chosen) < min(MOST_PLACES, len(groups)):
        apart = np.linalg.norm(folded[:, None] - folded[chosen], axis=2).min(1)
        if apart.max() * plan.reach.min() < SAME_PLACE:
            break
        chosen.append(int(np.argmax(apart)))
    return [_by_depth(groups[k]) for k in chosen]


def _by_depth(group: Presses) -> Presses:
    """One press for each depth, rising."""
    depth, first = np.unique(np.round(group.depth, 5), return_index=True)
    keep = np.zeros(len(group), bool)
    keep[first] = True
    group = group.select(keep)
    order = np.argsort(group.depth)
    return replace(group, fields=tuple(group.fields[k] for k in order),
                   **{name: getattr(group, name)[order] for name in ('position', 'depth', 'segment', 'wrench', 'radius')})


def marker_radius(presses: Presses) -> float:
    """Radius, m, of the printed markers, from their area and from how their places in the image and on the sheet go together."""
    field = presses.fields[0]
    eyes, share = np.unique(field.eye[field.seen], axis=0, return_counts=True)
    seen = field.seen & (field.eye == eyes[np.argmax(share)]).all(1)
    flat = np.column_stack([field.uv[seen] - field.duv[seen], np.ones(seen.sum())])
    scale = np.linalg.lstsq(flat, field.rest[seen], rcond=None)[0][:2]
    area = np.nanmedian(field.area[seen] * np.exp(-field.growth[seen])) * abs(np.linalg.det(scale))
    return float(np.sqrt(area / np.pi)) if np.isfinite(area) else 0.0


def observed(field: MarkerField) -> np.ndarray:
    """(K, 3) shift and growth."""
    return np.column_stack([field.shift, field.growth])


class _NumbersFit:
    """Residuals of presses at a few places; values are the logs of radius, prestretch over 1, friction and bending, then shifts of eyes."""

    def __init__(self, groups: list[Presses], marker: float, plan: LibraryPlan, eyes: EyeShifts):
        self.eyes, self._groups, self._marker, self._plan = eyes, groups, marker, plan
        self._solved: tuple[np.ndarray, list] = (np.zeros(0), [])

    def numbers(self, values: np.ndarray) -> SheetNumbers:
        radius, stretch, friction, bending = (float(value) for value in np.exp(values[:4]))
        eyes = replace(self.eyes, shifts=values[4:].reshape(-1, 2))
        return SheetNumbers(radius, SheetMaterial(1 + stretch, bending, friction), self._marker, eyes)

    def slopes(self, values: np.ndarray, residual: np.ndarray) -> np.ndarray:
        moves = np.array([EYE_MOVE] * (len(values) - 4) + [MOVE] * 4)
        order = [*range(4, len(values)), 0, 1, 2, 3]  # eyes first: for them nothing has to be solved anew
        columns = {k: (self.residual(values + move * np.eye(len(values))[k]) - residual) / move for k, move in zip(order, moves)}
        return np.stack([columns[k] for k in range(len(values))], axis=1)

    def residual(self, values: np.ndarray) -> np.ndarray:
        numbers = self.numbers(values)
        if not np.array_equal(self._solved[0], values[:4]):
            self._solved = values[:4].copy(), [self._solve(group, numbers) for group in self._groups]
        parts = [self._part(numbers.eyes.shifted(field), depth, pressed, group.position[0, :2])
                 for group, solved in zip(self._groups, self._solved[1])
                 for field, depth, pressed in zip(group.fields, group.depth, solved)]
        residual = np.concatenate(parts, axis=None)
        if not np.isfinite(residual).any():
            raise BadCalibration(f'the sheet finds no balance under these presses with {numbers}; check size, depths and markers')
        residual = np.nan_to_num(residual)
        return residual * np.minimum(1, np.sqrt(3 / np.maximum(np.abs(residual), 3)))  # beyond 3 sigma, by the root

    def _solve(self, group: Presses, numbers: SheetNumbers) -> np.ndarray:
        """(M, side * side, 3) fields of the M presses at one place."""
        plan, way = self._plan, self._plan.way(group.depth)
        mesh = SheetMesh(group.position[0, :2], plan.half, plan.scale, plan.n)
        solved = press_sheet(mesh, way, numbers.radius, numbers.material)[np.searchsorted(way, group.depth)]
        return uniform(solved.reshape(-1, mesh.side, mesh.side, 3)).reshape(len(solved), -1, 3)

    def _part(self, field: MarkerField, depth: float, pressed: np.ndarray, place: np.ndarray) -> np.ndarray:
        seen, radius = field.seen, self._marker
        rest = field.rest[seen]
        deformed = read_field(pressed, self._plan, place, disc_points(rest, radius))
        difference = disc_appearance(deformed, rest, field.eye[seen], radius) - observed(field)[seen]
        shift = np.sqrt(SHIFT**2 + np.nan_to_num(field.sigma[seen])**2 + (SHARE * depth)**2)
        growth = np.full_like(shift, np.hypot(GROWTH, SHARE * depth * 1e3))
        return difference / np.stack([shift, shift, growth], axis=1)
