# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper taxel_array_image_processing: figs 3, 5 and 8."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np
from sensor_msgs.msg import JointState
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.common.estimates import SlipEstimate

from .bench import Bench, Method, Row, Table, common, mean, reported, shipped
from .figures import OURS, PUBLISHED, TRUTH, Curves, Picture, draw_curves

_FRAMES = 50.0  # Hz
_METHODS = 'paper', 'mechanics'
NO_GAP = 'Its force, eq 5, is that of a flat face at one depth, which a tilted one has not: ours is by calibrated pressure.'
OPENING = 'Its force is that of eq 5 with the true opening of the gripper; ours is by calibrated pressure.'
_GRIPPER = {'gripper.joint': 'finger', 'object.width': 0.030}
_APART = 1e-4  # m, of the pads from the object while nothing touches


def _method(bench: Bench, name: str, more: Mapping = MappingProxyType({})) -> Method:
    """more: parameters beside the method."""
    return bench.params('taxel_array', {'method': name, **more}), shipped('taxel_array')


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


def wrenches(bench: Bench) -> Iterator[Table]:
    """Fig 8: the wrench while the grip changes, and while an object tilts."""
    for scene, what in (('grip', 'the grip changes'), ('rock', 'the object tilts')):
        bag = bench.bag('taxel_array', scene, _FRAMES)
        flat, ours = scene == 'grip', _wrenches(bench, bag, _method(bench, 'mechanics'))
        papers = _wrenches(bench, _with_gripper(bag), _method(bench, 'paper', _GRIPPER)) if flat else np.zeros((0, 13))
        names = ('force along the normal, mean error', 'N'), ('moments along the pad, mean error', 'mN m'), ('largest force', 'N'), (
            'largest moment', 'mN m')
        curves = tuple(
            Curves(name, 'time, s', {TRUTH: (ours[:, 0], factor * ours[:, k + 6]), PUBLISHED: (papers[:, 0], factor * papers[:, k]),
                                     OURS: (ours[:, 0], factor * ours[:, k])})
            for name, factor, k in (('force along the normal, N', 1.0, 3), ('moment about x, mN m', 1e3, 4)))
        yield Table(f'The wrench while {what}: fig 8', [
            Row(*name, '', *pair) for name, *pair in zip(names, _wrench(papers), _wrench(ours))],
                    f'The paper shows a plot. {OPENING if flat else NO_GAP}',
                    (Picture(f'fig_8_{scene}', f'The wrench while {what}: fig 8', partial(draw_curves, curves), (10.0, 3.6)),))


def _with_gripper(bag: Path) -> Path:
    """The bag with the position of the gripper that holds the object, on /joint_states before each image: the true depth gives it."""
    stated = bag.with_name(f'{bag.name}_gripper')
    if stated.exists():
        return stated
    with BagReader(bag) as reader, BagWriter(stated) as writer:
        for raw in reader.messages():
            if raw.topic.endswith('ground_truth/contacts'):
                message = decode(raw.data, raw.type_name)
                depth = max((contact.depth for contact in message.contacts), default=-_APART)
                joint = JointState(header=message.header, name=[_GRIPPER['gripper.joint']], position=[_GRIPPER['object.width'] - 2 * depth])
                kind, data = encode(joint)
                writer.write('/joint_states', kind, raw.stamp_ns - 1, data)
            writer.write(*raw[:4])
    return stated


def _wrenches(bench: Bench, bag: Path, method: Method) -> np.ndarray:
    """Of frames with contact (N, 13): stamp, s, estimated and true wrench, N and N m."""
    found = [(stamp, *estimated.wrench, *true.wrench) for stamp, true, (estimated,) in bench.compare(bag, method)
             if true.contacts and estimated.wrench is not None and true.wrench is not None]
    return np.array(found).reshape(-1, 13)


def _wrench(found: np.ndarray) -> list[float]:
    """Mean errors of the normal force, N, and of the moments along the pad, mN m; their largest true values."""
    if not len(found):
        return [np.nan] * 4
    stated, true = found[:, 1:7], found[:, 7:]
    parts = (1.0, slice(2, 3)), (1e3, slice(3, 5))
    return [factor * mean(np.linalg.norm((stated - true)[:, part], axis=1)) for factor, part in parts] + [
        factor * float(np.linalg.norm(true[:, part], axis=1).max()) for factor, part in parts]
