# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated sensors, untouched and pressed, and their perception from message to message, as nodes and process_bag run it."""
import copy
import functools
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from judged import touchpad_parameters
from sensor_msgs.msg import CameraInfo

from tactile_bringup import share
from tactile_driver.frame import Frame, SampleBlock, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message, voltages_message
from tactile_driver.simulation.psd_scene import open_psd_scene
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene
from tactile_driver.simulation.taxel.scene import open_taxel_scene
from tactile_driver.stitching.calibration import load_stitching
from tactile_driver.stitching.methods import make_stitcher
from tactile_perception.bags.replay import make_stage
from tactile_perception.core.parameter_files import write_parameters

SENSORS = ('touchpad', 'areal_single', 'areal_dual', 'air_cushion', 'psd_finger', 'taxel_array')
SHEETS = SENSORS[1:4]
STEP_NS, FIRST_NS = 10**8, 10**9
PRESSED_AT = {'touchpad': 2.7, 'areal_single': 2.9, 'areal_dual': 2.9, 'air_cushion': 3.2}  # s from the start of the scenes
_SCENES = {'touchpad': 'disc_twist'}
_FOLDER = Path(tempfile.mkdtemp(prefix='stability_'))


class Seen:
    """What a sensor sees. rest: untouched images (voltages, pressures); pressed: one with a press; truth: its contacts; untouched, touched:
    the whole truth of the first and of that one; info: camera_info, None without a camera; values: parameters beyond those that ship."""

    def __init__(self, sensor, rest, pressed, truth, info=None, values=None, untouched=None, touched=None):
        self.sensor, self.rest, self.pressed, self.truth, self.info = sensor, rest, pressed, truth, info
        self.values, self.untouched, self.touched = values or {}, untouched, touched
        self.calibration = None if sensor == 'touchpad' else Path(share('calibration', f'{sensor}_sim.yaml'))

    def chain(self, **changes):
        """A new perception with changed parameters; two underscores stand for the dot of a name."""
        return Chain(self, {**self.values, **{name.replace('__', '.'): value for name, value in changes.items()}})


def camera(sensor, name='', at=None, scene=None, width=640, height=480):
    """A sensor with cameras: the scene of that name, or its own, pressed at s."""
    name, at = name or _SCENES.get(sensor, f'{sensor}_press'), PRESSED_AT[sensor] if at is None else at
    if sensor == 'areal_dual':
        scene, stitch = open_dual_scene(name, 10.0), stitcher()
        frames = [scene.render(k / 10) for k in range(6)] + [scene.render(at)]
        images, truths = [stitch(left, right) for left, right, _ in frames], [truth for *_, truth in frames]
        info = CameraInfo(width=images[0].shape[1], height=images[0].shape[0])
    else:
        scene = scene or open_scene(name, rate=10.0, seed=int(sensor == 'touchpad'), width=width, height=height)
        frames = [scene.render(k / 10) for k in range(6)] + [scene.render(at)]
        images, truths = [frame.image for frame in frames], [frame.truth for frame in frames]
        info = calibration_to_message(pinhole_calibration(scene.camera.matrix, scene.camera.distortion, (width, height)))
    values = touchpad_parameters(scene) if sensor == 'touchpad' else {}
    return Seen(sensor, images[:-1], images[-1], truths[-1].contacts, info, values, truths[0], truths[-1])


def stitcher():
    """Function that stitches the two views of the simulated sheet, either of which may be None."""
    return make_stitcher('plane', load_stitching(share('calibration', 'areal_dual_sim.yaml'))).stitch


