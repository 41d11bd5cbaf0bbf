# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Random messages to every subscribing node are counted, reported and skipped; no defect occurs, and the next good one is processed."""
import random

import numpy as np
import pytest
from fed_nodes import NODES, at, compressed, fed, sent, stamp_of
from random_messages import hostile

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
    stamp, published = max(stamp_of(message) for _, message in found), 0
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
        health = node.node._examine()
        assert health.values['refused frames'] == log.refused and health.values['last error']
        done = log.done
        for topic, message in sent(sensor):
            node.feed(topic, at(message, stamp_of(message) - stamp_of(sent(sensor)[0][1]) + stamp + _STEP_NS))
        assert log.done > done
    finally:
        node.close()
