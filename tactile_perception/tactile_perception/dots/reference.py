# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Untouched positions of numbered dots, and whether they are untouched.

With calibrated untouched positions: a moved camera or a warm lens gives an affine motion of the image, another print independent errors.
Non-affine displacements that neighbours share are a press. If the dots that move least are at their calibrated positions, those can replace
the reference. Without: an untouched grid is a smooth function of row and column and, up to the tilt of the view, point symmetric; or it is
so beside the homography and radial distortion by which a tilted camera sees a flat grid through a lens. The residuals are printing errors,
which are independent between neighbours; a press leaves residuals that are correlated.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..common.neighbours import Neighbours
from ..core.errors import BadArgument
from .constants import DOT
from .links import FARTHEST


@dataclass(frozen=True)
class RestJudgement:
    """pressed: whether something pressed; known: whether the calibrated positions can replace the reference; reason: '' without a press;
    stayed: whether the dots are where they were calibrated, so that both show the same."""

    pressed: bool = False
    known: bool = True
    reason: str = ''
    stayed: bool = False


class CalibratedRest:
    """uv: (K, 2) px, calibrated untouched positions of all dots by index, NaN where unknown."""

    def __init__(self, uv: np.ndarray):
        self.uv = np.array(uv, float)

    def judge(self, id: np.ndarray, uv: np.ndarray) -> RestJudgement:
        """Whether reference positions uv (N, 2) px (NaN: not seen) of dots id (N,) are untouched."""
        both = np.flatnonzero((id < len(self.uv)) & np.isfinite(uv).all(axis=1))
        both = both[np.isfinite(self.uv[id[both]]).all(axis=1)]
        if len(both) < DOT.min_judged:
            return RestJudgement()
        rest = self.uv[id[both]]
        off = uv[both] - rest
        distance, index = (near[:, 1:] for near in Neighbours(rest).query(rest, DOT.judged_neighbours + 1))
        left = _robust_residual(_affine(rest), off, DOT.kept_percent)
        together, square = np.mean(left * np.mean(left[index], axis=1)), np.mean(left**2)
        shared = float(np.sqrt(2 * max(together, 0.0)))
        if together <= DOT.press_correlation * square or shared <= DOT.press_size:
            return RestJudgement(stayed=bool(np.median(np.hypot(*off.T)) <= DOT.max_stayed))
        known = np.percentile(np.hypot(*off.T), DOT.stillest_percent) <= DOT.max_still_motion * np.median(distance[:, 0])
        seen = f'the first dots are off their calibrated untouched positions ({shared:.2f} px shared by neighbours)'
        if known:
            return RestJudgement(True, True, f'{seen}: the sensor was touched when the reference was taken. The calibrated positions are '
                                 'used until it is released')
        return RestJudgement(True, False, f'{seen}, all of them: the sensor was touched when the reference was taken, and the camera may '
                             'have moved. Release it, then call set_reference; if that does not help, calibrate again')


