# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper taxel_array_image_processing: figs 3, 5 and 8."""
from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import cv2
import numpy as np
from tactile_perception.common.estimates import SlipEstimate

from .bench import Bench, Method, Row, Table, common, mean, reported, shipped
from .figures import OURS, PUBLISHED, TRUTH, Curves, Picture, draw_curves

_FRAMES = 50.0  # Hz
_METHODS = 'paper', 'mechanics'


def _method(bench: Bench, name: str) -> Method:
    return bench.params('taxel_array', {'method': name}), shipped('taxel_array')


def localization(bench: Bench) -> Iterator[Table]:
    """Figs 3 and 5: a bar that is moved and turned: its position and angle, and the points that slip."""
    for scene, what in (('demo', 'moved'), ('turn', 'turned')):
        bag = bench.bag('taxel_array', scene, _FRAMES)
        rows: tuple[list, ...] = [], []
        points: tuple[list, ...] = [], []
        for stamp, true, estimates in bench.compare(bag, *(_method(bench, name) for name in _METHODS)):
            for k, estimate in enumerate(estimates):
                if true.contacts:
                    rows[k].append((stamp, *_pose(estimate.region, true.region)))
            if true.slip is not None and true.slip.state and all(estimate.slip is not None for estimate in estimates):
                for k, estimate in enumerate(estimates):
                    points[k].append(_slipping(estimate.slip, true.slip))
        poses = [np.array(some).reshape(-1, 6) for some in rows]
        yield Table(f'A bar is {what}: fig 3', _pose_rows(poses), 'Frames that both methods report. The paper shows a plot.',
                    (Picture(f'fig_3_{what}', f'A bar is {what}: fig 3', partial(draw_curves, _pose_curves(poses)), (10.0, 3.6)),))
        yield Table(f'Points on a bar that is {what}: fig 5', _slip_rows(points),
                    'Corners in the paper, taxels in ours. The paper shows a plot.',
                    (Picture(f'fig_5_{what}', f'Points that slip on a bar that is {what}: fig 5', partial(draw_curves, (Curves(
                        'y, mm', 'x, mm', {OURS: _steps(points[1]), PUBLISHED: _steps(points[0])}),))),))


def _pose(estimate, true) -> tuple[float, ...]:
    """Estimated x, mm, and angle, degrees; error of position, mm; true x and angle, to which the estimated one is brought by half turns.
    NaN of no estimate."""
    real, side = 1e3 * true.centroid[:2], _long_side(true.outlines)
    if estimate is None:
        return np.nan, np.nan, np.nan, real[0], side
    stated = 1e3 * estimate.centroid[:2]
    turn = (np.degrees(estimate.orientation) - side + 90) % 180 - 90
    return stated[0], side + turn, np.hypot(*(stated - real)), real[0], side


def _pose_rows(poses: list[np.ndarray]) -> list[Row]:
    both = common(*poses)
    return [Row('position, mean error', 'mm', '', *(mean(pose[:, 3]) for pose in both)),
            Row('angle, mean error', 'degrees', '', *(mean(np.abs(pose[:, 2] - pose[:, 5])) for pose in both)),
            Row('frames reported', '%', '', *(reported(pose) for pose in poses))]


def _pose_curves(poses: list[np.ndarray]) -> tuple[Curves, ...]:
    papers, ours = poses
    return tuple(Curves(name, 'time, s', {TRUTH: (ours[:, 0], ours[:, k + 3]), PUBLISHED: (papers[:, 0], papers[:, k]),
                                          OURS: (ours[:, 0], ours[:, k])}) for k, name in enumerate(('x, mm', 'angle, degrees'), 1))


def _slipping(slip: SlipEstimate, true: SlipEstimate) -> np.ndarray:
    """(S, 6): positions, mm, and velocities, mm/s, of the points that slip, and how the object truly moves over the pad there."""
    real = true.linear[0] - true.angular[2] * slip.y, true.linear[1] + true.angular[2] * slip.x
    return 1e3 * np.column_stack([slip.x, slip.y, slip.vx, slip.vy, *real])


def _slip_rows(methods: tuple[list[np.ndarray], ...]) -> list[Row]:
    """Number of points in a frame; mean error of their velocity and its true size, mm/s."""
    every = [np.concatenate([np.zeros((0, 6)), *points]) for points in methods]
    return [Row('points that slip, in a frame', '', '', *(mean([len(one) for one in points]) for points in methods)),
            Row('their velocity, mean error', 'mm/s', '', *(mean(np.hypot(*(some[:, 2:4] - some[:, 4:]).T)) for some in every)),
            Row('their true velocity, mean', 'mm/s', '', *(mean(np.hypot(*some[:, 4:].T)) for some in every))]


def _steps(points: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """x and y, mm, of the displacements of points from frame to frame, with NaN between them."""
    every = np.concatenate([np.zeros((0, 6)), *points])
    ends = every[:, :2], every[:, :2] + every[:, 2:4] / _FRAMES, np.full((len(every), 2), np.nan)
    return tuple(np.stack(ends, axis=1).reshape(-1, 2).T)


def _long_side(outlines: list[np.ndarray]) -> float:
    """Degrees from x to the long side of the rectangle around the largest outline."""
    if not outlines:
        return np.nan
    corners = cv2.boxPoints(cv2.minAreaRect(max(outlines, key=len)[:, :2].astype(np.float32)))
    sides = np.diff(corners[:3], axis=0)
    along = sides[np.linalg.norm(sides, axis=1).argmax()]
    return float(np.degrees(np.arctan2(along[1], along[0])))
