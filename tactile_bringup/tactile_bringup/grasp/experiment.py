# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp_table: what falls, breaks and moves in the simulated gripper: with the controller and both sensors, with the array alone, with a
fixed force, and with known friction.

Frames, estimates and commands follow each other without ROS and without waiting, so that a run has the same result each time. On another
processor, sums differ in their last bits, and the grip amplifies that as it does another noise: compare medians of several seeds.
"""
from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tactile_driver.errors import BadFrame, reports_errors
from tactile_driver.frame import Frame
from tactile_driver.frame_names import optical_frame
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.simulation.taxel.pad import Ink
from tactile_driver.sources.source import NS
from tactile_perception.api import node_parameters
from tactile_perception.taxel.parameters import taxel_estimator
from tactile_perception.touchpad.stage import TouchpadStage

from ..sensor_files import parameter_file, simulated_calibration
from .constants import GRASP
from .controller import GripController, GripLimits, Phase, Reading, slip_probability
from .objects import ARRAY_PARAMETERS, JERKS, OBJECTS, HeldObject, object_named
from .skin import PARAMETERS, TouchpadFinger
from .world import GraspTruth, GraspWorld

POLICIES = ('controller', 'array alone', 'fixed', 'oracle')


@dataclass(frozen=True)
class Grasp:
    """One grasp of an object.

    Attributes
    ----------
    is_dropped, is_crushed : bool
    displacement : float
        Largest of the object in the hand after the lift began, m; of a dropped one infinite.
    force_ratio : float
        Median of the grip force over the least force that holds, while it is held.
    delay : float
        Median time from slip in the engine to a higher command, s; NaN where nothing slipped.
    friction : float
        Estimate of the coefficient of friction over the true one, at the end; NaN without a sensor that measures the shear.
    array_recall, array_false, touchpad_recall, touchpad_false : float
        Part of the frames with slip, and part of those without, of which the sensor reports slip; NaN where there is none.
    """

    is_dropped: bool
    is_crushed: bool
    displacement: float
    force_ratio: float
    delay: float
    friction: float
    array_recall: float
    array_false: float
    touchpad_recall: float
    touchpad_false: float


class ArraySensor:
    """The pressure array on the left finger; seed: of its noise and irregularities; partial: whether a contact that slips in part slips."""

    def __init__(self, seed: int, partial: bool = True):
        self._partial = partial
        self._array = Ink((GRASP.taxels, GRASP.taxels), seed, 1 / GRASP.frame_s)
        self.counts, self.result = np.zeros((GRASP.taxels, GRASP.taxels), np.uint8), None  # of the last frame
        parameters = node_parameters('taxel_contact_node', parameter_file('taxel_array', True))
        self._estimator = taxel_estimator(parameters | {'calibration': simulated_calibration('taxel_array'), **ARRAY_PARAMETERS})

    def read(self, pressure: np.ndarray, truth: GraspTruth) -> Reading:
        """What it reports of a frame of the engine."""
        self.counts = self._array.read(pressure)
        self.result = result = self._estimator.process(self.counts, truth.time_s)
        return Reading(truth.time_s, sum(contact.force for contact in result.contacts),
                       slip_probability(result.slip.state, result.slip.confidence, self._partial))


class TouchpadSensor:
    """The touchpad on the right finger, seen 50 times a second; seed: of its noise and irregularities; topics: that are computed besides
    those that the controller needs."""

    def __init__(self, held: HeldObject, seed: int, topics: Sequence[str] = ()):
        self.light = 0  # grey levels that a lamp outside adds to its images
        self.finger, self._frames, self._topics = TouchpadFinger(held, GRASP.touchpad_rate, seed), 0, ('wrench', 'slip', *topics)
        self.image, self.found = np.zeros((1, 1, 3), np.uint8), {}  # the last image, and its messages by topic
        self._stage = TouchpadStage(node_parameters('touchpad_contact_node', parameter_file('touchpad', True)) | PARAMETERS)

    def read(self, _pressure: np.ndarray, truth: GraspTruth) -> Reading | None:
        """What it reports of a frame of the engine; None between two images and of one that it refuses."""
        self._frames += 1
        if self._frames % round(1 / (GRASP.frame_s * GRASP.touchpad_rate)):
            return None
        image = self.finger.advance(truth.object_pose, truth.pad_force).image
        if self.light:
            image = cv2.add(image, (self.light,) * 3 + (0,))
        self.image = image
        header = header_of(NS + round(truth.time_s * NS), optical_frame('touchpad'))
        self._stage.take('camera_info', calibration_to_message(self.finger.calibration, header))
        try:
            found = self._stage.process(image_to_message(Frame(image, 0, 'bgr8'), '', header), self._topics)
        except BadFrame:  # as its node does
            return None
        self.found = found
        force, slip = found['wrench'][0].wrench.force, found['slip'][0]
        return Reading(truth.time_s, -force.z, slip_probability(slip.state, slip.confidence, partial=False),
                       float(np.hypot(force.x, force.y)), slip.slipping_fraction)


#: What goes wrong one second after the lift began, for the rest of the grasp. A lamp outside shines through the skin.
FAULTS = ('array unplugged', 'touchpad unplugged', 'both unplugged', 'frames late', 'light on')


class Sensors:
    """Both sensors as the controller receives them.

    touchpad: whether there is one; fault: of FAULTS, '' for none; seed: of noise and irregularities; topics: as of TouchpadSensor.
    """

    def __init__(self, held: HeldObject, touchpad: bool, fault: str, seed: int, topics: Sequence[str] = ()):
        self.array, self.touchpad = ArraySensor(seed, not touchpad), TouchpadSensor(held, seed, topics) if touchpad else None
        self._fault, self._waiting = fault, deque()

    def read(self, pressure: np.ndarray, truth: GraspTruth, lifted_s: float) -> list[tuple[str, Reading]]:
        """The readings that arrive with this frame of the engine, with the names of their sensors."""
        fault = self._fault if lifted_s >= GRASP.fault_begin_s else ''
        if self.touchpad:
            self.touchpad.light = GRASP.lamp_level if fault == 'light on' else 0
        for name, sensor in (('array', self.array), ('touchpad', self.touchpad)):
            if sensor is None or fault in (f'{name} unplugged', 'both unplugged'):
                continue
            reading = sensor.read(pressure, truth)
            if reading is not None:
                self._waiting.append((truth.time_s + (GRASP.late_s if fault == 'frames late' else 0.0), name, reading))
        arrived = []
        while self._waiting and self._waiting[0][0] <= truth.time_s + 1e-9:
            arrived.append(self._waiting.popleft()[1:])
        return arrived


class Trace:
    """Collects what happens in a grasp."""

    def __init__(self, crushing_force: float) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._crushing_force = crushing_force

    def add(self, lifted_s: float, truth: GraspTruth, command: float, readings: Mapping[str, Reading]) -> None:
        """One frame; lifted_s: since the lift began; readings: those that arrived, by the names of the sensors."""
        slip = [readings[name].slip_probability if name in readings else np.nan for name in ('array', 'touchpad')]
        moved, speed = np.linalg.norm(truth.displacement), np.linalg.norm(truth.velocity[1:])  # along the pads
        self._rows.append((truth.grip_force, command, float(moved), float(speed), truth.least_force, *slip, float('touchpad' in readings),
                           float(lifted_s > 0), float(lifted_s > 0 and truth.is_held)))

    def result(self, friction: float) -> Grasp:
        """The measures of the grasp; friction: the estimate over the truth."""
        force, command, moved, speed, least, array, touchpad, seen, lifted, held = np.array(self._rows).T
        lifted, seen = lifted > 0, seen > 0
        if not lifted.any():  # never held
            return Grasp(True, bool(force.max() > self._crushing_force), np.inf, *[np.nan] * 7)
        is_dropped = bool((np.nan_to_num(moved[lifted]) > GRASP.dropped_displacement).any() or not held[-1])
        slipping, still = (held > 0) & (speed > GRASP.slip_speed), (held > 0) & (speed < 0.25 * GRASP.slip_speed)
        by_array, by_touchpad = array > GripLimits.slip_probability, touchpad > GripLimits.slip_probability
        return Grasp(is_dropped, bool(force.max() > self._crushing_force), float('inf') if is_dropped else float(moved[lifted].max()),
                     float(np.median((force / least)[held > 0])) if held.any() else np.nan, _delay(slipping, command), friction,
                     _share(by_array, slipping), _share(by_array, still),
                     _share(by_touchpad, slipping & seen), _share(by_touchpad, still & seen))


def _share(called: np.ndarray, frames: np.ndarray) -> float:
    return float(called[frames].mean()) if frames.any() else np.nan


def _delay(slipping: np.ndarray, command: np.ndarray) -> float:
    """Median time, s, from the beginnings of slip to the next rise of the command."""
    begins = np.flatnonzero(slipping[1:] & ~slipping[:-1]) + 1
    rises = np.flatnonzero(np.diff(command) > 0.01) + 1
    delays = [rises[rises >= begin][0] - begin for begin in begins if (rises >= begin).any()]
    return GRASP.frame_s * float(np.median(delays)) if delays else np.nan


Watch = Callable[[GraspWorld, GraspTruth, Sensors, Collection[str]], None]


def grasp(name: str, policy: str, seed: int = 0, watch: Watch | None = None, topics: Sequence[str] = (),
          margin: float = GripLimits.margin) -> Grasp:
    """Grasp, lift and hold an object.

    Parameters
    ----------
    name : str
        One of OBJECTS.
    policy : str
        One of POLICIES: the controller with both sensors; the same with the array alone; GRASP.fixed_force; GRASP.oracle_margin times the
        smallest force that holds at every moment. Or one of FAULTS, which befalls the first, with jerks of the wrist alone.
    seed : int
        Of the noise and irregularities of the sensors.
    watch : callable, optional
        Called with the engine, its truth, the sensors, and the names of those that have reported, after each frame.
    topics : sequence of str
        What the touchpad computes besides, for `watch`.
    margin : float
        Of the controller.

    Raises
    ------
    BadArgument
        For an unknown object, or without MuJoCo.
    """
    held, disturbances = object_named(name)
    fault, policy = (policy, 'controller') if policy in FAULTS else ('', policy)
    world, trace = GraspWorld(held, JERKS if fault else disturbances), Trace(held.crushing_force)
    controller = GripController(GripLimits(margin=margin))
    sensors, command, held_s = Sensors(held, policy == 'controller', fault, seed, topics), -1.0, np.inf
    while world.lifted_s < GRASP.held_s and world.time_s < GRASP.max_duration_s:
        pressure, truth = world.advance(command)
        readings = sensors.read(pressure, truth, world.lifted_s)
        trace.add(world.lifted_s, truth, command, dict(readings))
        if watch:
            watch(world, truth, sensors, [sensor for sensor, _ in readings])
        if truth.time_s > GRASP.untouched_s:
            controller.close()
        own = controller.wait(truth.time_s)
        for sensor, reading in readings:
            own = controller.take(reading, sensor)
        if controller.phase is Phase.HOLD:
            held_s = min(held_s, truth.time_s)
        if truth.time_s - held_s > GRASP.settled_s and not world.lifted_s >= 0:
            world.lift()
        command = -1.0 if controller.phase is Phase.OPEN else _command(policy, own, truth)
    return trace.result(controller.friction.value / held.friction if policy == 'controller' else np.nan)


def _command(policy: str, own: float, truth: GraspTruth) -> float:
    if policy in ('controller', 'array alone') or own <= GripLimits.approach_force:  # all approach alike
        return own
    return GRASP.fixed_force if policy == 'fixed' else max(GRASP.oracle_margin * truth.least_force, GripLimits.min_force)


#: Field of Grasp -> its factor in the table.
_COLUMNS = {'displacement': 1e3, 'force_ratio': 1.0, 'delay': 1e3, 'friction': 1.0, 'array_recall': 1.0, 'array_false': 1.0,
            'touchpad_recall': 1.0, 'touchpad_false': 1.0}


def print_table(names: Sequence[str], seeds: Sequence[int], has_faults: bool = False) -> None:
    """Print the table of all grasps, as Markdown, row by row; has_faults: with each of FAULTS instead of each policy."""
    print(f'| object | {"fault" if has_faults else "policy"} | dropped | crushed | displacement mm | force / least | delay ms '
          '| friction / true | array: slip recall | false slip | touchpad: slip recall | false slip |')
    print('|---' * 12 + '|', flush=True)
    for name in names:
        for policy in FAULTS if has_faults else POLICIES:
            found = [grasp(name, policy, seed) for seed in (seeds[:1] if policy in ('fixed', 'oracle') else seeds)]
            counts = [f'{sum(getattr(each, field) for each in found)} of {len(found)}' for field in ('is_dropped', 'is_crushed')]
            values = [scale * np.median([getattr(each, field) for each in found]) for field, scale in _COLUMNS.items()]
            shown = ['-' if np.isnan(value) else f'{value:.3g}' for value in values]
            print(f'| {name} | {policy} | {" | ".join(counts + shown)} |', flush=True)


def print_margins(names: Sequence[str], margins: Sequence[float]) -> None:
    """Print displacement and force of the controller with both sensors over its margin, as Markdown, and the medians of all objects."""
    print('| margin | object | displacement mm | force / least |\n|---|---|---|---|', flush=True)
    for margin in margins:
        found = []
        for name in names:
            one = grasp(name, 'controller', margin=margin)
            found.append((1e3 * one.displacement, one.force_ratio))
            print(f'| {margin:g} | {name} | {found[-1][0]:.3g} | {found[-1][1]:.3g} |', flush=True)
        moved, ratio = np.median(found, axis=0)
        print(f'| {margin:g} | median, largest | {moved:.3g}, {max(each for each, _ in found):.3g} | {ratio:.3g} |', flush=True)


@reports_errors('grasp_table', OSError)
def main(args: list[str] | None = None) -> int:
    """Print the table; exit code 1 for an unknown object, or without MuJoCo."""
    parser = argparse.ArgumentParser(prog='grasp_table', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--objects', nargs='+', default=list(OBJECTS), help=f'objects to grasp, of {", ".join(OBJECTS)}; default: all')
    parser.add_argument('--seeds', type=int, nargs='+', default=[0], help='seeds of the noise of the array')
    parser.add_argument('--faults', action='store_true', help=f'the controller with {", ".join(FAULTS)}, instead of each policy')
    parser.add_argument('--margins', type=float, nargs='+', help='displacement and force over these values of margin, instead')
    given = parser.parse_args(args)
    for name in given.objects:
        object_named(name)
    if given.margins:
        print_margins(given.objects, given.margins)
        return 0
    print_table(given.objects, given.seeds, given.faults)
    return 0
