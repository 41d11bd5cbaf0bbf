# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the paper taxel_array_image_processing: figs 3 to 5."""
from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from tactile_driver.nodes.messages.images import grey_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.taxel.pad import FACES
from tactile_driver.simulation.taxel.scene import open_taxel_scene
from tactile_perception.common.estimates import ContactRegionEstimate, SlipEstimate
from tactile_perception.evaluation.scores import region_iou
from tactile_perception.published.taxel_array_image_processing import image_moments
from tactile_perception.taxel.pressure import TaxelArray

from .bench import Bench, Detail, Method, Row, Table, common, mean, reported, shipped
from .constants import PAPERS
from .figures import COLOURS, OURS, PUBLISHED, TRUTH, Curves, Picture, draw_curves, legend_of

PRESSED = 'spread pressure'
_METHODS = 'paper', 'mechanics'


def _method(bench: Bench, name: str) -> Method:
    return bench.params('taxel_array', {'method': name}), shipped('taxel_array')


def localization(bench: Bench) -> Iterator[Table]:
    """Figs 3 and 5: a bar that is moved and turned: its position and angle, and the points that slip."""
    for scene, what in (('demo', 'moved'), ('turn', 'turned')):
        bag = bench.bag('taxel_array', scene, PAPERS.taxel_rate)
        rows: tuple[list, ...] = [], []
        slips = []
        for stamp, true, estimates in bench.compare(bag, *(_method(bench, name) for name in _METHODS)):
            if true.contacts:
                for found, estimate in zip(rows, estimates):
                    found.append((stamp, *_pose(estimate.region, true.region)))
            if true.slip is not None and true.slip.state:
                slips.append((stamp, true.slip, tuple(_slipping(estimate.slip, true.slip) for estimate in estimates)))
        poses = [np.array(some).reshape(-1, 7) for some in rows]
        yield Table('A bar: fig 3', _pose_rows(poses), 'Frames that both methods report. The paper shows a plot.',
                    (Picture(f'fig_3_{what}', f'A bar is {what}: fig 3', partial(draw_curves, _pose_curves(poses)), (9.0, 6.5)),), what)
        tracks = [_tracks([points[k] for *_, points in slips], [true for _, true, _ in slips]) for k in range(2)]
        yield Table('Points on a bar: fig 5', [*_slip_rows([points for *_, points in slips]), *_track_rows(tracks)],
                    'Corners in the paper, taxels in ours. Velocities of frames in which both methods report points. A track follows a '
                    'point from frame to frame; its displacement is that while the bar slips. The paper shows a picture.',
                    (Picture(f'fig_5_{what}', f'Tracks of points on a bar that is {what}: fig 5',
                             partial(_draw_tracks, _image(bag, slips[-1][0]) if slips else None, tracks), (10.0, 5.6)),), what)


def _pose(estimate: ContactRegionEstimate | None, true: ContactRegionEstimate) -> tuple[float, ...]:
    """Estimated and true x and y, mm, and angle, degrees; the estimated angle is brought to the true one by half turns. NaN of no
    estimate."""
    real, side = 1e3 * true.centroid[:2], _long_side(true.outlines)
    if estimate is None:
        return np.nan, np.nan, np.nan, *real, side
    turn = (np.degrees(estimate.orientation) - side + 90) % 180 - 90
    return *(1e3 * estimate.centroid[:2]), side + turn, *real, side


def _pose_rows(poses: list[np.ndarray]) -> list[Row]:
    compared = common(*poses)
    return [Row('position, mean error', 'mm', '', *(mean(np.hypot(*(pose[:, 1:3] - pose[:, 4:6]).T)) for pose in compared), cause=PRESSED),
            Row('angle, mean error', 'degrees', '', *(mean(np.abs(pose[:, 3] - pose[:, 6])) for pose in compared), cause=PRESSED),
            Row('frames reported', '%', '', *(reported(pose) for pose in poses))]


def _pose_curves(poses: list[np.ndarray]) -> tuple[Curves, ...]:
    papers, ours = common(*poses)
    names = 'time, s', 'x, mm', 'y, mm', 'angle, degrees'
    return tuple(Curves(names[k], names[over], {TRUTH: (ours[:, over + 3 if over else 0], ours[:, k + 3]),
                                                PUBLISHED: (papers[:, over], papers[:, k]), OURS: (ours[:, over], ours[:, k])})
                 for over, k in ((1, 2), (0, 3), (0, 1), (0, 2)))


def _slipping(slip: SlipEstimate | None, true: SlipEstimate) -> np.ndarray:
    """(S, 6): positions, mm, and velocities, mm/s, of the points that slip, and how the object truly moves over the pad there."""
    if slip is None:
        return np.zeros((0, 6))
    return 1e3 * np.column_stack([slip.x, slip.y, slip.vx, slip.vy, *_true_velocity(true, slip.x, slip.y)])


