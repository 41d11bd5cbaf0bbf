# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp_video: an animated picture (.webp) of a grasp in MuJoCo, with the images of both sensors and the force beside it."""
from __future__ import annotations

import argparse
from collections.abc import Collection
from pathlib import Path

import cv2
import numpy as np

from tactile_driver.errors import BadArgument, reports_errors

from .constants import GRASP
from .experiment import Sensors, grasp
from .objects import DISTURBANCES, OBJECTS, object_named
from .world import GraspTruth, GraspWorld

_FORCE, _MINIMUM, _MOVED, _TEXT = (90, 200, 90), (160, 160, 160), (60, 140, 255), (230, 230, 230)  # BGR


class Film:
    """Draws a picture of every tenth of a second of a grasp."""

    def __init__(self) -> None:
        self.pictures: list[np.ndarray] = []
        self._curves: list[tuple[float, float, float, float]] = []  # s, N, N, mm

    def __call__(self, world: GraspWorld, truth: GraspTruth, sensors: Sensors, _reported: Collection[str]) -> None:
        """One frame of the engine."""
        moved = 1e3 * float(np.linalg.norm(truth.displacement))
        self._curves.append((truth.time_s, truth.grip_force, truth.least_force, moved))
        if truth.time_s >= GRASP.video_begin_s and round(truth.time_s / GRASP.frame_s) % round(1 / (GRASP.video_rate * GRASP.frame_s)) == 0:
            scene = world.draw(GRASP.scene_side, GRASP.scene_side)
            self.pictures.append(np.vstack([np.hstack([scene, _sensors(sensors)]), self._strip(_event(world.lifted_s))]))

    def _strip(self, event: str) -> np.ndarray:
        """Force, minimum force and displacement until now."""
        width = GRASP.scene_side + GRASP.scene_side // 2
        strip = np.full((GRASP.curves_height, width, 3), 30, np.uint8)
        time_s, *values = np.array(self._curves).T
        across = width * (time_s - GRASP.video_begin_s) / (GRASP.video_s - GRASP.video_begin_s)
        for curve, full, colour in zip(values, (GRASP.full_force, GRASP.full_force, GRASP.full_displacement), (_FORCE, _MINIMUM, _MOVED)):
            known = np.isfinite(curve) & (across >= 0)
            height = (GRASP.curves_height - 4) - (GRASP.curves_height - 24) * np.clip(curve[known] / full, 0, 1)
            cv2.polylines(strip, [np.column_stack([across[known], height]).astype(np.int32)], False, colour, 1, cv2.LINE_AA)
        texts = ((f'grip {values[0][-1]:.1f} N', _FORCE), (f'minimum {values[1][-1]:.1f} N', _MINIMUM),
                 (f'moved {np.nan_to_num(values[2][-1]):.2f} mm', _MOVED), (event, _TEXT))
        for number, (text, colour) in enumerate(texts):
            cv2.putText(strip, text, (6 + 130 * number, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.42, colour, 1, cv2.LINE_AA)
        return strip


def _event(lifted_s: float) -> str:
    """What happens to the object."""
    for disturbance in DISTURBANCES:
        if disturbance.begin_s <= lifted_s < disturbance.end_s + 0.2:
            return 'wrist jerks' if any(disturbance.acceleration) else 'weight doubled' if disturbance.force[2] < 0 else 'tap'
    return ''


def _sensors(sensors: Sensors) -> np.ndarray:
    """The images of the array, above, and of the touchpad."""
    side = GRASP.scene_side // 2
    array = cv2.applyColorMap(cv2.convertScaleAbs(sensors.array.counts, alpha=GRASP.array_gain), cv2.COLORMAP_INFERNO)[::-1]  # y points up
    images = [cv2.resize(array, (side, side), interpolation=cv2.INTER_NEAREST)]
    height, width = sensors.touchpad.image.shape[:2]
    left = (width - height) // 2
    square = np.ascontiguousarray(sensors.touchpad.image[:, left:left + height, :3]) if left > 0 else sensors.touchpad.image
    images.append(cv2.resize(square, (side, side), interpolation=cv2.INTER_AREA)[::-1])
    both = np.vstack(images)
    for row, name in enumerate(('array', 'touchpad')):
        cv2.putText(both, name, (4, 12 + row * side), cv2.FONT_HERSHEY_SIMPLEX, 0.42, _TEXT, 1, cv2.LINE_AA)
    return both


def write_video(path: Path, name: str) -> None:
    """Write the grasp of an object. Raises BadArgument for an unknown one, without MuJoCo, and where nothing can be drawn or written."""
    object_named(name)
    if not hasattr(cv2, 'imwriteanimation'):
        raise BadArgument(f'OpenCV {cv2.__version__} cannot write animated pictures; install 4.11 or later')
    film = Film()
    grasp(name, 'controller', watch=film)
    animation = cv2.Animation()
    animation.frames, animation.durations = film.pictures, np.full(len(film.pictures), round(1e3 / GRASP.video_rate), np.int32)
    if not cv2.imwriteanimation(str(path), animation, [cv2.IMWRITE_WEBP_QUALITY, GRASP.video_quality]):
        raise BadArgument(f'{path} cannot be written; its name must end in .webp')


@reports_errors('grasp_video', OSError)
def main(args: list[str] | None = None) -> int:
    """Write the video; exit code 1 for an unknown object, or where MuJoCo is missing or cannot draw."""
    parser = argparse.ArgumentParser(prog='grasp_video', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('output', type=Path, help='file to write, .webp')
    parser.add_argument('--object', default='box', help=f'object to grasp: {", ".join(OBJECTS)}')
    given = parser.parse_args(args)
    write_video(given.output, given.object)
    print(f'{given.output}: written')
    return 0
