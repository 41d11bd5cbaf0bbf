# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A cushion with randomly printed circles: calibrated by one recording of presses, tested on another recording."""
import numpy as np
import pytest
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import write_scene
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_perception.bags.replay import Replay
from tactile_perception.press.calibration import read_touch
from tactile_perception.press.tools import calibrate_markers
from tactile_perception.tools.process_bag import process_bag


pytestmark = pytest.mark.slow


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp('random')
    text = open(share('params', 'air_cushion_sim.yaml'), encoding='utf-8').read()
    (folder / 'params.yaml').write_text(text.replace('rows: 17', 'rows: 0').replace('columns: 17', 'columns: 0'), encoding='utf-8')
    write_scene(folder / 'calibration', 'air_cushion_random_calibration', rate=1.5, frames=70)
    write_scene(folder / 'demo', 'air_cushion_random_demo', rate=2.0, frames=16)
    calibrate_markers([folder / 'calibration'], folder / 'params.yaml', folder / 'cushion.yaml')
    return folder


def _messages(bag):
    found = {}
    with BagReader(bag) as reader:
        for message in reader.messages():
            topic = message.topic.split('/', 2)[-1]  # without the namespace; /tf_static has none
            if topic in ('dots', 'contacts', 'ground_truth/contacts'):
                found.setdefault(message.stamp_ns, {})[topic] = decode(message.data, message.type_name)
    return list(found.values())


def test_circles_have_the_numbers_of_the_calibration_in_another_recording(folder):
    known = read_touch(folder / 'cushion.yaml', 'air_cushion')
    assert 150 < len(known.pattern) < 400
    replay = Replay(folder / 'demo', folder / 'params.yaml', folder / 'cushion.yaml')
    process_bag(replay, folder / 'out')
    assert replay.done == 16 and not replay.left_out.total
    frames = _messages(folder / 'out')
    for frame in frames:
        dots = frame['dots']
        place = np.column_stack([dots.u, dots.v]) - np.column_stack([dots.du, dots.dv])
        assert len(dots.id) > 0.97 * len(known.pattern) and np.abs(place - known.pattern[np.array(dots.id)]).max() < 1.0
    reported = [(frame['ground_truth/contacts'].contacts, frame['contacts'].contacts) for frame in frames]
    assert not any(found for truth, found in reported if not truth)
    deep = [(truth[0], found) for truth, found in reported if truth and truth[0].depth > 0.008]
    assert deep and all(found for _, found in deep)
    off = [np.hypot(truth.position.x - found[0].position.x, truth.position.y - found[0].position.y) for truth, found in deep]
    assert np.median(off) < 8e-3