def _finger():
    scene = open_psd_scene('grid', 1000.0, 0)
    counts, truth = scene.play(0, 1500)
    volts = (counts * (scene.electronics.full_scale / 2**scene.electronics.bits)).astype(np.float32)
    first = np.flatnonzero(truth.touching > 0)[0]
    return Seen('psd_finger', list(volts[:(first - 20) // 100 * 100].reshape(-1, 100, 4)), volts[first - 30:first + 70],
                truth.touches(first + 100))


def _array():
    scene = open_taxel_scene('demo', 100.0, 0)
    frames = [scene.render(k / 100) for k in (*range(20), 110)]
    return Seen('taxel_array', [values for values, _ in frames[:-1]], frames[-1][0], frames[-1][1].contacts)


@functools.cache
def seen(sensor):
    """The sensor of that type; nobody may change its arrays."""
    return {'psd_finger': _finger, 'taxel_array': _array}.get(sensor, lambda: camera(sensor))()


class Chain:
    """A sensor's perception; each call is a tenth of a second later, unless a stamp (ns) is given, and returns topic -> message."""

    def __init__(self, of, changes=()):
        params = Path(share('params', f'{of.sensor}_sim.yaml'))
        if changes:
            params = write_parameters(Path(tempfile.mkstemp(suffix='.yaml', dir=_FOLDER)[1]), dict(changes), params)
        self.of, self.stamp_ns = of, FIRST_NS
        self._stage = make_stage(params, of.calibration)
        self._of_dots = make_stage(params, of.calibration, input='dots')
        self._earlier = []  # dots that this one has not seen yet
        if of.info is not None:
            self.look(of.info)

    def look(self, info, **changes):
        """Take a camera_info with changes."""
        info = copy.deepcopy(info)
        for name, value in changes.items():
            setattr(info, name, value)
        info.header = header_of(self.stamp_ns, self.of.sensor)
        for stage in (self._stage, self._of_dots):
            stage.take('camera_info', info)

    def message(self, raw, stamp_ns=None):
        """The message of an image, voltages or pressures, at the next stamp."""
        self.stamp_ns = self.stamp_ns + STEP_NS if stamp_ns is None else stamp_ns
        if self.of.sensor == 'psd_finger':
            return voltages_message(SampleBlock(np.asarray(raw, np.float32), self.stamp_ns, 1e-3), 'sensor')
        encoding = 'bgr8' if raw.ndim == 3 else 'mono8' if raw.dtype == np.uint8 else 'mono16'
        return image_to_message(Frame(raw, self.stamp_ns, encoding), '', header_of(self.stamp_ns, 'sensor'))

    @staticmethod
    def take(message, stage):
        """Results of a message; of several on a topic the first with a contact, or the last. Raises the error of a stage that refuses
        it."""
        results = {}
        for topic, found in stage.process(message).items():
            for result in found:
                if not getattr(results.get(topic), 'contacts', None):
                    results[topic] = result
        return results

    def __call__(self, raw, stamp_ns=None):
        results = self.take(self.message(raw, stamp_ns), self._stage)
        self._earlier += [results['dots']] if 'dots' in results else []
        return results

    def contact(self, dots):
        """Results for a message of dots, by a stage that has seen the dots of all images before."""
        while self._earlier:
            self.take(self._earlier.pop(0), self._of_dots)
        return self.take(dots, self._of_dots)

    def dots(self, raw):
        """The message of dots of an image."""
        found, = self._stage.process(self.message(raw), ['dots'])['dots']
        return found

    def warning(self):
        """What it warns of on /diagnostics."""
        return self._stage.health()[0]

    def begun(self, count=None):
        """This chain after the untouched frames, or so many of them."""
        for raw in self.of.rest[:count]:
            self(raw)
        return self


def contacts(results):
    """The contacts of results, with arrays in place of points; each finite, not above the surface, of a covariance that is one."""
    found = []
    for one in results['contacts'].contacts if 'contacts' in results else ():  # a finger that takes its reference publishes nothing
        covariance = np.array(one.position_covariance).reshape(3, 3)
        position = np.array([one.position.x, one.position.y, one.position.z])
        assert np.isfinite(position).all() and not np.isinf([one.depth, one.force]).any() and not one.depth < 0
        known = np.isfinite(np.diag(covariance))
        assert not known.any() or np.linalg.eigvalsh(covariance[np.ix_(known, known)]).min() >= -1e-15
        normal = np.array([one.normal.x, one.normal.y, one.normal.z])
        found.append(SimpleNamespace(id=one.id, position=position, normal=normal, depth=one.depth, force=one.force, covariance=covariance,
                                     flags=one.flags))
    return found


def untouched(results):
    """Whether nothing touches, by all that is published."""
    region, wrench = results.get('contact_region'), results.get('wrench')
    force = [] if wrench is None else [getattr(wrench.wrench.force, axis) for axis in 'xyz']
    flat = region is None or (region.area == 0 and not any(region.dot_state))
    return not contacts(results) and flat and not np.nansum(np.abs(force))


def duv(dots):
    """(N, 2) px, displacements in a message of dots."""
    return np.column_stack([dots.du, dots.dv])


def uv(dots):
    """(N, 2) px, positions in a message of dots."""
    return np.column_stack([dots.u, dots.v])
