# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes a simulated scene with ground truth as a bag, in the form of a recording that calibrate and process_bag read."""
from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import cv2
from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.frame_names import optical_frame
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, truth_messages
from tactile_driver.nodes.messages.transforms import camera_transforms
from tactile_driver.recordings.writer import write_messages
from tactile_driver.simulation.scene.scene import TwoCameraScene
from tactile_driver.simulation.scene.shutters import Shutters
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene
from tactile_driver.sources.dual_camera.pairs import NAMES
from tactile_perception.nodes.messages.description import description_messages
from tactile_perception.sensors import MARKER_SENSOR_TYPES

_FIRST_NS = 10**9  # chosen: much of ROS takes a stamp of zero for an unknown time
_SECOND_NS = 10**9
_TWO_CAMERAS = tuple(f'{name}_' for name, kind in MARKER_SENSOR_TYPES.items() if kind.cameras == 2)  # prefixes of the scenes' names


def write_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = '', frames: int = 0,
                shutters: Shutters | None = None) -> int:
    """Write a scene to a new bag at rate Hz under namespace (empty: the sensor's type); the number of frames written.

    frames: how many to write, 0 for the whole scene; shutters: of two cameras, None for those of the scene.
    Raises BadArgument for an unknown scene or an existing bag.
    """
    scene = open_dual_scene(name, rate, seed, shutters) if name.startswith(_TWO_CAMERAS) else open_scene(name, rate, seed)
    numbers, namespace, count = TouchNumbers(), namespace or scene.sensor, frames or scene.frames
    described = _description(scene, namespace, {'scene': name, 'seed': seed, 'rate': rate})
    frames_of = chain.from_iterable(_messages(scene, number, numbers, namespace) for number in range(count))
    write_messages(path, namespace, chain(described, frames_of))
    return count


def _description(scene, frame_id: str, about: dict) -> Iterator[tuple[int, str, object]]:
    """The description, and the poses of the cameras."""
    two = isinstance(scene, TwoCameraScene)
    cameras = dict(zip(NAMES, scene.cameras)) if two else {'': scene.camera}
    poses = {name: (cv2.Rodrigues(camera.rotation)[0].ravel(), camera.translation) for name, camera in cameras.items()}
    size = {} if two else {'width': scene.camera.width, 'height': scene.camera.height}
    about = {'source': 'sim', 'device': f'simulated {scene.sensor}', **about, **size, 'encoding': 'bgr8'}
    return description_messages(_FIRST_NS, scene.sensor, frame_id, about, camera_transforms(frame_id, poses))


def _messages(scene, number: int, numbers: TouchNumbers, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message) of one frame; ground truth has the stamp of the only or the left view."""
    stamp_ns = _FIRST_NS + round(number / scene.rate * _SECOND_NS)
    if isinstance(scene, TwoCameraScene):
        left, right, truth = scene.render(number / scene.rate)
        right_ns = stamp_ns + round(scene.right_delay(number) * _SECOND_NS)
        views = (('left', left, scene.cameras[0], stamp_ns), ('right', right, scene.cameras[1], right_ns))
    else:
        seen = scene.render(number / scene.rate)
        truth, views = seen.truth, (('', seen.image, scene.camera, stamp_ns),)
    for view, image, camera, own_ns in views:
        prefix = view and view + '/'
        info = calibration_to_message(pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height)))
        info.header = header_of(own_ns, optical_frame(frame_id, view))
        yield own_ns, f'{prefix}camera_info', info
        yield own_ns, f'{prefix}image_raw', image_to_message(Frame(image, own_ns, 'bgr8'), '', info.header)
    header = header_of(stamp_ns, frame_id)
    for name, message in truth_messages(truth, numbers.assign(truth.contacts), 1 / scene.rate, header).items():
        yield stamp_ns, f'ground_truth/{name}', message
