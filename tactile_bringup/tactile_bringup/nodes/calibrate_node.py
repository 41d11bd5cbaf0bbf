# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate_node: guides the presses of a sensor with a probe whose position is on /tf, or the loads of an array, keeps the valid ones as
bags, and calibrates."""
from __future__ import annotations

import shutil
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
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.recordings.writer import write_messages
from tactile_msgs.msg import Contact, Contacts, PsdVoltages
from tactile_perception.bags.replay import read_sensor_type
from tactile_perception.common.geometry import (
    FrameTree,
    Pose,
    matrix_of_quaternion,
    quaternion,
    rotation_matrix,
    rotation_vector,
    wrench_at,
)
from tactile_perception.common.messages import wrench_to_message
from tactile_perception.core.errors import BadFrame
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.core.sensor_type import SENSOR_TYPES, SensorType
from tactile_perception.tools.calibrate import main as calibrate

from ..guide.loads import Loads
from ..guide.mounting import Holes, Mounting, Touches, fit_mounting
from ..guide.readings import image_shift, pressed_position, reduced, signal_of
from ..guide.session import Press, Sample, Session
from ..guide.surfaces import MarkedSurface, surface_of
from ..hand.description import read_hand
from ..parameters.table import CALIBRATE_PARAMETERS

_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_PROBE_DELAY_S = 1.0  # for which an image waits for the position of the probe
_PERIOD_S = 0.05
_MAX_IMAGE_SHIFT = 1 / 300  # of the width of an image: a quarter of the radius of a marker
_UNKNOWN, _NOWHERE = np.full(6, np.nan), np.full(3, np.nan)


class CalibrateNode(Node):
    """Records presses, until all positions are pressed or ~/finish is called.

    bags: of the presses, each starts with untouched images; handled: number of images that were judged or left out; complete: whether the
    session has ended by itself. Presses that were recorded for the same output before are kept and count.
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
        self._folder, self.complete, self.handled = self.output.with_name(f'{self.output.stem}_presses'), False, 0
        self._log, self._frames = LogOnce(self), FrameTree()
        self._raw, self._wrenches = deque(), deque()  # raw: [(topic, message)] of one time each, not judged yet
        self._lost_s: dict[str, float] = {}  # reason -> since when the position of the probe is unknown
        self._infos: dict[str, CameraInfo] = {}
        self._about = String()
        self._views: list[np.ndarray] = []  # of the cameras before the first press
        self._mount(np.array(values['mounting']))
        self._resume()
        self._finding = self._to_find()
        self._picture = self.create_publisher(Image, 'image', 1)
        self._listen(kind)
        self.create_service(Trigger, '~/undo', self._undo)
        if values['weights']:
            self.create_service(Trigger, '~/next', self._next)
        self.create_service(Trigger, '~/finish', self._finish)
        self._timers_kept = [steady_timer(self, _PERIOD_S, self._work), steady_timer(self, 0.5, self._show)]
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

    @property
    def bags(self) -> list[Path]:
        """The bags of the presses that count, in their order."""
        return sorted(self._folder.glob('press_*'))

    def _made_session(self, kind: SensorType) -> Loads | Session:
        values = self._values
        if self._surface is None:
            return Loads(values['weights'], kind.loaded)
        if not values['holes']:
            return Session(self._surface)
        if len(values['holes']) % 2 or not isinstance(self._surface, MarkedSurface):
            raise BadArgument('calibrate_node: give holes as x and y of each, in m, over a sheet, a pad or a dome')
        return Holes(self._surface, np.reshape(values['holes'], (-1, 2)), values['collars'], signal_of)

    def _mount(self, mounting: np.ndarray) -> None:
        """Set the pose of the sensor in the frame `base`, if it is given; else it comes from /tf."""
        if len(mounting) not in (0, 6):
            raise BadArgument(f'calibrate_node: mounting has {len(mounting)} numbers; give x y z, m, and a rotation vector, rad')
        self._mounting = mounting
        if len(mounting):
            self._frames.take(self._values['base'], self._values['frame_id'], quaternion(rotation_matrix(mounting[3:])), mounting[:3])

    def _to_find(self) -> Touches | None:
        """The touches that find the pose of the sensor; None if that is not wanted or was done before."""
        if not self._values['find']:
            return None
        if self._surface is None or not len(self._mounting):
            raise BadArgument('calibrate_node: find needs a sensor that a probe presses, and a mounting that was measured by hand')
        if self.mounting_file.exists():
            found = read_hand(self.mounting_file).sensors[0]
            self._mount(np.r_[found.xyz, rotation_vector(matrix_of_quaternion(np.array(found.quaternion)))])
            self.get_logger().info(f'the mounting of {self.mounting_file} is used')
            return None
        return Touches(self._surface, signal_of, self._seen)

    def _seen(self, untouched: list, touched) -> np.ndarray:
        """Touch.seen by the dots of one camera."""
        if list(self._infos) != ['camera_info']:
            return np.full(2, np.nan)
        return pressed_position(self.params, self._infos['camera_info'], [raw[0][1] for raw in untouched[-3:]], touched[0][1])

    def _found(self, found: Mounting) -> None:
        """Use the pose that the touches determine, and write it as a hand file."""
        turn = rotation_matrix(self._mounting[3:])
        self._mount(np.r_[self._mounting[:3] + turn @ found.origin, rotation_vector(turn @ found.rotation)])
        self._finding = None
        name = self.get_namespace().strip('/') or self._values['frame_id']
        entry = {'name': name, 'type': self._type, 'xyz': self._mounting[:3].round(6).tolist(),
                 'quaternion': quaternion(rotation_matrix(self._mounting[3:])).round(9).tolist(), 'calibration': self.output.name}
        page = yaml.safe_dump({'frame': self._values['base'], 'sensors': [entry]}, sort_keys=False)
        self.mounting_file.write_text(f'# Mounting of {name}, found by touching it: {found}.\n{page}')
        self.get_logger().info(f'{self.mounting_file}: {found}')

    def _resume(self) -> None:
        for bag in self.bags:
            with BagReader(bag) as reader:
                topics = {topic for topic in reader.topics if topic.endswith('ground_truth/contacts')}
                touches = [decode(raw.data, raw.type_name).contacts for raw in reader.messages(topics)]
                if bag == self.bags[0] and self._surface is not None:
                    images = sorted(topic for topic in reader.topics if topic.endswith('image_raw'))
                    firsts = [next(iter(reader.messages({topic}))) for topic in images]
                    self._views = [reduced(decode(raw.data, raw.type_name)) for raw in firsts]
            found = [touch[0] for touch in touches if touch]
            positions = [[touch.position.x, touch.position.y] for touch in found] or np.zeros((1, 2))
            self._session.done.append((np.mean(positions, axis=0), sorted({round(touch.depth, 5) for touch in found})))
        if self.bags:
            self.get_logger().info(f'{len(self.bags)} presses of {self._folder} are kept')

    def _listen(self, row: SensorType) -> None:
        topics, cameras = list(row.raw.values()), 'topics' in row.sources
        self._info_topics = [topic.replace('image_raw', 'camera_info') for topic in topics] if cameras else []
        if len(topics) > 1:
            skew = read_parameters(self.params, 'dual_camera_node', DUAL_CAMERA_PARAMETERS)['max_skew']
            self._pairer = Pairer(round(skew * 1e9))
        for side, topic in enumerate(topics):
            take = partial(self._take_view, side) if len(topics) > 1 else partial(self._take, topic)
            AdaptiveSubscription(self, PsdVoltages if topic == 'voltages' else Image, topic, take, QoSProfile(depth=100))
        for topic in self._info_topics:
            self.create_subscription(CameraInfo, topic, lambda message, topic=topic: self._infos.update({topic: message}),
                                     qos_profile_sensor_data)
        self.create_subscription(String, 'description', lambda message: setattr(self, '_about', message), _LATCHED)
        self.create_subscription(TFMessage, '/tf', lambda message: self._take_transforms(message, False), 100)
        self.create_subscription(TFMessage, '/tf_static', lambda message: self._take_transforms(message, True), _LATCHED)
        if self._values['wrench']:
            self.create_subscription(WrenchStamped, self._values['wrench'], self._feel, qos_profile_sensor_data)

    def _take(self, topic: str, message, _received_ns: int) -> None:
        self._raw.append([(topic, message)])

    def _take_view(self, side: int, message: Image, _received_ns: int) -> None:
        """Pair the views of two cameras as their driver does."""
        self._pairer.add(side, Frame(message, stamp_ns_of(message.header), ''))
        while (pair := self._pairer.take()) is not None:
            self._raw.append([(f'{name}/image_raw', frame.image) for name, frame in zip(NAMES, (pair.left, pair.right))])

    def _take_transforms(self, message: TFMessage, static: bool) -> None:
        for each in message.transforms:
            p, q = each.transform.translation, each.transform.rotation
            if len(self._mounting) and each.child_frame_id.lstrip('/') == self._values['frame_id']:
                continue  # the given mounting holds
            try:
                self._frames.take(each.header.frame_id.lstrip('/'), each.child_frame_id.lstrip('/'), np.array([q.x, q.y, q.z, q.w]),
                                  np.array([p.x, p.y, p.z]), *(() if static else (stamp_ns_of(each.header) * 1e-9,)))
            except BadFrame as error:
                self._log.error('/tf', str(error))

    def _pose(self, frame: str, stamp: float) -> Pose | None:
        """Pose of a frame in the sensor frame at a time, s; None where the transforms do not cover that time.

        Raises LookupError, which lists the known frames, where no chain of transforms joins the two.
        """
        sensor = self._values['frame_id']
        if self._frames.pose(frame, sensor) is None:
            known = ', '.join(self._frames.frames) or 'none at all'
            raise LookupError(f'/tf does not join {frame!r} and {sensor!r}; its frames are: {known}')
        return self._frames.pose(frame, sensor, stamp)

    def _feel(self, message: WrenchStamped) -> None:
        f, t = message.wrench.force, message.wrench.torque
        stamp, value = stamp_ns_of(message.header) * 1e-9, np.array([f.x, f.y, f.z, t.x, t.y, t.z])
        same = self._wrenches and (self._wrenches[-1][1] == value).all()
        self._wrenches.append((stamp, value, self._wrenches[-1][2] if same else stamp, message.header.frame_id.lstrip('/')))
        while stamp - self._wrenches[0][0] > 5.0:
            self._wrenches.popleft()

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
            if placed is None and newest - stamp < _PROBE_DELAY_S:
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
                self._judge(Sample(stamp, placed[1], raw=raw, **self._wrench_at(stamp)))
            except BadFrame as error:
                self._log.error('image', str(error))

    def _placed(self, stamp: float) -> Pose | None:
        """Pose of the probe, or of the force sensor of an array; any pose where neither is used."""
        if self._values['weights'] or self._values['holes']:
            return np.eye(3), _NOWHERE
        if self._surface is not None:
            return self._pose(self._values['probe'], stamp)
        return self._pose(self._wrenches[-1][3], stamp) if self._wrenches and self._wrenches[-1][0] >= stamp else None

    def _warn(self, name: str, text: str, stamp: float) -> None:
        """Drop the present press; log the reason if it lasts, unlike those of the start."""
        self._guide.drop(text)
        if stamp - self._lost_s.setdefault(name, stamp) > _PROBE_DELAY_S:
            self._log.error(name, text)

    def _wrench_at(self, stamp: float) -> dict:
        """The fields of a Sample about the wrench; without a topic it counts as changing."""
        found, placed = next((each for each in reversed(self._wrenches) if each[0] <= stamp), None), None
        try:
            placed = found and self._pose(found[3], stamp)
        except LookupError as error:
            self._log.error('wrench', f'the wrench is not used: {error}')
        if placed is None:
            return {'wrench': _UNKNOWN, 'changed_s': stamp if found is None else found[2]}
        return {'wrench': found[1], 'changed_s': found[2], 'to_sensor': partial(wrench_at, rotation=placed[0], origin=placed[1])}

    def _judge(self, sample: Sample) -> None:
        press, reported = self._guide.add(sample)
        if self._finding is not None:
            if not self._finding.open_positions:
                self._found(fit_mounting(self._finding.touches, self._surface))
            if reported:
                self.get_logger().info(f'{reported}. {self._guide.advice}')
            return
        if press is not None and not self._infos.keys() >= set(self._info_topics):
            press, reported = None, 'dropped: no camera_info arrived; calibrate the camera first'
        if press is not None and (problem := self._camera_problem(press.rest[0])):
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

    def _camera_problem(self, untouched: Sample) -> str:
        """A message if a camera has moved since the first press, or ''."""
        views = [reduced(message) for _, message in untouched.raw if isinstance(message, Image) and self._surface is not None]
        self._views = self._views or views
        shift = max((image_shift(*pair) for pair in zip(self._views, views)), default=0.0)
        return f'the camera has moved by {100 * shift:.1f} % of its image; put it back, or restart with another output' \
            if shift > _MAX_IMAGE_SHIFT else ''

    def _keep(self, press: Press) -> None:
        """Keep a press as a bag, which is written under another name first, so that no bag is incomplete."""
        number = 1 + max((int(bag.name.removeprefix('press_')) for bag in self.bags), default=0)
        unfinished = self._folder / 'unfinished'
        shutil.rmtree(unfinished, ignore_errors=True)
        self._folder.mkdir(parents=True, exist_ok=True)
        write_messages(unfinished, self.get_namespace(), self._messages(press))
        unfinished.rename(self._folder / f'press_{number:03d}')
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
        for topic, info in self._infos.items():
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
        answer.success = bool(self._guide.done if self._finding else self.bags)
        if answer.success and self._finding:
            self._finding.undo()
        elif answer.success:
            shutil.rmtree(self.bags[-1])
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
        answer.success, answer.message = True, f'calibrating with {len(self.bags)} presses'
        self._end()
        return answer

    def _end(self) -> None:
        self.complete = True
        def stop() -> None:
            raise KeyboardInterrupt
        self._timers_kept.append(steady_timer(self, _PERIOD_S, stop))  # after the answer is sent

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
        code = calibrate([*map(str, node.bags), '--params', str(node.params), '--output', str(node.output), *node.sphere])
        if node.mounting_file.exists():
            print(node.mounting_file.read_text(), flush=True)
    elif made:
        print(f'{len(made[0].bags)} presses are kept; start it again with the same output to continue', flush=True)
    return code
