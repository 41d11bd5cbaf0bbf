# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Identification of a dome's skin, gas, friction and tip from straight presses at known places and depths."""
from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...common.progress import in_parallel
from ...common.geometry import Cap
from ...errors import BadCalibration
from .membrane import DomeMaterial, press_dome
from .mesh import DomeMesh, MeshPlan, evaluate, shift_of
from .outlines import appear_at, outlines
from ..touches.presses import Presses

LOAD_STEPS = 36         # of a press to the deepest. Chosen: friction depends on the path
DEPTH_POWER = 1.3       # grading of the load steps. Chosen
PLACES = 4              # simulated at most, evenly over their distances from the axis. Chosen
DEPTHS = 4              # of a place at most. Chosen
TENSIONS = 1.0, 0.5, 0.25, 0.12  # over shear modulus and thickness: starts. Chosen
GASES = 1.0, 0.03, 1e-4  # over the likely one: starts of sealed gas, of gas with a reservoir, and of a pressure that is held. Chosen
ROUGHER = 0.4, 0.63, 1.6         # friction over the likely one: further starts, at the best tension. Chosen
HOPELESS = 10.0         # times the least cost of a start: kinds of gas whose starts are worse are not followed. Chosen
ITERATIONS = 3          # of Gauss and Newton, at most. Chosen
SHARES = 1.0, 0.4       # of a step that are tried. Chosen
GAINED = 0.03           # of the cost: an iteration that gains less is the last. Chosen
SHALLOW = 0.2           # of the deepest press: above it, model errors are in proportion to depth. Chosen
STEPS = np.array([0.1, 0.15, -0.2, 0.05])  # of the finite differences of the logs. Chosen: more friction than sticks changes nothing
LIMIT = np.array([0.7, 1.0, 0.6, 0.3])     # of one step. Chosen
SIGMA = np.array([1.5, 3.0, 0.7, 0.03])    # prior standard deviations of the logs. Chosen: wide, but of the radius, which heights tell
TRUST = 0.002           # relative error of the model against which that prior is weighed. Chosen
LEAST = np.log([0.02, 1e-3, 0.05, 2e-3])   # bounds of the logs; such gas counts as a pressure that is held
MOST = np.log([1.0, 500.0, 3.0, 0.2])


@dataclass(frozen=True)
class DomeNumbers:
    """material: of the dome; radius: m, of the tip that pressed."""

    material: DomeMaterial
    radius: float

    @property
    def logs(self) -> np.ndarray:
        """(4,) logs of the tension over the shear modulus and thickness, of the gas, of friction and of the radius."""
        material = self.material
        return np.log([1 - material.squeeze, max(material.gas, 1e-3), max(material.friction, 1e-3), self.radius])

    @classmethod
    def from_logs(cls, logs: np.ndarray) -> DomeNumbers:
        """Inverse of logs, within bounds."""
        tension, gas, friction, radius = np.exp(np.clip(logs, LEAST, MOST)).tolist()
        return cls(DomeMaterial(1 - tension, gas, friction), radius)


@dataclass(frozen=True)
class _Place:
    """One place pressed. across, turn: m and rad, of the tip; depths (D,) m, rising; shifts: (D, K, 2) m, apparent; weights (D,)."""

    across: float
    turn: float
    depths: np.ndarray
    shifts: np.ndarray
    weights: np.ndarray


def identify(presses: Presses, points: np.ndarray, eyes: np.ndarray, cap: Cap, plane_z: float, marker: float,
             start: DomeNumbers) -> DomeNumbers:
    """The numbers that explain straight presses best; points, eyes: (K, 3) m, of the markers, NaN unknown; plane_z: m, of the viewing
    plane; marker: m, radius of the markers.

    Raises BadCalibration where the presses cannot be simulated.
    """
    places = _places(presses)
    explain = partial(_explained, places, points=points, eyes=eyes, cap=cap, plane_z=plane_z, marker=marker)
    known = sum(np.isfinite(place.shifts).sum() for place in places)
    kinds = [start.logs + [0, np.log(gas), 0, 0] for gas in GASES]  # each kind of gas is as likely
    tried = [[logs + [np.log(tension) - logs[0], 0, 0, 0] for tension in TENSIONS] for logs in kinds]
    left = [explain(starts) for starts in tried]
    if max(np.isfinite(one).sum(axis=1).max() for one in left) < 0.5 * known:
        raise BadCalibration(f'presses simulated with {DomeNumbers.from_logs(tried[0][0])} do not converge; check dome and depths')
    firsts = [min(_cost(one, logs, likely) for one, logs in zip(*kind)) for *kind, likely in zip(left, tried, kinds)]
    found = [_refined(explain, starts, one, likely) for starts, one, likely, first in zip(tried, left, kinds, firsts)
             if first < HOPELESS * min(firsts)]
    return DomeNumbers.from_logs(min(found, key=lambda solution: solution[1])[0])


