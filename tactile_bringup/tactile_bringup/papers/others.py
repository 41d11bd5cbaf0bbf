# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the papers psd_finger (section 6), touchpad_contact_region (figs 8 to 10) and taxel_array_image_processing (figs 3,
5 and 8)."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np
from sensor_msgs.msg import JointState
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.common.estimates import SlipEstimate
from tactile_perception.common.geometry import matrix_of_quaternion
from tactile_perception.evaluation.evaluation import Evaluation

from .bench import OURS, PUBLISHED, TRUTH, Bench, Curves, Table, mean, shipped

_SAMPLES, _FRAMES, _TAXELS = 1000.0, 10.0, 50.0  # Hz
NO_GAP = 'Its force, eq 5, is that of a flat face at one depth, which a tilted one has not: ours is by calibrated pressure.'
OPENING = 'Its force is that of eq 5 with the true opening of the gripper; ours is by calibrated pressure.'
_GRIPPER = {'gripper.joint': 'finger', 'object.width': 0.030}
_APART = 1e-4  # m, of the pads from the object while nothing touches
WITHIN = 45.0  # degrees from the pole, of the paper's second figure


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between unit vectors (..., 3)."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))


def finger(bench: Bench) -> Iterator[Table]:
    """Figs 8 and 10: 25 places, the error angle and the deviation; fig 11: contacts of two durations."""
    methods = [(bench.params('psd_finger', {'method': method}), shipped('psd_finger')) for method in ('paper', 'map')]
    bag = bench.bag('psd_finger', 'grid', _SAMPLES)
    within = f'within {WITHIN:g} degrees, worst'
    yield Table('25 places: figs 8 and 10', [('error angle, worst', 'degrees', '6'), (f'error angle {within}', 'degrees', ''),
                                             (f'mean deviation {within}', 'degrees', '1.5'), ('places reported', '', '25')],
                *(_places(bench, bag, *how) for how in methods),
                'Eqs 11 to 14: the mean of all estimates of a touch, but for its first and last quarter, and their mean distance from it.')
    for scene, reported in (('slow_taps', '0.25 s at 0.88 Hz'), ('taps', '0.078 s at 3.2 Hz')):
        bag = bench.bag('psd_finger', scene, _SAMPLES)
        yield Table(f'Contacts of {reported}: fig 11', [('contacts reported', '%', ''), ('reported after the onset, median', 'ms', ''),
                                                        ('reported after the onset, worst', 'ms', ''), ('made up', '', '')],
                    *(_taps(bench, bag, *how) for how in methods), 'The paper reports "without significant delay", and a plot.')


