# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Random messages to every subscribing node are counted, reported and skipped; no defect occurs, and the next good ones are processed:
results are bitwise identical with and without bad messages between them."""
import copy
import random
from array import array

import numpy as np
import pytest
from fed_nodes import NODES, at, compressed, fed, sent
from random_messages import hostile

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.recordings.serialization import encode
from tactile_perception.core.errors import BadFrame
from tactile_perception.core.messages import camera_matrices, check_message
from tactile_perception.finger.stage import FingerStage

pytestmark = pytest.mark.filterwarnings('ignore::RuntimeWarning')
_STEP_NS = 10_000_000
#: Markers of a taxel array need five messages of one stamp of which none was refused: measured, 16 of 800 times.
_DRAWN = 0.005


def thrown(name, sensor, count):
    """The node after so many messages of each type that it takes, most of them hostile; what they made it publish."""
    node, rng, found = fed(name, sensor), random.Random(f'{name} {sensor}'), sent(sensor)
    good = {}
    for topic, message in found:
        node.feed(topic, message)
        good.setdefault(topic, []).append(message)
        if topic == 'image_raw':
            good[topic].append(compressed(message, rng.choice(('.png', '.jpg'))))
    stamp, published = max(stamp_ns_of(message.header) for _, message in found), 0
    with np.errstate(all='ignore'):
        for _ in range(count):
            stamp += _STEP_NS
            for topic, messages in good.items():
                message = at(rng.choice(messages), stamp)
                published += len(node.feed(topic, message if rng.random() < 0.2 else hostile(rng, message)))
    return node, stamp, published


@pytest.mark.parametrize('count', [50, pytest.param(20_000, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
@pytest.mark.parametrize('name, sensor', NODES)
def test_random_messages_of_each_type_meet_no_defect(name, sensor, count):
    node, stamp, published = thrown(name, sensor, count)
    try:
        log = node.node.log
        assert node.node.guard.caught == 0 and log.refused > count / 10 and published > count * _DRAWN, (log.refused, published)
        health = node.node.examine()
        assert health.values['refused frames'] == log.refused and health.values['last error']
        done = log.done
        for topic, message in sent(sensor):
            node.feed(topic, at(message, stamp_ns_of(message.header) - stamp_ns_of(sent(sensor)[0][1].header) + stamp + _STEP_NS))
        assert log.done > done
    finally:
        node.close()


_BEGIN = 14  # messages after which every node has processed a frame, so that later stamps can be checked against its stamp
_PERIOD_NS = 1_000_000  # ns from a bad message to the next good one


def _set(**values):
    def spoil(message):
        for name, value in values.items():
            setattr(message, name, value)
    return spoil


def _stamp(sec, nanosec):
    def spoil(message):
        message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    return spoil


def _entry(name, value):
    def spoil(message):
        values = array(getattr(message, name).typecode, getattr(message, name))
        values[len(values) // 2] = value
        setattr(message, name, values)
    return spoil


STAMPS = {'before 1970': _stamp(-2**31, 0), 'no time': _stamp(2**31 - 1, 1_000_000_000), 'nanoseconds': _stamp(1, 2**32 - 1)}
ONLY_ESTIMATES = {'zero': _stamp(0, 0), 'far ahead': _stamp(2**31 - 9, 0), 'long ago': _stamp(10**8, 0)}
IMAGES = {'encoding': _set(encoding='32FC1'), 'no encoding': _set(encoding=''), 'step': _set(step=1), 'height': _set(height=2**32 - 1),
          'no width': _set(width=0), 'no data': _set(data=array('B'))}
BAD = {
    'image_raw': IMAGES,
    'camera_info': {'zeros': _set(k=np.zeros(9)), 'NaN': _set(k=np.full(9, np.nan)), 'singular': _set(k=np.ones(9)),
                    'distortion': _set(d=array('d', [np.inf] * 5)), 'another size': _set(width=64, height=48)},
    'dots': {'beyond the grid': _entry('id', 2**32 - 1), 'twice': lambda message: _entry('id', message.id[0])(message),
             'infinite': _entry('u', np.inf), 'far away': _entry('z', 3e38), 'cut': _set(v=array('f')), 'another grid': _set(rows=65535)},
    'voltages': {'period': _set(sample_period=np.inf), 'no period': _set(sample_period=0.0),
                 'part of a sample': _set(voltages=array('f', [1.0])), 'none': _set(voltages=array('f'))},
    'contacts': {'infinite': lambda message: [setattr(c, 'depth', np.inf) for c in message.contacts]},
    'contact_region': {'states': _set(dot_state=array('B', [1])), 'area': _set(area=1e300)},
    'slip': {'state': _set(state=255), 'lengths': _set(x=array('f', [1.0]))},
    'wrench': {'force': lambda message: setattr(message.wrench.force, 'z', np.inf)},
}


def spoiled(name, topic, message, rng):
    """(what, bad message) of all kinds, and random ones that cannot be used, each a little before the good one."""
    early = at(message, stamp_ns_of(message.header) - _PERIOD_NS)
    kinds = {**STAMPS, **({} if 'markers' in name else ONLY_ESTIMATES), **BAD.get(topic, {})}
    if topic == 'image_raw' and message.encoding == 'bgr8' and 'markers' not in name:
        kinds['black'] = _set(data=array('B', bytes(len(message.data))))
    for what, spoil in kinds.items():
        bad = copy.deepcopy(early)
        spoil(bad)
        if topic != 'contacts' or what in STAMPS or message.contacts:
            yield what, bad
    for _ in range(5):
        bad = hostile(rng, early)
        if not usable(topic, bad):
            yield 'random', bad


def usable(topic, message):
    """Whether its arrays can be read."""
    try:
        check_message(message)
        {'camera_info': camera_matrices, 'voltages': FingerStage.check}.get(topic, lambda _: None)(message)
    except BadFrame:
        return False
    return True


def reported(node, found):
    """What each good message makes a node publish, as bytes."""
    return [[(topic, encode(result)) for topic, result in node.feed(*one)] for one in found]


@pytest.mark.parametrize('name, sensor', NODES)
def test_bad_messages_between_good_ones_change_nothing(name, sensor):
    node, other, found = fed(name, sensor), fed(name, sensor), sent(sensor)[:120]
    undisturbed, rng, refused = reported(node, found), random.Random(1), 0
    assert sum(map(len, undisturbed)) > 5
    for number, (topic, message) in enumerate(found):
        bad = list(spoiled(name, topic, message, rng)) if number >= _BEGIN else []
        for what, one in bad if number < 40 else rng.sample(bad, 3):
            before = other.node.log.refused
            assert not other.feed(topic, one), (what, topic)
            refused += other.node.log.refused - before
        assert reported(other, [(topic, message)])[0] == undisturbed[number], (number, topic)
    assert refused > 20 and other.node.guard.caught == 0
    node.close(), other.close()