def _refined(explain, starts: list[np.ndarray], left: np.ndarray, likely: np.ndarray) -> tuple[np.ndarray, float]:
    """The logs from the best start, with other frictions there, and their cost; left: (T, N) of the starts."""
    best = int(np.argmin([_cost(one, logs, likely) for one, logs in zip(left, starts)]))
    starts = [starts[best], *(starts[best] + [0, 0, np.log(rougher), 0] for rougher in ROUGHER)]
    left = [left[best], *explain(starts[1:])]
    costs = [_cost(one, logs, likely) for one, logs in zip(left, starts)]
    logs, left, cost = (part[int(np.argmin(costs))] for part in (starts, left, costs))
    for _ in range(ITERATIONS):
        step = _step(explain, logs, left, likely)
        tried = [np.clip(logs + share * step, LEAST, MOST) for share in SHARES]
        after = explain(tried)
        costs = [_cost(one, there, likely) for one, there in zip(after, tried)]
        best = int(np.argmin(costs))
        gained, smaller = cost - costs[best], costs[best] < cost
        if smaller:
            logs, left, cost = tried[best], after[best], costs[best]
        if gained < GAINED * cost:
            break
    return logs, cost


def _explained(places: list[_Place], tried: list[np.ndarray], **known) -> np.ndarray:
    """(T, N) weighted residuals of the places for each of the logs tried; NaN where unknown or not converged."""
    told = in_parallel(partial(_residuals, **known), [(place, logs) for logs in tried for place in places],
                       'presses simulated for the identification')
    return np.array([np.concatenate(told[k * len(places):(k + 1) * len(places)]) for k in range(len(tried))])


def _cost(left: np.ndarray, logs: np.ndarray, likely: np.ndarray) -> float:
    """Mean square of the residuals with the prior's; the fewer presses converge, the larger."""
    known = np.isfinite(left)
    return float(np.mean(left[known]**2) / known.mean() + np.sum((TRUST * (logs - likely) / SIGMA)**2)) if known.any() else np.inf


def _step(explain, logs: np.ndarray, left: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """(4,) step of Gauss and Newton's method, within LIMIT."""
    way = np.where(logs + STEPS > MOST, -STEPS, STEPS)
    slope = ((explain([logs + one for one in np.diag(way)]) - left).T / way)
    known = np.isfinite(left) & np.isfinite(slope).all(axis=1)
    prior = (TRUST / SIGMA)**2 * known.sum()
    step = np.linalg.solve(slope[known].T @ slope[known] + np.diag(prior), prior * (likely - logs) - slope[known].T @ left[known])
    return step * min(1.0, (LIMIT / np.maximum(np.abs(step), 1e-12)).min())


def _places(presses: Presses) -> list[_Place]:
    """The places pressed, at most PLACES; without frames of the tip's retreat, when friction has turned."""
    number, deepest, loading = presses.places(), presses.depth.max(), presses.loading()
    across = np.hypot(*presses.position[:, :2].T)
    order = sorted(range(number.max() + 1), key=lambda k: across[number == k].mean())
    places = []
    for k in [order[i] for i in np.unique(np.linspace(0, len(order) - 1, PLACES).round().astype(int))]:
        mine = np.flatnonzero((number == k) & loading)
        mine = mine[np.argsort(presses.depth[mine])]
        mine = mine[np.unique(np.linspace(0, len(mine) - 1, DEPTHS + 1).round().astype(int)[1:])]
        x, y = presses.position[mine, :2].mean(0)
        depths = presses.depth[mine]
        depths = depths + 1e-7 * np.arange(len(depths))  # rising, even where two are equal
        shifts = np.array([presses.fields[i].shift for i in mine])
        places.append(_Place(float(np.hypot(x, y)), float(np.arctan2(y, x)), depths, shifts, 1 / np.hypot(depths, SHALLOW * deepest)))
    return places


def _residuals(case: tuple[_Place, np.ndarray], points: np.ndarray, eyes: np.ndarray, cap: Cap, plane_z: float,
               marker: float) -> np.ndarray:
    """Weighted residuals of one place with numbers of those logs; NaN where unknown or not converged."""
    place, numbers = case[0], DomeNumbers.from_logs(case[1])
    mesh = DomeMesh(shift_of(place.across, numbers.radius, cap), cap, MeshPlan())
    steps = load_steps(place.depths)
    pressed = press_dome(mesh, steps, numbers.radius, numbers.material, drags=0).straight[np.searchsorted(steps, place.depths)]
    cos, sin = np.cos(place.turn), np.sin(place.turn)
    turned = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    known = np.isfinite(points).all(axis=1)
    rest, eyes, left = outlines(points[known], marker, cap), eyes[known], []
    before, away = appear_at(rest, eyes), plane_z - eyes[:, 2:]
    for field, shift, weight in zip(pressed, place.shifts, place.weights):
        moved = evaluate(field, mesh, rest.reshape(-1, 3) @ turned.T) @ turned
        off = np.full(shift.shape, np.nan)
        off[known] = (appear_at(rest + moved.reshape(rest.shape), eyes) - before) * away - shift[known]
        left.append(off.ravel() * weight)
    return np.concatenate(left)


def seen_at(places: np.ndarray, eyes: np.ndarray, plane_z: float) -> np.ndarray:
    """(K, 2) m: apparent places, in the viewing plane, of places (K, 3), m, seen from eyes (K, 3), m."""
    offset = places - eyes
    return eyes[:, :2] + offset[:, :2] * ((plane_z - eyes[:, 2]) / offset[:, 2])[:, None]


def load_steps(stops: np.ndarray) -> np.ndarray:
    """Load steps, m, through rising stops, m."""
    fine = stops[-1] * (np.arange(1, LOAD_STEPS + 1) / LOAD_STEPS)**DEPTH_POWER
    between = fine[np.abs(fine[:, None] - stops).min(1) > 0.3 * stops[-1] / LOAD_STEPS]
    return np.union1d(between, stops)