def _true_velocity(true: SlipEstimate, x, y) -> tuple:
    return true.linear[0] - true.angular[2] * y, true.linear[1] + true.angular[2] * x


def _slip_rows(frames: list[tuple[np.ndarray, ...]]) -> list[Row]:
    """Number of points in a frame; mean error of their velocity and its true size, mm/s; frames: points of each method."""
    seen = np.array([[len(points) > 0 for points in frame] for frame in frames]).reshape(-1, 2)
    compared = [frame for frame in frames if all(len(points) > 0 for points in frame)]
    every = [np.concatenate([np.zeros((0, 6)), *(frame[k] for frame in compared)]) for k in range(2)]
    return [Row('points that slip, in a frame', '', '', *(mean([len(frame[k]) for frame in frames]) for k in range(2))),
            Row('frames with such points', '%', '', *(100.0 * seen.mean(axis=0) if len(seen) else (np.nan, np.nan))),
            Row('their velocity, mean error', 'mm/s', '', *(mean(np.hypot(*(some[:, 2:4] - some[:, 4:]).T)) for some in every)),
            Row('their true velocity, mean', 'mm/s', '', *(mean(np.hypot(*some[:, 4:].T)) for some in every))]


def _tracks(frames: list[np.ndarray], truth: list[SlipEstimate]) -> list[np.ndarray]:
    """Each (N, 4): position of a track, mm, in N frames, and where the point truly is that was there at its beginning.

    A track moves with the nearest point within PAPERS.max_link, and stays where there is none. A point farther than PAPERS.min_spacing from
    all tracks begins one.
    """
    tracks: list[list[np.ndarray]] = []
    for points, true in zip(frames, truth):
        ends = np.array([track[-1][:2] for track in tracks]).reshape(-1, 2)
        for position in points[:, :2]:
            if not len(ends) or np.hypot(*(ends - position).T).min() > PAPERS.min_spacing:
                tracks.append([np.tile(position, 2)])
                ends = np.concatenate([ends, [position]])
        for track in tracks:
            position, true_position = track[-1][:2], track[-1][2:]
            distance = np.hypot(*(points[:, :2] - position).T)
            step = points[distance.argmin(), 2:4] if len(distance) and distance.min() < PAPERS.max_link else np.zeros(2)
            true_step = 1e3 * np.array(_true_velocity(true, *(1e-3 * true_position)))
            track.append(track[-1] + np.concatenate([step, true_step]) / PAPERS.taxel_rate)
    return [np.array(track) for track in tracks]


def _track_rows(methods: list[list[np.ndarray]]) -> list[Row]:
    ends = [np.array([np.concatenate([track[-1, :2] - track[-1, 2:], track[-1, 2:] - track[0, 2:]]) for track in tracks]).reshape(-1, 4)
            for tracks in methods]
    return [Row('tracks', '', '', *(float(len(tracks)) for tracks in methods)),
            Row('displacement of a track, mean error', 'mm', '', *(mean(np.hypot(*end[:, :2].T)) for end in ends)),
            Row('its true displacement, mean', 'mm', '', *(mean(np.hypot(*end[:, 2:].T)) for end in ends))]


def _image(bag: Path, stamp: float) -> np.ndarray | None:
    """The tactile image (rows, columns) at a stamp, s."""
    with BagReader(bag) as reader:
        for raw in reader.messages():
            if raw.topic.endswith('image_raw') and abs(1e-9 * raw.stamp_ns - stamp) < 0.5 / PAPERS.taxel_rate:
                return grey_to_array(decode(raw.data, raw.type_name), 'taxel image')
    return None


def _show(axis, image: np.ndarray | None) -> None:
    """The tactile image, in mm."""
    if image is not None:
        rows, columns = image.shape
        axis.imshow(image, cmap='gray', extent=(-0.5 * columns, 0.5 * columns, 0.5 * rows, -0.5 * rows))  # of 1 mm pitch
    axis.set(xlabel='x, mm', ylabel='y, mm')
    axis.title.set_fontsize('small')


def _draw_tracks(image: np.ndarray | None, methods: list[list[np.ndarray]], figure) -> None:
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for axis, name, tracks in zip(axes, (PUBLISHED, OURS), methods):
        for track in tracks:
            axis.plot(*track[:, 2:].T, color='C2', linewidth=2.5, label='where the point truly went')
            axis.plot(*track[:, :2].T, color='white', linewidth=1.0, label='track')
            axis.plot(*track[-1, :2], '.', color='white', markersize=4)
        axis.set_facecolor('black')
        axis.set_title(name)
        _show(axis, image)
    legend = legend_of(figure, axes)
    legend.get_frame().set_facecolor('silver')


