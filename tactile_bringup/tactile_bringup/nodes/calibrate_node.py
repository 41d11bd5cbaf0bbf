# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate_node: guides the presses of a sensor with a probe whose position is on /tf, or the loads of an array, keeps the valid ones as
bags, and calibrates."""
from __future__ import annotations

import signal
from collections import deque
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import yaml
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from tactile_driver.camera.pairs import NAMES, Pairer
from tactile_driver.errors import BadArgument
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message, point, stamp_ns_of, vector
from tactile_driver.nodes.runtime.diagnostics import LogOnce
from tactile_driver.nodes.runtime.host import AdaptiveSubscription
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_driver.nodes.runtime.run import exit_process, run_node
from tactile_driver.parameters.drivers import DUAL_CAMERA_PARAMETERS
from tactile_msgs.msg import Contact, Contacts, PsdVoltages
from tactile_perception.bags.replay import read_sensor_type
from tactile_perception.common.geometry import Pose, matrix_of_quaternion, quaternion, rotation_matrix, rotation_vector
from tactile_perception.common.messages import wrench_to_message
from tactile_perception.core.errors import BadFrame
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.core.sensor_type import SENSOR_TYPES, SensorType
from tactile_perception.tools.calibrate import main as calibrate

from ..guide.loads import Loads
from ..guide.mounting import Holes, Mounting, Touches, fit_mounting
from ..guide.press_bags import PressBags
from ..guide.probe import Probe
from ..guide.readings import CameraWatch, pressed_position, signal_of
from ..guide.session import Press, Sample, Session
from ..guide.surfaces import MarkedSurface, surface_of
from ..hand.description import read_hand
from ..parameters.table import CALIBRATE_PARAMETERS
from .constants import BRINGUP

_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_NOWHERE = np.full(3, np.nan)


class CalibrateNode(Node):
    """Records presses, until all positions are pressed or ~/finish is called.

    presses: their bags; handled: number of images that were judged or left out; complete: whether the session has ended by itself. Presses
    that were recorded for the same output before are kept and count.
    """

    def __init__(self):
        super().__init__('calibrate_node')
        self._values = values = NodeParameters(self, CALIBRATE_PARAMETERS)
        self._type = read_sensor_type(Path(values['params'])) if values['params'] else ''
        kind = SENSOR_TYPES.get(self._type)
        measured_by = ('wrench', 'weights') if kind and kind.loaded else ('probe', 'holes')
        missing = [' (or '.join(names) + ')' * (len(names) - 1) for names in (('output',), ('params',), measured_by)
                   if not any(values[name] for name in names)]
        if values.problems or missing:
            raise BadArgument('calibrate_node: ' + ('; '.join(values.problems.values()) or f'parameter {missing[0]} is empty'))
        if kind is None or not (kind.pressed_surface or kind.loaded):
            guided = ', '.join(name for name, row in SENSOR_TYPES.items() if row.pressed_surface or row.loaded)
            raise BadArgument(f'calibrate_node: {values["params"]} is of a sensor of type {self._type}; this node guides {guided}')
        self.params, self.output = Path(values['params']), Path(values['output'])
        self._surface = None if kind.loaded else surface_of(self.params, values['tip_radius'])
        self._session = self._made_session(kind)
        self.presses = PressBags(self.output.with_name(f'{self.output.stem}_presses'), self.get_namespace())
        self.complete, self.handled = False, 0
        self._log = LogOnce(self)
        self._raw = deque()  # [(topic, message)] of one time each, not judged yet
        self._lost_s: dict[str, float] = {}  # reason -> since when the position of the probe is unknown
        self._about = String()
        self._probe = Probe(values['frame_id'], values['base'], self._log.error)
        self._probe.mount(np.array(values['mounting']))
        topics = kind.raw.values() if 'topics' in kind.sources else ()
        self._cameras = CameraWatch([topic.replace('image_raw', 'camera_info') for topic in topics],
                                    None if self._surface is None else self.presses.first_images())
        self._session.done += self.presses.presses()
        if self.presses.paths:
            self.get_logger().info(f'{len(self.presses)} presses of {self.presses.folder} are kept')
        self._finding = self._to_find()
        self._picture = self.create_publisher(Image, 'image', 1)
        self._listen(kind)
        self.create_service(Trigger, '~/undo', self._undo)
        if values['weights']:
            self.create_service(Trigger, '~/next', self._next)
        self.create_service(Trigger, '~/finish', self._finish)
        self._timers_kept = [steady_timer(self, BRINGUP.calibrate_period_s, self._work), steady_timer(self, 0.5, self._show)]
        self.get_logger().info(self._guide.advice)

    @property
    def _guide(self) -> Loads | Session:
        """The object that judges the samples now."""
        return self._finding or self._session

    @property
    def mounting_file(self) -> Path:
        """The hand file with the pose that the touches determine."""
        return self.output.with_name(f'{self.output.stem}_hand.yaml')

    @property
    def sphere(self) -> list[str]:
        """The arguments of calibrate for the tip of the probe, which a touchpad needs."""
        takes = 'sphere_radius' in SENSOR_TYPES[self._type].calibrate_options
        return ['--sphere-radius', str(self._values['tip_radius'])] if takes else []

    def _made_session(self, kind: SensorType) -> Loads | Session:
        values = self._values
        if self._surface is None:
            return Loads(values['weights'], kind.loaded)
        if not values['holes']:
            return Session(self._surface)
        if len(values['holes']) % 2 or not isinstance(self._surface, MarkedSurface):
            raise BadArgument('calibrate_node: give holes as x and y of each, in m, over a sheet, a pad or a dome')
        return Holes(self._surface, np.reshape(values['holes'], (-1, 2)), values['collars'], signal_of)

    def _to_find(self) -> Touches | None:
        """The touches that find the pose of the sensor; None if that is not wanted or was done before."""
        if not self._values['find']:
            return None
        if self._surface is None or not len(self._probe.mounting):
            raise BadArgument('calibrate_node: find needs a sensor that a probe presses, and a mounting that was measured by hand')
        if self.mounting_file.exists():
            found = read_hand(self.mounting_file).sensors[0]
            self._probe.mount(np.r_[found.xyz, rotation_vector(matrix_of_quaternion(np.array(found.quaternion)))])
            self.get_logger().info(f'the mounting of {self.mounting_file} is used')
            return None
        return Touches(self._surface, signal_of, self._seen)

    def _seen(self, untouched: list, touched) -> np.ndarray:
        """Touch.seen by the dots of one camera."""
        if list(self._cameras.infos) != ['camera_info']:
            return np.full(2, np.nan)
        return pressed_position(self.params, self._cameras.infos['camera_info'], [raw[0][1] for raw in untouched[-3:]], touched[0][1])

    def _found(self, found: Mounting) -> None:
        """Use the pose that the touches determine, and write it as a hand file."""
        before, turn = self._probe.mounting, rotation_matrix(self._probe.mounting[3:])
        mounting = np.r_[before[:3] + turn @ found.origin, rotation_vector(turn @ found.rotation)]
        self._probe.mount(mounting)
        self._finding = None
        name = self.get_namespace().strip('/') or self._values['frame_id']
        entry = {'name': name, 'type': self._type, 'xyz': mounting[:3].round(6).tolist(),
                 'quaternion': quaternion(rotation_matrix(mounting[3:])).round(9).tolist(), 'calibration': self.output.name}
        page = yaml.safe_dump({'frame': self._values['base'], 'sensors': [entry]}, sort_keys=False)
        self.mounting_file.write_text(f'# Mounting of {name}, found by touching it: {found}.\n{page}')
        self.get_logger().info(f'{self.mounting_file}: {found}')

    def _listen(self, row: SensorType) -> None:
        topics = list(row.raw.values())
        if len(topics) > 1:
            skew = read_parameters(self.params, 'dual_camera_node', DUAL_CAMERA_PARAMETERS)['max_skew']
            self._pairer = Pairer(round(skew * 1e9))
        for side, topic in enumerate(topics):
            take = partial(self._take_view, side) if len(topics) > 1 else partial(self._take, topic)
            AdaptiveSubscription(self, PsdVoltages if topic == 'voltages' else Image, topic, take, QoSProfile(depth=100))
        for topic in self._cameras.info_topics:
            self.create_subscription(CameraInfo, topic, lambda message, topic=topic: self._cameras.infos.update({topic: message}),
                                     qos_profile_sensor_data)
        self.create_subscription(String, 'description', lambda message: setattr(self, '_about', message), _LATCHED)
        self.create_subscription(TFMessage, '/tf', lambda message: self._probe.take_transforms(message, False), 100)
        self.create_subscription(TFMessage, '/tf_static', lambda message: self._probe.take_transforms(message, True), _LATCHED)
        if self._values['wrench']:
            self.create_subscription(WrenchStamped, self._values['wrench'], self._probe.take_wrench, qos_profile_sensor_data)

    def _take(self, topic: str, message, _received_ns: int) -> None:
        self._raw.append([(topic, message)])

    def _take_view(self, side: int, message: Image, _received_ns: int) -> None:
        """Pair the views of two cameras as their driver does."""
        self._pairer.add(side, Frame(message, stamp_ns_of(message.header), ''))
        while (pair := self._pairer.take()) is not None:
            self._raw.append([(f'{name}/image_raw', frame.image) for name, frame in zip(NAMES, (pair.left, pair.right))])

    def _work(self) -> None:
        """Judge the raw data up to the time of the newest transforms."""
        while self._raw:
            stamp, newest = (stamp_ns_of(self._raw[k][0][1].header) * 1e-9 for k in (0, -1))
            try:
                placed = self._placed(stamp)
            except LookupError as error:
                self._warn('frames', f'{error}; check the arguments probe, mounting and base', stamp)
                self.handled += len(self._raw)
                self._raw.clear()
                return
            if placed is None and newest - stamp < BRINGUP.probe_delay_s:
                return
            raw = self._raw.popleft()
            self.handled += 1
            if placed is None:
                self._warn('probe', f'/tf has no pose of {self._values["probe"] or "the force sensor"} at the time of the raw data: '
                           'it has stopped, or its clock differs', stamp)
                continue
            for name in self._lost_s:
                self._log.reset(name)
            self._lost_s.clear()
            try:
                self._judge(Sample(stamp, placed[1], raw=raw, **self._probe.wrench_at(stamp)))
            except BadFrame as error:
                self._log.error('image', str(error))

    def _placed(self, stamp: float) -> Pose | None:
        """Pose of the probe, or of the force sensor of an array; any pose where neither is used."""
        if self._values['weights'] or self._values['holes']:
            return np.eye(3), _NOWHERE
        if self._surface is not None:
            return self._probe.pose(self._values['probe'], stamp)
        return self._probe.force_sensor_pose(stamp)

    def _warn(self, name: str, text: str, stamp: float) -> None:
        """Drop the present press; log the reason if it lasts, unlike those of the start."""
        self._guide.drop(text)
        if stamp - self._lost_s.setdefault(name, stamp) > BRINGUP.probe_delay_s:
            self._log.error(name, text)

    def _judge(self, sample: Sample) -> None:
        press, reported = self._guide.add(sample)
        if self._finding is not None:
            if not self._finding.open_positions:
                self._found(fit_mounting(self._finding.touches, self._surface))
            if reported:
                self.get_logger().info(f'{reported}. {self._guide.advice}')
            return
        if press is not None and (problem := self._cameras.problem(press.rest[0].raw)):
            press, reported = None, f'dropped: {problem}'
        if press is not None:
            self._keep(press)
        if press is not None and self._values['wrench'] and not np.isfinite(press.touched[0].wrench).all():
            reported += f'; no wrench on {self._values["wrench"]}, so the press has no forces'
        if reported:
            over = press is not None or reported.startswith('dropped')
            self.get_logger().info(f'{reported}. {self._session.advice}' if over else reported)
        if press is not None and not self._session.open_positions:
            self._end()

    def _keep(self, press: Press) -> None:
        self.presses.add(self._messages(press))
        self._session.keep(press)
        cv2.imwrite(str(self.output.with_name(f'{self.output.stem}_coverage.png')), self._session.picture())

    def _messages(self, press: Press):
        """(stamp in ns, topic, message) of a press.

        The untouched wrench is subtracted in the frame of the force sensor. A force sensor behind the probe measures the reaction, which
        its sign shows: no press pulls at a sheet.
        """
        tare = np.mean([sample.wrench for sample in press.rest], axis=0)
        pushes = [self._contact(sample)[1] @ sample.to_sensor(sample.wrench - tare)[:3] for sample in press.touched]
        sign, begin = -1.0 if np.mean(pushes) > 0 else 1.0, stamp_ns_of(press.rest[0].raw[0][1].header)
        yield begin, 'description', self._about
        for topic, info in self._cameras.infos.items():
            yield begin, topic, info
        for sample, touched in [*((each, False) for each in press.rest), *((each, True) for each in press.touched)]:
            for topic, message in sample.raw:
                yield stamp_ns_of(message.header), topic, message
            stamp = stamp_ns_of(sample.raw[0][1].header)
            header, wrench = header_of(stamp, self._values['frame_id']), np.zeros(6)
            if touched:
                wrench = sign * sample.to_sensor(sample.wrench - tare)
            if self._surface is not None:
                position, normal = self._contact(sample)
                touch = Contact(position=point(position), normal=vector(normal), depth=self._surface.depth(sample.tip),
                                force=-float(normal @ wrench[:3]))
                yield stamp, 'ground_truth/contacts', Contacts(header=header, contacts=[touch] if touched else [])
            if np.isfinite(wrench).all():
                yield stamp, 'ground_truth/wrench', wrench_to_message(wrench, header)

    def _contact(self, sample: Sample) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) m and outward direction (3,) of the press."""
        return (_NOWHERE, np.array([0.0, 0.0, 1.0])) if self._surface is None else self._surface.contact(sample.tip)

    def _undo(self, _request, answer: Trigger.Response) -> Trigger.Response:
        """Remove the last press, or touch."""
        answer.success = bool(self._guide.done if self._finding else self.presses)
        if answer.success and self._finding:
            self._finding.undo()
        elif answer.success:
            self.presses.remove_last()
            self._session.done.pop()
            self._session.drop('')
        answer.message = self._guide.advice
        self.get_logger().info(answer.message)
        return answer

    def _next(self, _request, answer: Trigger.Response) -> Trigger.Response:
        """The next weight is on the sensor."""
        answer.success, answer.message = True, self._session.next_weight()
        self.get_logger().info(answer.message)
        return answer

    def _finish(self, _request, answer: Trigger.Response) -> Trigger.Response:
        """End with the presses recorded so far."""
        answer.success, answer.message = True, f'calibrating with {len(self.presses)} presses'
        self._end()
        return answer

    def _end(self) -> None:
        self.complete = True
        def stop() -> None:
            raise KeyboardInterrupt
        self._timers_kept.append(steady_timer(self, BRINGUP.calibrate_period_s, stop))  # after the answer is sent

    def _show(self) -> None:
        if self._picture.get_subscription_count():
            header = header_of(self.get_clock().now().nanoseconds, self._values['frame_id'])
            self._picture.publish(image_to_message(Frame(self._guide.picture(), 0, 'bgr8'), '', header))


def main(args: list[str] | None = None) -> None:
    """The process that runs the session, then calibrates."""
    exit_process(lambda: _run(args))


def _run(args: list[str] | None) -> int:
    made: list[CalibrateNode] = []

    def make() -> CalibrateNode:
        made.append(CalibrateNode())
        return made[0]
    code = run_node(make, args)
    if code == 0 and made and made[0].complete:
        node = made[0]
        signal.signal(signal.SIGINT, signal.default_int_handler)  # that of run_node has no effect any more
        code = calibrate([*map(str, node.presses.paths), '--params', str(node.params), '--output', str(node.output), *node.sphere])
        if node.mounting_file.exists():
            print(node.mounting_file.read_text(), flush=True)
    elif made:
        print(f'{len(made[0].presses)} presses are kept; start it again with the same output to continue', flush=True)
    return code
