# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage of a taxel array and its tools."""
import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.parameters.table import defaults
from tactile_perception.common.residuals import outliers
from tactile_perception.core.errors import BadArgument, BadFrame, ClockSetBack
from tactile_perception.taxel.calibration import Loads, find_loop, held_out_errors
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS
from tactile_perception.taxel.pressure import TaxelArray
from tactile_perception.taxel.response import Loop
from tactile_perception.taxel.stage import TaxelStage
from tactile_perception.taxel.tools import held_out_residuals

VALUES = defaults(TAXEL_PARAMETERS)


def image(values, stamp=1.0):
    encoding = 'mono8' if values.dtype == np.uint8 else 'mono16'
    return image_to_message(Frame(values, 0, encoding), '', header_of(round(stamp * 1e9), 'pad'))


def pressed(level=100):
    values = np.full((44, 44), 3, np.uint8)
    values[15:30, 10:35] = level
    return values


@pytest.mark.parametrize('change', [dict(encoding='bgr8'), dict(step=40), dict(height=0), dict(height=45)])
def test_refused_images(change):
    message = image(pressed())
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(BadFrame):
        TaxelStage(VALUES).process(message)


def test_results_have_the_header_of_the_image():
    stage = TaxelStage(VALUES)
    for k in range(3):
        stage.process(image(np.full((44, 44), 3, np.uint8), 1 + 0.01 * k))
    found = only(stage.process(image(pressed(), 1.5)))
    assert {topic: message.header.stamp.nanosec for topic, message in found.items()} == dict.fromkeys(
        ('contact_region', 'contacts', 'slip', 'wrench', 'points'), 500_000_000)
    assert found['contact_region'].area == pytest.approx(375e-6, rel=0.1) and len(found['contacts'].contacts) == 1
    assert np.isnan(found['wrench'].wrench.force.z)


def test_the_object_can_be_changed_at_run_time():
    stage = TaxelStage(VALUES)
    stage.process(image(np.full((44, 44), 3, np.uint8), 1.0))
    stage.change(VALUES | {'object.depth': 4e-4})
    area = only(stage.process(image(pressed(), 1.1)))
    assert area['wrench'].wrench.force.z == pytest.approx(-3e5 / 0.002 * 4e-4 * area['contact_region'].area)
    with pytest.raises(BadArgument):
        stage.check_change(VALUES | {'object.gravity': [0.0, 0.0, 0.0]})


def only(found):
    """Topic -> its only message."""
    return {topic: message for topic, (message,) in found.items()}


def transforms(*links):
    message = TFMessage()
    for parent, child, turn, position in links:
        one = TransformStamped(child_frame_id=child)
        one.header.frame_id = parent
        one.transform.rotation.z, one.transform.rotation.w = np.sin(turn / 2), np.cos(turn / 2)
        one.transform.translation.x, one.transform.translation.y, one.transform.translation.z = position
        message.transforms.append(one)
    return message


def test_friction_follows_the_orientation_from_tf():
    """Equations 6 and 7: half of the weight in the sensor frame; its moment from the centre of mass in the object's own frame."""
    known = {'object.weight': 4.0, 'object.depth': 4e-4, 'object.gravity': [0.0, -1.0, 0.0], 'object.gravity_frame': 'world',
             'object.centre_of_mass': [0.0, 0.02, 0.0], 'object.centre_of_mass_frame': 'object'}
    stage = TaxelStage(VALUES | known)
    stage.process(image(np.full((44, 44), 3, np.uint8), 1.0))
    force = only(stage.process(image(pressed(), 1.1)))['wrench'].wrench.force
    assert np.isnan(force.x) and np.isfinite(force.z) and "'pad'" in stage.health()[0] and 'object or world' in stage.health()[0]
    stage.take('/tf', transforms(('/world', 'wrist', np.pi / 2, (0.3, 0, 1)), ('wrist', '/pad', 0.0, (0, 0, 0.1)),
                                   ('pad', 'object', 0.0, (0.01, 0, 0))))
    assert stage.health()[0] == ''
    found = only(stage.process(image(pressed(), 1.2)))['wrench'].wrench
    # Gravity, along the world's -y, is along -x of a pad turned left; the centre of mass is at (0.01, 0.02).
    assert [found.force.x, found.force.y] == pytest.approx([-2.0, 0.0], abs=1e-9) and found.torque.z == pytest.approx(0.02 * 2.0)
    stage.take('/tf', transforms(('world', 'wrist', 0.0, (0.3, 0, 1))))
    found = only(stage.process(image(pressed(), 1.3)))['wrench'].wrench
    assert [found.force.x, found.force.y] == pytest.approx([0.0, -2.0], abs=1e-9) and found.torque.z == pytest.approx(-0.01 * 2.0)


def test_an_invalid_transform_is_refused_and_the_others_are_used():
    stage = TaxelStage(VALUES | {'object.weight': 4.0, 'object.gravity_frame': 'world'})
    stage.process(image(np.full((44, 44), 3, np.uint8), 1.0))
    with pytest.raises(BadFrame, match='elbow'):
        stage.take('/tf', transforms(('world', 'elbow', np.nan, (0, 0, 0)), ('world', 'pad', 0.0, (0, 0, 0))))
    assert np.isfinite(only(stage.process(image(pressed(), 1.1)))['wrench'].wrench.force.y)


