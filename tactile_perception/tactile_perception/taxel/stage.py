# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel array's stage: images in, contact regions, contacts, slip and wrench out."""
from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from sensor_msgs.msg import CompressedImage, Image, JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from tactile_driver.nodes.messages.images import grey_to_array
from tactile_driver.recordings.written_message import WrittenMessage

from ..common import messages as convert
from ..common.geometry import FrameTree, wrench_at
from ..core.errors import BadFrame
from ..core.messages import stamp_seconds
from ..core.stage import Input, Stage
from .parameters import TAXEL_PARAMETERS, contact_depth, frames_of, grasped_object, taxel_estimator

_JOINTS = Input('/joint_states', JointState, depth=100)
_TRANSFORMS = Input('/tf', TFMessage, depth=100), Input('/tf_static', TFMessage, depth=100, latched=True)


class TaxelStage(Stage):
    """image_raw -> contact_region, contacts, slip, wrench, points.

    Parameters
    ----------
    values : Mapping
        Values of TAXEL_PARAMETERS.

    Raises
    ------
    BadArgument
        If the values are inconsistent.
    BadCalibration
        If the calibration file cannot be used.
    """

    node, parameters = 'taxel_contact_node', TAXEL_PARAMETERS
    # The queue is longer than usual because slip is estimated from motion, for which no frame should be lost.
    input = Input('image_raw', Image, depth=100, patience_s=0.15)
    outputs = convert.RESULTS | convert.POINTS

    def __init__(self, values: Mapping):
        super().__init__(values)
        self._tree = FrameTree()
        self._joint = -np.inf, np.nan  # stamp, s, and position of the gripper's joint
        self._unknown = ''  # why the depth of the last image is not known
        self.reset()

    def reset(self) -> None:
        """Drop all earlier frames."""
        self.estimator = taxel_estimator(self.values)
        self._placed: tuple[int, str] = (-1, '')  # version of the tree, and sensor frame, in which the object is given

    def set_reference(self) -> None:
        """Use the next frames as the untouched reference."""
        self.estimator.set_reference()

    @property
    def side_inputs(self) -> Sequence[Input]:
        """Frame transforms, if they locate the grasped object or the wrench, and the joints of a gripper."""
        return (*(_TRANSFORMS if frames_of(self.values) or self.values['wrench_frame'] else ()),
                *((_JOINTS,) if self.values['gripper.joint'] else ()))

    def take(self, topic: str, message: TFMessage | JointState) -> None:
        """Take transforms or joints. Raises BadFrame for an invalid one, after the others of the message have been taken."""
        if topic == _JOINTS.topic:
            self._take_joint(message)
            return
        refused = None
        for one in message.transforms:
            at, turn = one.transform.translation, one.transform.rotation
            try:
                self._tree.take(one.header.frame_id.lstrip('/'), one.child_frame_id.lstrip('/'), np.array([turn.x, turn.y, turn.z, turn.w]),
                                np.array([at.x, at.y, at.z]))
            except BadFrame as error:
                refused = error
        if refused is not None:
            raise refused

    def _take_joint(self, message: JointState) -> None:
        name = self.values['gripper.joint']
        if name not in message.name:  # of another publisher
            return
        number = message.name.index(name)
        if number >= len(message.position) or not np.isfinite(message.position[number]):
            raise BadFrame(f'{_JOINTS.topic}: joint {name!r} has no position')
        self._joint = stamp_seconds(message.header), message.position[number]

    def estimate(self, message: Image | CompressedImage, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """Estimate the results of one image, with its header."""
        values = grey_to_array(message, 'taxel image')
        self._place_object(message.header.frame_id)
        if self.values['gripper.joint']:
            self._open_gripper(stamp_s)
        result = self.estimator.process(values, stamp_s)
        found = convert.results_to_messages(result, message.header, topics)
        if self.values['wrench_frame'] and 'wrench' in found:
            found['wrench'] = [self._at_wrench_frame(result.wrench, message.header)]
        return found

    def _open_gripper(self, stamp_s: float) -> None:
        """Compute the depth from the gripper's opening at the time of an image."""
        reported_s, position = self._joint
        self._unknown = ''
        if abs(stamp_s - reported_s) > 1.0:  # s: ten periods of a slow gripper
            position, name = np.nan, self.values['gripper.joint']
            self._unknown = f'{_JOINTS.topic} has no position of joint {name!r} at the time of the images: depth is NaN; publish it'
        elif not self.values['object.width'] > 0:
            self._unknown = 'the width of the object is not known: depth is NaN; set object.width'
        depth = contact_depth(self.values, position)
        self.estimator.grasped = replace(self.estimator.grasped, depth=depth)

    def _at_wrench_frame(self, wrench: np.ndarray, header: Header) -> WrittenMessage:
        """Transform a wrench (6,) to the frame of parameter wrench_frame; NaN if tf does not lead there."""
        frame = self.values['wrench_frame']
        pose = self._tree.pose(header.frame_id.lstrip('/'), frame)
        moved = np.full(6, np.nan) if pose is None else wrench_at(wrench, *pose)
        return convert.wrench_to_message(moved, Header(stamp=header.stamp, frame_id=frame))

    def check_change(self, values: Mapping) -> None:
        """Raise BadArgument unless values describe an object."""
        grasped_object(values)

    def change(self, values: Mapping) -> None:
        """Apply new properties of the object. Raises BadArgument."""
        self.estimator.grasped = grasped_object(values, self._tree, self._placed[1])
        self.values = dict(values)

    def health(self) -> tuple[str, dict]:
        """Warns of a reference that may have been taken under a touch, and of missing transforms."""
        estimator, sensor_frame = self.estimator, self._placed[1]
        pressed = 'the reference may contain a contact: release the sensor and call set_reference' if estimator.looks_pressed else ''
        lost = [frame for frame in sorted(frames_of(self.values)) if self._tree.pose(frame, sensor_frame) is None]
        missing = f'no transform leads from {" or ".join(lost)} to {sensor_frame!r}: friction is NaN; publish it' if lost else ''
        goal, apart = self.values['wrench_frame'], ''
        if goal and sensor_frame and self._tree.pose(sensor_frame, goal) is None:
            apart = f'no transform leads from {sensor_frame!r} to {goal!r}: wrench is NaN; publish it'
        return '; '.join(filter(None, (pressed, missing, apart, self._unknown))), {'reference': pressed or 'in order',
                                                                               'noise (values)': estimator.sigma}

    def _place_object(self, sensor_frame: str) -> None:
        placed = self._tree.changes, sensor_frame.lstrip('/')
        if placed == self._placed:
            return
        self._placed = placed
        if frames_of(self.values):
            self.estimator.grasped = grasped_object(self.values, self._tree, placed[1])
