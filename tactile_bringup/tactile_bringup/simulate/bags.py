# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""simulate: writes a scene of a simulated sensor as a recording with ground truth, as fast as the machine computes it.

The bag holds the topics of the driver and ground_truth/*, for calibrate, process_bag and evaluate.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from itertools import chain
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np

from tactile_driver.camera.pairs import NAMES
from tactile_driver.errors import by_name, reports_errors
from tactile_driver.frame import Frame, SampleBlock, pinhole_calibration
from tactile_driver.frame_names import optical_frame
from tactile_driver.nodes.messages.conversions import (
    calibration_to_message,
    camera_transforms,
    header_of,
    image_to_message,
    instants,
    stamp_ns_of,
    static_transform,
    voltages_message,
)
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message, frame_messages, recorded_truth
from tactile_driver.recordings.scenes import SceneWriter
from tactile_driver.recordings.writer import write_messages
from tactile_driver.simulation.constants import SIMULATION
from tactile_driver.simulation.psd_scene import PSD_SCENES, open_psd_scene
from tactile_driver.simulation.scene.scene import TwoCameraScene
from tactile_driver.simulation.sensors.scenes import AREAL_DUAL_SCENES, GEL_SCENES, SCENES, open_dual_scene, open_scene
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES, TaxelScene, open_taxel_scene
from tactile_driver.sources.source import FIRST_S, NS
from tactile_perception.common.messages import description_messages
from tactile_perception.core.sensor_type import SENSOR_TYPES

_FIRST_NS = round(FIRST_S * NS)
_BATCH_S = 0.01  # duration of the samples of a finger in one message


def write_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = '', frames: int = 0) -> int:
    """Write a scene to a new bag at rate Hz under namespace (empty: the sensor's type); returns the number of frames written.

    frames: how many to write, 0 for the whole scene. Raises BadArgument for an unknown scene or an existing bag.
    """
    scene = (open_dual_scene if name in AREAL_DUAL_SCENES else open_scene)(name, rate, seed)
    return write_opened(path, scene, {'scene': name, 'seed': seed}, namespace, frames)


def write_opened(path: Path, scene, about: Mapping = MappingProxyType({}), namespace: str = '', frames: int = 0) -> int:
    """As write_scene, of a scene of one or two cameras that is open; about: what its description says besides."""
    numbers, namespace, count = TouchNumbers(), namespace or scene.sensor, frames or scene.frames
    two = isinstance(scene, TwoCameraScene)
    cameras = dict(zip(NAMES, scene.cameras)) if two else {'': scene.camera}
    poses = {view: (cv2.Rodrigues(camera.rotation)[0].ravel(), camera.translation) for view, camera in cameras.items()}
    size = {} if two else {'width': scene.camera.width, 'height': scene.camera.height}
    _write(path, scene, namespace, {**about, **size, 'encoding': 'bgr8'}, camera_transforms(namespace, poses),
           chain.from_iterable(camera_messages(scene, number, numbers, namespace) for number in range(count)))
    return count


def write_psd_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = 'psd_finger') -> int:
    """As write_scene, as psd_node publishes it, at rate samples/s; returns the number of samples written."""
    scene = open_psd_scene(name, rate, seed)
    _write(path, scene, namespace, {'scene': name, 'seed': seed},
           [static_transform(namespace, f'{namespace}_tip', (0.0, 0.0, SIMULATION.cover_radius))], psd_messages(scene, rate, namespace))
    return scene.samples


def write_taxel_scene(path: Path, name: str, rate: float, seed: int = 0, namespace: str = '',
                      scene: TaxelScene | None = None) -> int:
    """As write_scene, as taxel_array_node publishes it. scene: of another device, instead of the one of that name."""
    scene = scene or open_taxel_scene(name, rate, seed)
    pad, namespace = scene.specimen, namespace or scene.sensor
    _write(path, scene, namespace, {'scene': name, 'seed': seed, 'width': pad.columns, 'height': pad.rows, 'encoding': 'mono8'},
           [static_transform(namespace, f'{namespace}_taxels', (0.0, 0.0, -pad.thickness))], taxel_messages(scene, rate, namespace))
    return scene.frames


def write_played(kind: SceneWriter, path: Path, name: str, rate: float, seed: int = 0, namespace: str = '') -> int:
    """As write_scene, of the scenes of a sensor type that names its own; kind: these."""
    scene = kind.open_scene(name, rate, seed)
    namespace = namespace or scene.sensor
    _write(path, scene, namespace, {'scene': name, 'seed': seed},
           [static_transform(namespace, f'{namespace}_{part}', position) for part, position in kind.parts.items()],
           kind.messages(scene, namespace, _FIRST_NS))
    return scene.frames


def _write(path: Path, scene, namespace: str, about: dict, transforms: list, messages: Iterator[tuple[int, str, object]]) -> None:
    """Write messages to a new bag, after the description, about, and the transforms of the sensor's parts."""
    about = {'source': 'sim', 'device': f'simulated {scene.sensor}', **about, 'rate': scene.rate}
    write_messages(path, namespace, chain(description_messages(_FIRST_NS, scene.sensor, namespace, about, transforms), messages))


def _stamp(number: int, rate: float) -> int:
    """Stamp, ns, of a frame or sample."""
    return _FIRST_NS + round(number / rate * NS)


def camera_messages(scene, number: int, numbers: TouchNumbers, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message) of one frame of a camera scene; ground truth has the stamp of the only or the left view."""
    stamp_ns = _stamp(number, scene.rate)
    if isinstance(scene, TwoCameraScene):
        left, right, truth = scene.render(number / scene.rate)
        right_ns = stamp_ns + round(scene.right_delay(number) * NS)
        views = (('left', left, scene.cameras[0], stamp_ns), ('right', right, scene.cameras[1], right_ns))
    else:
        seen = scene.render(number / scene.rate)
        truth, views = seen.truth, (('', seen.image, scene.camera, stamp_ns),)
    for view, image, camera, own_ns in views:
        prefix = view and view + '/'
        header = header_of(own_ns, optical_frame(frame_id, view))
        calibration = pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height))
        yield own_ns, f'{prefix}camera_info', calibration_to_message(calibration, header)
        yield own_ns, f'{prefix}image_raw', image_to_message(Frame(image, own_ns, 'bgr8'), '', header)
    yield from recorded_truth(truth, numbers, 1 / scene.rate, header_of(stamp_ns, frame_id))


def psd_messages(scene, rate: float, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message): blocks of voltages, each with ground truth at its first sample and at each contact change."""
    numbers, count = TouchNumbers(), max(round(_BATCH_S * rate), 1)
    scale = scene.electronics.full_scale / 2**scene.electronics.bits
    for first in range(0, scene.samples, count):
        counts, truth = scene.play(first, min(count, scene.samples - first))
        block = SampleBlock((counts * scale).astype(np.float32), _stamp(first, rate), 1 / rate)
        yield block.stamp_ns, 'voltages', voltages_message(block, frame_id)
        for k in instants(truth.touching):
            touches, stamp = truth.touches(k), _stamp(first + k, rate)
            yield stamp, 'ground_truth/contacts', contacts_message(touches, numbers.assign(touches), header_of(stamp, frame_id))


def taxel_messages(scene, rate: float, frame_id: str) -> Iterator[tuple[int, str, object]]:
    """(Stamp in ns, topic, message) of all frames of a taxel scene."""
    return frame_messages(scene, rate, frame_id, _FIRST_NS, 'image_raw',
                          lambda values, header: image_to_message(Frame(values, stamp_ns_of(header), 'mono8'), '', header))


#: Driver, or `camera` for those with cameras -> function that writes a scene to a bag, default rate (Hz), names of the scenes.
_WRITERS = {'camera': (write_scene, 30.0, SCENES | GEL_SCENES), 'psd_node': (write_psd_scene, 1000.0, PSD_SCENES),
            'taxel_array_node': (write_taxel_scene, 100.0, TAXEL_SCENES)}


def writers() -> dict[str, tuple[Callable[..., int], float, Collection[str]]]:
    """_WRITERS, and those of the drivers whose sensor types name their own scenes."""
    own = {kind.driver: kind.scenes for kind in SENSOR_TYPES.values() if kind.simulation}
    return _WRITERS | {driver: (partial(write_played, played), played.rate, played.scenes) for driver, played in own.items()}


def writer_of(sensor: str) -> tuple[Callable[..., int], float, Collection[str]]:
    """The entry of writers for a sensor type, or for `camera`. Raises BadArgument for an unknown type, or one that is not simulated."""
    if sensor == 'camera':
        return _WRITERS['camera']
    driver = by_name(SENSOR_TYPES, sensor, 'sensor').driver
    return by_name(writers(), 'camera' if driver in ('camera_node', 'dual_camera_node') else driver, f'simulation of a {sensor}: driver')


@reports_errors('simulate')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 1 and one error line on failure."""
    known = writers()
    scenes = '\n'.join(f'{kind}: {", ".join(sorted(names))}' for kind, (_, _, names) in known.items())
    parser = argparse.ArgumentParser('simulate', description=__doc__, epilog='scenes\n' + scenes,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensor', help=f'camera, whose scene determines the sensor, or one of {", ".join(SENSOR_TYPES)}')
    parser.add_argument('scene')
    parser.add_argument('bag', type=Path, help='rosbag2 to write (MCAP); it must not exist')
    parser.add_argument('--rate', type=float, help='frames or samples a second; default ' +
                        ', '.join(f'{rate:g} ({kind})' for kind, (_, rate, _) in known.items()))
    parser.add_argument('--seed', type=int, default=0, help='seed of the noise and of the specimen')
    given = parser.parse_args(args)
    write, rate, _ = writer_of(given.sensor)
    count = write(given.bag, given.scene, given.rate or rate, given.seed)
    print(f'{given.bag}: {count} frames or samples of {given.scene}')
    return 0