def test_a_recording_that_restarts():
    stage = TaxelStage(VALUES)
    stage.process(image(pressed(), 9.0))
    with pytest.raises(ClockSetBack):
        stage.process(image(pressed(), 1.0))
    assert not only(stage.process(image(pressed(), 1.1)))['contacts'].contacts


def loads_of(changes, forces, times=None, when=None):
    """Loads of one recording, one second apart, each with its own level."""
    count = len(forces)
    return Loads(changes, np.asarray(forces, float), None, [], when or [''] * count, np.arange(1.0, count + 1) if times is None else times,
                 np.zeros(count, int), np.arange(count))


def test_errors_are_reported_over_force_and_over_the_pad_if_positions_differ():
    changes = np.zeros((6, 5, 5))
    changes[:, 2, 2] = 1
    array, forces = TaxelArray(5, 5, 1e-3), np.arange(1.0, 7)
    errors = np.array([0.01, -0.01, 0.02, -0.02, 0.01, 0.5])
    loads = loads_of(changes, forces, when=[f'bag at {k} s' for k in range(6)])
    found, = held_out_residuals(loads, array, errors)
    assert found.value == pytest.approx(100 * errors) and found.position[:, 0] == pytest.approx(forces)
    assert outliers([found]) == ['bag at 5 s: force error 50 %, the median is 1.5 %']
    changes[0] = np.roll(changes[0], 2, axis=1)
    _, over = held_out_residuals(loads, array, errors)
    assert over.position[0] == pytest.approx([2.0, 0.0]) and over.position[1] == pytest.approx([0.0, 0.0])


def test_a_loop_between_rising_and_falling_loads_is_found_and_compensated():
    up = np.repeat([5.0, 10, 20, 40, 60, 80], 3)
    pascal, times = 1e3 * np.concatenate([up, up[::-1]]), np.arange(1, 37) * 0.1
    true = Loop(0.5, 5000.0, 0.0, 0.6)
    seen = true.shown(pascal, np.diff(times, prepend=-1e6))
    changes = np.zeros((36, 8, 8), np.float32)
    changes[:, 1:7, 1:7] = (seen / 450)[:, None, None]
    array, given = TaxelArray(8, 8, 1e-3), loads_of(changes, pascal * 36e-6, times)
    loop, shown = find_loop(given, array, None)
    assert loop.width(8e4) == pytest.approx(true.width(8e4), rel=0.25) and loop.relaxation == pytest.approx(0.6, rel=0.7)
    assert shown == pytest.approx(seen * 36e-6, rel=0.1)
    with_loop = np.abs(held_out_errors(given, array, None, loop, shown))
    without = np.abs(held_out_errors(given, array, None, Loop(), given.forces))
    assert np.nanmedian(with_loop) < 0.4 * np.nanmedian(without)


def shown_by_many_memories(pascal, step_s, rng):
    """Pressure (N,) shown under loads (N,), Pa, every step_s, by random sliding and relaxing springs (Prandtl) and Kelvin elements."""
    sliders = 10**rng.uniform(2.8, 4.7, 6), rng.dirichlet(np.ones(6)) * rng.uniform(0.05, 0.2), 10**rng.uniform(-0.5, 1.3, 6)
    kelvin_s, kelvin = np.geomspace(0.03, 30, 7), rng.dirichlet(np.full(7, 2.0)) * rng.uniform(0.04, 0.16)
    spring, late, found = np.zeros(6), np.zeros(7), []
    for load, change in zip(pascal, np.diff(pascal, prepend=0.0)):
        spring = np.clip(spring * np.exp(-step_s / sliders[2]) + change, -sliders[0], sliders[0])
        late += (load - late) * -np.expm1(-step_s / kelvin_s)
        found.append(load - sliders[1] @ spring + kelvin @ (late - load))
    return np.array(found)


@pytest.mark.parametrize('seed', range(300, 306))
def test_weights_on_a_layer_with_complex_hysteresis(seed):
    """Frames under and after rising and falling loads, from an eighth of the largest."""
    rng = np.random.default_rng(seed)
    up = [1e4, 2e4, 4e4, 8e4]
    pascal = np.repeat([*up, *up[::-1], 0.0, 0.0], 12)
    changes = np.zeros((len(pascal), 8, 8))
    changes[:, 1:7, 1:7] = (shown_by_many_memories(pascal, 0.05, rng) / 450 + rng.normal(0, 0.05, len(pascal)))[:, None, None]
    array, given = TaxelArray(8, 8, 1e-3), loads_of(changes, pascal * 36e-6, np.arange(1, len(pascal) + 1) * 0.05)
    loop, shown = find_loop(given, array, None)
    errors = held_out_errors(given, array, None, loop, shown)
    assert np.isnan(errors[pascal == 0]).all() and np.nanmean(np.abs(errors)) < 0.02 and np.nanmax(np.abs(errors)) < 0.08
