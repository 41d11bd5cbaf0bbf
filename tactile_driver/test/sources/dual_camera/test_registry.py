# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every source of two cameras is made from the node's parameters."""
import time

import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.parameters.dual_camera import DUAL_CAMERA_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources.camera.file import FileSource
from tactile_driver.sources.camera.simulated import DualSimulatedSource
from tactile_driver.sources.dual_camera.file import TwoFilesSource
from tactile_driver.sources.dual_camera.pairs import PairedSource, SplitSource
from tactile_driver.sources.dual_camera.registry import make_dual_source

VALUES = {**defaults(DUAL_CAMERA_PARAMETERS), 'path': 'a', 'right_path': 'b', 'device': 'A1', 'right_device': 'B2'}


def made(**values):
    return make_dual_source({**VALUES, **values}, time.time_ns, lambda topic: FileSource(topic, 0, False, time.time_ns))


@pytest.mark.parametrize(('name', 'kind', 'live'), [('sim', DualSimulatedSource, True), ('device', PairedSource, True),
                                                    ('file', TwoFilesSource, False), ('bag', PairedSource, False)])
def test_each_kind(name, kind, live):
    source = made(source=name)
    assert isinstance(source, kind) and source.live == live and source.describe()['source'] == name
    source.close()


def test_left_and_right_are_what_was_asked_for():
    assert made(source='device').describe()['path'] == 'A1 + B2'
    about = made(source='bag', right_path='').describe()
    assert (about['left']['path'], about['right']['path']) == ('a', 'a')
    assert made(source='file').describe()['path'] == 'a + b'
    about = made(source='topics', topic='x', right_topic='y').describe()
    assert (about['left']['path'], about['right']['path']) == ('x', 'y')


@pytest.mark.parametrize('name', ['device', 'file', 'bag'])
def test_one_image_with_both_views(name):
    source = made(source=name, layout='side_by_side')
    assert isinstance(source, SplitSource) and source.describe()['layout'] == 'side_by_side'


def test_an_unknown_source_is_answered_with_the_known_ones():
    with pytest.raises(BadArgument, match='sim, device, file, bag, topics'):
        made(source='nix')