class Reference:
    """Untouched positions of indexed dots, px: averaged over the first frames, followed as they drift, held during contact
    (src/dots/reference.hpp).

    time_constant_s: of drift; frames: number of untouched frames that are averaged first; known: calibrated positions, used while a sensor
    that starts under contact is not released, and averaged in as 10 frames where the first dots are at them. warning: why the reference may
    not be untouched, ''. A dot that appears later gets its position in the next untouched frame. Raises BadArgument for a time constant
    that is not positive or frames below 1.
    """

    def __init__(self, time_constant_s: float = 30.0, frames: int = 10, known: CalibratedRest | None = None):
        if not (time_constant_s > 0 and frames >= 1):
            raise BadArgument(f'time_constant_s > 0 and frames >= 1 are needed, not {time_constant_s} and {frames}')
        self._kernel, self._known = _core.dots.DotReference(time_constant_s, frames), known
        self.reset()

    @property
    def id(self) -> np.ndarray:
        """(K,) int64, rising, of the dots with a position."""
        return self._kernel.id

    @property
    def uv(self) -> np.ndarray:
        """(K, 2) px, their positions."""
        return self._kernel.uv

    @property
    def touched(self) -> bool:
        """Whether something touched in the last frame."""
        return self._kernel.is_touched

    @property
    def taken(self) -> bool:
        """Whether there is a reference."""
        return self._kernel.count > 0

    def reset(self) -> None:
        """Take the next frame as the reference."""
        self._kernel.reset()
        self.warning, self._doubted = '', False

    def update(self, id: np.ndarray, uv: np.ndarray, sigma: np.ndarray, stamp_s: float, columns: int,
               touched: bool | None = None) -> np.ndarray:
        """Displacements (N, 2) px of dots id (N,) at uv (N, 2) with standard deviations sigma (N,) px; NaN without a reference position.

        touched: as known by a later stage, None to decide by the dots; columns: of the grid, 0 for other patterns. Dots with a non-finite
        position count as not seen.
        """
        if not self.taken or self._doubted and not self._is_pressed(id, uv):
            self.reset()
            seen = (np.abs(uv) < FARTHEST).all(axis=1)
            self._begin(id[seen], uv[seen], columns)
        found = self._kernel.update(id, uv, sigma, stamp_s, touched)
        if found.grown and self._known is not None and self._is_pressed(self.id, self.uv):
            self._begin(self.id, self.uv, columns)  # with the dots that were added it does not show an untouched sensor
            return self._kernel.displacement(id, uv)
        return found.displacement

    def _is_pressed(self, id, uv) -> bool:
        return self._known.judge(id, np.where(np.abs(uv) < FARTHEST, uv, np.nan)).pressed

    def _begin(self, id, uv, columns) -> None:
        """Take the reference from dots id (N,) at uv (N, 2) px."""
        frames = np.zeros(len(id), np.int64)
        if self._known is None:
            self.warning = rest_warning(id, uv, columns) if columns else ''
        else:
            judgement = self._known.judge(id, uv)
            self.warning, self._doubted = judgement.reason, judgement.pressed
            calibrated = np.flatnonzero(np.isfinite(self._known.uv).all(axis=1))
            if judgement.pressed and judgement.known:
                id, uv, frames = calibrated, self._known.uv[calibrated], np.zeros(len(calibrated), np.int64)
            elif judgement.stayed:
                at = np.isin(id, calibrated)
                uv, frames[at] = uv.copy(), DOT.calibrated_frames
                uv[at] = self._known.uv[id[at]]
        self._kernel.take(id, uv, frames)


def rest_warning(id: np.ndarray, uv: np.ndarray, columns: int) -> str:
    """Why dots id (N,) at uv (N, 2) px on a grid with that many columns may be touched; empty if nothing suggests it."""
    if len(id) < DOT.min_judged:
        return ''
    row, column = np.divmod(id, columns)
    positions = np.full((np.ptp(row) + 1, np.ptp(column) + 1, 2), np.nan)  # from the first to the last row and column seen
    positions[row - row.min(), column - column.min()] = uv
    steps = np.linalg.norm(np.diff(positions, axis=1), axis=2)
    pitch = np.nanmedian(steps) if np.isfinite(steps).any() else np.nan
    warning = _unlike(positions, pitch)
    return warning and _unlike(positions - _view(positions), pitch)


def _ranked(values: np.ndarray, rank: float) -> float:
    """The value (N,) of that rank, from 0, rounded down."""
    return float(np.partition(values, int(rank))[int(rank)])


def _unlike(positions, pitch) -> str:
    """Why a grid at positions (rows, columns, 2) px may be touched; empty where it is smooth and, up to a tilt, point symmetric."""
    mirrored, degree = (positions + positions[::-1, ::-1]) / 2, max(1, min(DOT.grid_degree, min(positions.shape[:2]) - 3))
    for name, grid, most, even in (('is not symmetric', mirrored, 2, True), ('has a dent or a bulge', positions, degree, False)):
        size, part = _shared(_grid_residual(grid, most, even))
        if part > DOT.grid_correlation and size > DOT.grid_size * pitch:
            return (f'the grid of dots {name} ({size:.2f} px shared by neighbours): it may have been touched when the reference was taken. '
                    'Release it, then call set_reference')
    return ''


def _affine(uv) -> np.ndarray:
    """Basis (N, 3) of affine motions of positions uv (N, 2)."""
    return np.concatenate([np.ones((len(uv), 1)), uv - uv[0]], axis=1)