def shapes(bench: Bench) -> Iterator[Table]:
    """Fig 4: the shape of a contact by edges."""
    found, shown = [], []
    for face in FACES:
        bag, overlaps, last = bench.bag('taxel_array', face, PAPERS.taxel_rate), [], None
        for stamp, true, estimates in bench.compare(bag, *(_method(bench, name) for name in _METHODS)):
            if true.contacts and true.region is not None:
                overlaps.append([np.nan if one.region is None else region_iou(_loops(one.region), _loops(true.region))
                                 for one in estimates])
                if stamp < PAPERS.held_until_s:
                    last = stamp, [_loops(one.region) for one in estimates if one.region is not None]
        by_edges, ours = common(*np.moveaxis(np.array(overlaps).reshape(-1, 2), 1, 0)[..., None])
        found.append(Row(f'{face}, overlap', 'IoU', '', mean(by_edges), mean(ours), ideal=1.0))
        if last is not None:
            shown.append((face, _image(bag, last[0]), last[1]))
    yield Table('Shape of a contact: fig 4', found, 'Intersection over union of the region within the boundary and the true one, mean over '
                'the frames that both methods report. The paper shows a picture.',
                (Picture('fig_4', 'Boundaries of contacts: fig 4', partial(_draw_shapes, shown), (12.0, 6.6)),))


def _loops(region: ContactRegionEstimate) -> list[np.ndarray]:
    return region.outlines + region.holes


def _draw_shapes(shown: list[tuple[str, np.ndarray | None, list[list[np.ndarray]]]], figure) -> None:
    axes = figure.subplots(2, -(-len(shown) // 2), squeeze=False, sharex=True, sharey=True).ravel()
    for axis, (face, image, methods) in zip(axes, shown):
        for name, loops, width in zip((PUBLISHED, OURS), methods, (2.0, 1.0)):
            for loop in loops:
                closed = 1e3 * np.concatenate([loop, loop[:1]])
                axis.plot(*closed[:, :2].T, color=COLOURS[name], linewidth=width, label=name)
        axis.set_title(face)
        _show(axis, image)
        axis.label_outer()
    legend_of(figure, axes)


def values(bench: Bench) -> Iterator[Detail]:
    """Position and angle by the moments of other taxels and values."""
    found = []
    for name, what in (('demo', 'moved'), ('turn', 'turned')):
        scene, errors, untouched = open_taxel_scene(name, PAPERS.taxel_rate, bench.seed), [], []
        array = TaxelArray(scene.specimen.rows, scene.specimen.columns, scene.specimen.pitch, 255.0)
        for number in range(scene.frames):
            counts, true = scene.render(number / PAPERS.taxel_rate)
            if number < PAPERS.untouched_frames:
                untouched.append(counts.astype(float))
            elif true.contacts:
                change = counts - np.mean(untouched, axis=0)
                nonzero = change > 3 * np.std(untouched)
                face = _raster(true.outlines, array)
                side = _long_side(true.outlines)
                error = []
                for image in (np.where(nonzero, change, 0), np.where(face, np.maximum(change, 0), 0), face.astype(float)):
                    position, angle = image_moments(image, array)
                    error += [1e3 * float(np.hypot(*(position - true.centroid[:2]))), abs((np.degrees(angle) - side + 90) % 180 - 90)]
                errors.append(error)
        means = np.nanmean(np.array(errors).reshape(-1, 3, 2), axis=0)
        found += [(f'{what}, {taxels}', *pair.tolist()) for taxels, pair in zip(
            ('values of the nonzero taxels', 'values of the taxels under the true face', 'the same taxels, all values equal'), means)]
    yield Detail(PRESSED, ('bar', 'position, mean error, mm', 'angle, mean error, degrees'), found,
                 'Eqs 1 to 4. Friction moves pressure to the front of the object and beside it, and the sheet spreads it. Ours cuts the '
                 'pressure at a part of its local level and takes the traction off first.')


def _raster(outlines: list[np.ndarray], array: TaxelArray) -> np.ndarray:
    """(rows, columns) bool: taxels whose middle lies within an outline."""
    image = np.zeros(array.shape, np.uint8)
    middle = 0.5 * np.array([array.columns - 1, array.rows - 1])
    cv2.fillPoly(image, [np.round(loop[:, :2] / array.pitch + middle).astype(np.int32) for loop in outlines], 1)
    return image > 0


def _long_side(outlines: list[np.ndarray]) -> float:
    """Degrees from x to the long side of the rectangle around the largest outline."""
    if not outlines:
        return np.nan
    corners = cv2.boxPoints(cv2.minAreaRect(max(outlines, key=len)[:, :2].astype(np.float32)))
    sides = np.diff(corners[:3], axis=0)
    along = sides[np.linalg.norm(sides, axis=1).argmax()]
    return float(np.degrees(np.arctan2(along[1], along[0])))