def _places(bench: Bench, bag: Path, params: Path, calibration: Path) -> list[float]:
    """Worst error, the same within 45 degrees, worst deviation within 45 degrees, degrees; places reported."""
    touches: dict[int, list] = {}
    for _, estimated, true in bench.instants(bag, params, calibration):
        if len(true.contacts or []) == 1 and len(estimated.contacts or []) == 1:
            touches.setdefault(true.contacts[0].id, []).append((estimated.contacts[0].normal, true.contacts[0].normal))
    rows = []
    for pairs in touches.values():
        stated, true = np.moveaxis(np.array(pairs[len(pairs) // 4:len(pairs) - len(pairs) // 4]), 1, 0)
        middle = stated.mean(0) / np.linalg.norm(stated.mean(0))
        rows.append((_angle(middle, true[0]), _angle(stated, middle).mean(), np.degrees(np.arccos(min(true[0][2], 1.0)))))
    error, deviation, polar = np.array(rows).reshape(-1, 3).T
    near = polar < WITHIN + 1
    return [float(part.max()) if len(part) else np.nan for part in (error, error[near], deviation[near])] + [float(len(rows))]


def _taps(bench: Bench, bag: Path, params: Path, calibration: Path) -> list[float]:
    """Contacts reported, %; their delay, ms, median and worst; contacts made up."""
    evaluation = Evaluation()
    for stamp, estimated, true in bench.instants(bag, params, calibration):
        evaluation.add(stamp, estimated, true)
    found = evaluation.summary()['touches']
    late = found['reported_after_ms']
    return [100.0 * (1 - found['never_reported'] / max(found['there'], 1)), late['median'], late['worst'], float(found['made_up'])]


_PAPERS_TOUCHPAD = {'contact': 'paper', 'detection': 'paper', 'numbering': 'paper'}


def touchpad(bench: Bench) -> Iterator[Table]:
    """Figs 8 to 10: a rectangle, the end of a cylinder and a ring pressed along the normal, without slip."""
    for tool, fig in (('rectangle', 8), ('disc', 9), ('ring', 10)):
        bag = bench.bag('touchpad', f'normal_{tool}', _FRAMES)
        (papers, by_papers), (ours, by_ours) = (_dots(bench, bag, bench.params('touchpad', changes))
                                                for changes in (_PAPERS_TOUCHPAD, {'contact': 'membrane'}))
        index = np.arange(len(by_papers)), np.arange(len(by_ours))
        curves = tuple(Curves(f'{names}, dots', 'sampling index', {PUBLISHED: (index[0], by_papers[:, k]), OURS: (index[1], by_ours[:, k])})
                       for k, names in enumerate(('true positives', 'false positives', 'false negatives')))
        dots = ('dots in contact', 'true positive', 'false positive', 'false negative', 'true positive, at most', 'false positive, then',
                'false negative, then')
        rows = [*((name, 'dots', '') for name in dots), ('pose of the object, mean error', 'mm', '')]
        yield Table(f'{tool}: fig {fig}', rows, papers, ours,
                    'Dots that touch by the truth or by the method, mean over touched frames; last: the frame with most true positives.',
                    curves)


def _dots(bench: Bench, bag: Path, params: Path) -> tuple[list[float], np.ndarray]:
    """The numbers of the table, and true positives, false positives and false negatives of each touched frame (N, 3)."""
    counts, off = [], []
    for _, estimated, true in bench.instants(bag, params, None):
        if true.contacts and estimated.region is not None:
            stated, real = (matrix_of_quaternion(one.pose_rotation) @ true.region.centroid + one.pose_translation  # eq 4
                            for one in (estimated.region, true.region))
            off.append(1e3 * float(np.linalg.norm(stated - real)))
            touching = set(np.asarray(true.region.dot_id)[np.asarray(true.region.dot_state) > 0].tolist())
            stated = set(np.asarray(estimated.region.dot_id)[np.asarray(estimated.region.dot_state) > 0].tolist())
            counts.append((len(touching), len(touching & stated), len(stated - touching), len(touching - stated)))
    if not counts:
        return [np.nan] * 8, np.zeros((0, 3))
    table = np.array(counts, float)
    return [*table.mean(0).tolist(), *table[table[:, 1].argmax(), 1:].tolist(), mean(off)], table[:, 1:]


def taxels(bench: Bench) -> Iterator[Table]:
    """Figs 3 and 5: a bar that is moved and turned, and its corners; fig 8: the wrench while the grip changes, and an object tilts."""
    for scene, what in (('demo', 'moved'), ('turn', 'turned')):
        found = [_trace(bench, bench.bag('taxel_array', scene, _TAXELS), method) for method in ('paper', 'mechanics')]
        papers, ours = (trace for trace, _ in found)
        curves = tuple(Curves(name, 'time, s', {TRUTH: (ours[:, 0], ours[:, k + 3]), PUBLISHED: (papers[:, 0], papers[:, k]),
                                                OURS: (ours[:, 0], ours[:, k])}) for k, name in enumerate(('x, mm', 'angle, degrees'), 1))
        yield Table(f'A bar is {what}: fig 3', [('position, mean error', 'mm', ''), ('angle, mean error', 'degrees', ''),
                                                ('frames reported', '%', '')], _off(papers), _off(ours), 'The paper shows a plot.', curves)
        papers, ours = (points for _, points in found)
        yield Table(f'Points on a bar that is {what}: fig 5', [('points that slip, in a frame', '', ''), (
            'their velocity, mean error', 'mm/s', ''), ('their true velocity, mean', 'mm/s', '')], _slips(papers), _slips(ours),
            'Corners in the paper, taxels in ours. The paper shows a plot.',
            (Curves('y, mm', 'x, mm', {OURS: _ways_of(ours), PUBLISHED: _ways_of(papers)}),))
    for scene, what in (('grip', 'the grip changes'), ('rock', 'the object tilts')):
        bag = bench.bag('taxel_array', scene, _TAXELS)
        flat, ours = scene == 'grip', _wrenches(bench, bag, 'mechanics')
        papers = _wrenches(bench, _with_gripper(bag), 'paper', _GRIPPER) if flat else np.zeros((0, 13))
        curves = tuple(
            Curves(name, 'time, s', {TRUTH: (ours[:, 0], factor * ours[:, k + 6]), PUBLISHED: (papers[:, 0], factor * papers[:, k]),
                                     OURS: (ours[:, 0], factor * ours[:, k])})
            for name, factor, k in (('force along the normal, N', 1.0, 3), ('moment about x, mN m', 1e3, 4)))
        yield Table(f'The wrench while {what}: fig 8', [
            ('force along the normal, mean error', 'N', ''), ('moments along the pad, mean error', 'mN m', ''), ('largest force', 'N', ''),
            ('largest moment', 'mN m', '')], _wrench(papers), _wrench(ours),
            f'The paper shows a plot. {OPENING if flat else NO_GAP}', curves)


def _with_gripper(bag: Path) -> Path:
    """The bag with the position of the gripper that holds the object, on /joint_states before each image: the true depth tells it."""
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


def _trace(bench: Bench, bag: Path, method: str) -> tuple[np.ndarray, list[np.ndarray]]:
    """Of frames with contact (N, 6): stamp, s; estimated x, mm, and angle, degrees; error of position, mm; true x and angle, to which the
    estimated one is brought by half turns. And the points that slip (_points_of) of each frame in which the object does."""
    rows, points = [], []
    for stamp, estimated, true in bench.instants(bag, bench.params('taxel_array', {'method': method}), shipped('taxel_array')):
        if true.contacts and estimated.region is not None:
            stated, real = 1e3 * estimated.region.centroid[:2], 1e3 * true.region.centroid[:2]
            side = _long_side(true.region.outlines)
            turn = (np.degrees(estimated.region.orientation) - side + 90) % 180 - 90
            rows.append((stamp, stated[0], side + turn, np.hypot(*(stated - real)), real[0], side))
        if estimated.slip is not None and true.slip is not None and true.slip.state:
            points.append(_points_of(estimated.slip, true.slip))
    return np.array(rows).reshape(-1, 6), points


def _points_of(slip: SlipEstimate, true: SlipEstimate) -> np.ndarray:
    """(S, 6): places, mm, and velocities, mm/s, of the points that slip, and how the object truly moves over the pad there."""
    real = true.linear[0] - true.angular[2] * slip.y, true.linear[1] + true.angular[2] * slip.x
    return 1e3 * np.column_stack([slip.x, slip.y, slip.vx, slip.vy, *real])


def _slips(points: list[np.ndarray]) -> list[float]:
    """Number of points in a frame; mean error of their velocity and its true size, mm/s."""
    every = np.concatenate([np.zeros((0, 6)), *points])
    return [mean([len(one) for one in points]), mean(np.hypot(*(every[:, 2:4] - every[:, 4:]).T)), mean(np.hypot(*every[:, 4:].T))]


def _ways_of(points: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """x and y, mm, of the ways of points from frame to frame, with NaN between them."""
    every = np.concatenate([np.zeros((0, 6)), *points])
    ends = every[:, :2], every[:, :2] + every[:, 2:4] / _TAXELS, np.full((len(every), 2), np.nan)
    return tuple(np.stack(ends, axis=1).reshape(-1, 2).T)


def _off(trace: np.ndarray) -> list[float]:
    """Mean errors of position, mm, and angle, degrees, of a trace (N, 6); frames reported, %."""
    stated = 100.0 * float(np.isfinite(trace[:, 3]).mean()) if len(trace) else np.nan
    return [mean(trace[:, 3]), mean(np.abs(trace[:, 2] - trace[:, 5])), stated]


def _long_side(outlines: list[np.ndarray]) -> float:
    """Degrees from x to the long side of the rectangle around the largest outline."""
    if not outlines:
        return np.nan
    corners = cv2.boxPoints(cv2.minAreaRect(max(outlines, key=len)[:, :2].astype(np.float32)))
    sides = np.diff(corners[:3], axis=0)
    along = sides[np.linalg.norm(sides, axis=1).argmax()]
    return float(np.degrees(np.arctan2(along[1], along[0])))


def _wrenches(bench: Bench, bag: Path, method: str, more: Mapping = MappingProxyType({})) -> np.ndarray:
    """Of frames with contact (N, 13): stamp, s, estimated and true wrench, N and N m. more: parameters beside the method."""
    found = [(stamp, *estimated.wrench, *true.wrench) for stamp, estimated, true in
             bench.instants(bag, bench.params('taxel_array', {'method': method, **more}), shipped('taxel_array'))
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