def _robust_residual(basis, values, kept_percent) -> np.ndarray:
    """Residuals (N, 2) of values (N, 2) after a least-squares fit of basis (N, K) to those with the least ones."""
    used, wanted, left = basis, values, None
    for _ in range(DOT.fit_rounds):
        if left is not None:
            square = np.einsum('nk,nk->n', left, left)
            kept = square <= _ranked(square, kept_percent / 100 * (len(square) - 1))
            used, wanted = basis.compress(kept, axis=0), values.compress(kept, axis=0)
        normal = used.T @ used  # normal equations take a fifth of the time of lstsq
        normal.flat[::len(normal) + 1] += DOT.ridge * normal.trace()
        left = values - basis @ np.linalg.solve(normal, used.T @ wanted)
    return left


def _view(positions) -> np.ndarray:
    """Positions (rows, columns, 2) px of a flat regular grid under the homography and radial distortion that fit positions (same shape,
    NaN: unknown) best, by robust Gauss-Newton steps."""
    rows, columns = positions.shape[:2]
    size = max(rows, columns) / 2
    row, column = np.indices((rows, columns)).reshape(2, -1)
    index = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2, np.full(len(row), size)], axis=1) / size
    target, known = positions.reshape(-1, 2), np.isfinite(positions[:, :, 0]).ravel()
    affine = np.linalg.lstsq(index[known], target[known], rcond=None)[0]
    scale = max(float(np.abs(affine[:2]).max()), 1e-9)

    def seen(values):
        """(K, 2) px, where a camera sees the grid; values: affine (3, 2), tilt (2,), centre (2,) in scales, distortion."""
        flat = index @ values[:6].reshape(3, 2) / (1 + index[:, :2] @ values[6:8])[:, None]
        away = flat - affine[2] / scale - values[8:10]
        return (flat + values[10] * (away**2).sum(axis=1, keepdims=True) * away) * scale
    values = np.r_[affine.ravel() / scale, np.zeros(5)]
    for _ in range(DOT.view_steps):
        now = seen(values)
        slope = np.stack([(seen(values + change) - now) / DOT.view_difference
                          for change in DOT.view_difference * np.eye(len(values))], axis=2)
        residual = target - now
        square = (residual[known]**2).sum(axis=1)
        kept = np.flatnonzero(known)[square <= _ranked(square, DOT.grid_kept_percent / 100 * (len(square) - 1))]
        slopes = slope[kept].reshape(-1, len(values))  # normal equations take a tenth of the time
        change = np.linalg.lstsq(slopes.T @ slopes, slopes.T @ residual[kept].ravel(), rcond=DOT.view_rank**2)[0]
        values += np.clip(change, -DOT.max_view_step, DOT.max_view_step)
    return seen(values).reshape(positions.shape)


def _grid_residual(positions, degree, even) -> np.ndarray:
    """Residuals of a robust polynomial fit of positions (rows, columns, 2) in row and column, of all terms or the even ones."""
    row, column = np.nonzero(np.isfinite(positions[:, :, 0]))
    residual = np.full_like(positions, np.nan)
    y, x = (2 * k / max(n - 1, 1) - 1 for k, n in zip((row, column), positions.shape))
    terms = [x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i) if not even or (i + j) % 2 == 0]
    if len(row) >= 2 * len(terms):
        residual[row, column] = _robust_residual(np.stack(terms, axis=1), positions[row, column], DOT.grid_kept_percent)
    return residual


def _shared(residual) -> tuple[float, float]:
    """(size, px, and correlation) of the residuals of neighbours: mean product, over the mean square."""
    products = [(residual[1:] * residual[:-1]).sum(axis=2), (residual[:, 1:] * residual[:, :-1]).sum(axis=2)]
    products = np.concatenate([p[np.isfinite(p)] for p in products])
    square = np.nanmean((residual**2).sum(axis=2)) if np.isfinite(residual).any() else 0.0
    if not len(products) or not square > 0:
        return 0.0, 0.0
    return float(np.sqrt(max(products.mean(), 0.0))), float(products.mean() / square)
