# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate_node: leads through the presses of a sensor with a probe that /tf follows, or the loads of an array, keeps those that count as
bags, then calibrates."""
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
from tactile_perception.errors import BadFrame
from tactile_perception.nodes.messages.conversions import wrench_to_message
from tactile_perception.parameters.file import read_parameters
from tactile_perception.sensor_type import SENSOR_TYPES, SensorType
from tactile_perception.tools.calibrate import main as calibrate

from ..guide.loads import Loads
from ..guide.mounting import Holes, Mounting, Touches, fit_mounting
from ..guide.readings import moved, place_seen, reduced, signal_of
from ..guide.session import Press, Sample, Session
from ..guide.surfaces import MarkedSurface, surface_of
from ..hand.description import read_hand
from ..parameters.table import CALIBRATE_PARAMETERS

_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_LATE_S = 1.0  # chosen: so long an image waits for the probe's place
_PERIOD_S = 0.05
_MOVED = 1 / 300  # of the width of an image: chosen, a quarter of a marker's radius
_UNKNOWN, _NOWHERE = np.full(6, np.nan), np.full(3, np.nan)


class CalibrateNode(Node):
    """Records presses; ends itself when all places are pressed or ~/finish is called. bags: of the presses, each with its untouched images
    first; handled: number of images judged or left out; complete: whether it ended itself. What was recorded for the same output before is
    kept and counts."""

    def __init__(self):
        super().__init__('calibrate_node')
        self._values = values = NodeParameters(self, CALIBRATE_PARAMETERS)
        self._type = read_sensor_type(Path(values['params'])) if values['params'] else ''
        kind = SENSOR_TYPES.get(self._type)
        told_by = ('wrench', 'weights') if kind and kind.loaded else ('probe', 'holes')
        missing = [' (or '.join(names) + ')' * (len(names) - 1) for names in (('output',), ('params',), told_by)
                   if not any(values[name] for name in names)]
        if values.problems or missing:
            raise BadArgument('calibrate_node: ' + ('; '.join(values.problems.values()) or f'parameter {missing[0]} is empty'))
        if kind is None or not (kind.pressed_surface or kind.loaded):
            guided = ', '.join(name for name, row in SENSOR_TYPES.items() if row.pressed_surface or row.loaded)
            raise BadArgument(f'calibrate_node: {values["params"]} is of a sensor of type {self._type}; guided are {guided}')
        self.params, self.output = Path(values['params']), Path(values['output'])
        self._surface = None if kind.loaded else surface_of(self.params, values['tip_radius'])
        self._session = self._made_session(kind)
        self._folder, self.complete, self.handled = self.output.with_name(f'{self.output.stem}_presses'), False, 0
        self._log, self._frames = LogOnce(self), FrameTree()
        self._raw, self._wrenches = deque(), deque()  # raw: [(topic, message)] of one time each, which are not judged yet
        self._lost_s: dict[str, float] = {}  # since when the probe's place is not known, by the reason
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
        """What judges the samples now."""
        return self._finding or self._session

    @property
    def mounting_file(self) -> Path:
        """The hand's file with the pose that touches gave."""
        return self.output.with_name(f'{self.output.stem}_hand.yaml')

    @property
    def sphere(self) -> list[str]:
        """The arguments of calibrate that tell the probe's tip, which a touchpad wants."""
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
            raise BadArgument('calibrate_node: holes want x and y of each, m, over a sheet, a pad or a dome')
        return Holes(self._surface, np.reshape(values['holes'], (-1, 2)), values['collars'], signal_of)

    def _mount(self, mounting: np.ndarray) -> None:
        """Where the sensor is in the frame `base`, if it is given; else /tf has to tell."""
        if len(mounting) not in (0, 6):
            raise BadArgument(f'calibrate_node: mounting has {len(mounting)} numbers; give x y z, m, and a rotation vector, rad')
        self._mounting = mounting
        if len(mounting):
            self._frames.take(self._values['base'], self._values['frame_id'], quaternion(rotation_matrix(mounting[3:])), mounting[:3])

    def _to_find(self) -> Touches | None:
        """What finds the sensor, if it is to be found and was not found before."""
        if not self._values['find']:
            return None
        if self._surface is None or not len(self._mounting):
            raise BadArgument('calibrate_node: find wants a sensor that a probe presses, and a mounting that was measured by hand')
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
        return place_seen(self.params, self._infos['camera_info'], [raw[0][1] for raw in untouched[-3:]], touched[0][1])

    def _found(self, found: Mounting) -> None:
        """The sensor is where touches have found it: write that as a hand's file, and go on from there."""
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
            places = [[touch.position.x, touch.position.y] for touch in found] or np.zeros((1, 2))
            self._session.done.append((np.mean(places, axis=0), sorted({round(touch.depth, 5) for touch in found})))
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
        self.create_subscription(TFMessage, '/tf', lambda message: self._place(message, False), 100)
        self.create_subscription(TFMessage, '/tf_static', lambda message: self._place(message, True), _LATCHED)
        if self._values['wrench']:
            self.create_subscription(WrenchStamped, self._values['wrench'], self._feel, qos_profile_sensor_data)

    def _take(self, topic: str, message, _received_ns: int) -> None:
        self._raw.append([(topic, message)])

    def _take_view(self, side: int, message: Image, _received_ns: int) -> None:
        """Pair the views of two cameras as their driver does."""
        self._pairer.add(side, Frame(message, stamp_ns_of(message.header), ''))
        while (pair := self._pairer.take()) is not None:
            self._raw.append([(f'{name}/image_raw', frame.image) for name, frame in zip(NAMES, (pair.left, pair.right))])

    def _place(self, message: TFMessage, static: bool) -> None:
        for each in message.transforms:
            p, q = each.transform.translation, each.transform.rotation
            if len(self._mounting) and each.child_frame_id.lstrip('/') == self._values['frame_id']:
                continue  # what is given holds
            try:
                self._frames.take(each.header.frame_id.lstrip('/'), each.child_frame_id.lstrip('/'), np.array([q.x, q.y, q.z, q.w]),
                                  np.array([p.x, p.y, p.z]), *(() if static else (stamp_ns_of(each.header) * 1e-9,)))
            except BadFrame as error:
                self._log.error('/tf', str(error))

    def _pose(self, frame: str, stamp: float) -> Pose | None:
        """Of a frame in the sensor's at a time, s; None where the transforms do not reach there, yet or any more. Raises LookupError,
        which lists the known frames, where no chain of transforms joins the two."""
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
        """Judge the raw data whose time the probe's transforms have reached."""
        while self._raw:
            stamp, newest = (stamp_ns_of(self._raw[k][0][1].header) * 1e-9 for k in (0, -1))
            try:
                placed = self._placed(stamp)
            except LookupError as error:
                self._warn('frames', f'{error}; see the arguments probe, mounting and base', stamp)
                self.handled += len(self._raw)
                self._raw.clear()
                return
            if placed is None and newest - stamp < _LATE_S:
                return
            raw = self._raw.popleft()
            self.handled += 1
            if placed is None:
                self._warn('probe', f'/tf does not tell where {self._values["probe"] or "the force sensor"} is when the raw data came: '
                           'it has stopped, or its clock is another one', stamp)
                continue
            for name in self._lost_s:
                self._log.reset(name)
            self._lost_s.clear()
            try:
                self._judge(Sample(stamp, placed[1], raw=raw, **self._wrench_at(stamp)))
            except BadFrame as error:
                self._log.error('image', str(error))

    def _placed(self, stamp: float) -> Pose | None:
        """Where the probe is; of an array where its force sensor is, and somewhere if its loads are weights."""
        if self._values['weights'] or self._values['holes']:
            return np.eye(3), _NOWHERE
        if self._surface is not None:
            return self._pose(self._values['probe'], stamp)
        return self._pose(self._wrenches[-1][3], stamp) if self._wrenches and self._wrenches[-1][0] >= stamp else None

    def _warn(self, name: str, text: str, stamp: float) -> None:
        """Drop the present press; log why, unless it passes at once as while everything starts."""
        self._guide.drop(text)
        if stamp - self._lost_s.setdefault(name, stamp) > _LATE_S:
            self._log.error(name, text)

    def _wrench_at(self, stamp: float) -> dict:
        """The fields of a Sample about the wrench; without a topic it never stands still."""
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
            if not self._finding.open_places:
                self._found(fit_mounting(self._finding.touches, self._surface))
            if reported:
                self.get_logger().info(f'{reported}. {self._guide.advice}')
            return
        if press is not None and not self._infos.keys() >= set(self._info_topics):
            press, reported = None, 'dropped: no camera_info has come; calibrate the camera first'
        if press is not None and (away := self._camera_away(press.rest[0])):
            press, reported = None, f'dropped: {away}'
        if press is not None:
            self._keep(press)
        if press is not None and self._values['wrench'] and not np.isfinite(press.touched[0].wrench).all():
            reported += f'; no wrench on {self._values["wrench"]}, so it gives no forces'
        if reported:
            over = press is not None or reported.startswith('dropped')
            self.get_logger().info(f'{reported}. {self._session.advice}' if over else reported)
        if press is not None and not self._session.open_places:
            self._end()

    def _camera_away(self, untouched: Sample) -> str:
        """Why the cameras are not where they were before the first press; ''."""
        views = [reduced(message) for _, message in untouched.raw if isinstance(message, Image) and self._surface is not None]
        self._views = self._views or views
        way = max((moved(*pair) for pair in zip(self._views, views)), default=0.0)
        return f'the camera has moved by {100 * way:.1f} % of its picture; put it back, or begin anew with another output' \
            if way > _MOVED else ''

    def _keep(self, press: Press) -> None:
        """Write a bag under another name first, so that what is there is always whole."""
        number = 1 + max((int(bag.name.removeprefix('press_')) for bag in self.bags), default=0)
        fresh = self._folder / 'unfinished'
        shutil.rmtree(fresh, ignore_errors=True)
        self._folder.mkdir(parents=True, exist_ok=True)
        write_messages(fresh, self.get_namespace(), self._messages(press))
        fresh.rename(self._folder / f'press_{number:03d}')
        self._session.keep(press)
        cv2.imwrite(str(self.output.with_name(f'{self.output.stem}_coverage.png')), self._session.picture())

    def _messages(self, press: Press):
        """(stamp in ns, topic, message) of a press. The wrench is that above the untouched one, which is the sensor's own: it is taken off
        before it gets an arm. A sensor behind the probe feels the reaction, which its sign tells: nothing pulls at a sheet."""
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
        """Position (3,) m and direction (3,) of what presses."""
        return (_NOWHERE, np.array([0.0, 0.0, 1.0])) if self._surface is None else self._surface.contact(sample.tip)

    def _undo(self, _request, answer: Trigger.Response) -> Trigger.Response:
        """Take the last press, or touch, away."""
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
        """The next weight lies on."""
        answer.success, answer.message = True, self._session.next_weight()
        self.get_logger().info(answer.message)
        return answer

    def _finish(self, _request, answer: Trigger.Response) -> Trigger.Response:
        """End with what there is."""
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
        signal.signal(signal.SIGINT, signal.default_int_handler)  # run_node's does nothing any more
        code = calibrate([*map(str, node.bags), '--params', str(node.params), '--output', str(node.output), *node.sphere])
        if node.mounting_file.exists():
            print(node.mounting_file.read_text(), flush=True)
    elif made:
        print(f'{len(made[0].bags)} presses are kept; start it again with the same output to go on', flush=True)
    return code
