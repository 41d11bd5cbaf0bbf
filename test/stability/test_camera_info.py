# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""camera_info that is missing, wrong or changes, and dots that do not belong to the sensor."""
import copy

import numpy as np
import pytest
from rig import Chain, duv, untouched
from tactile_perception.errors import BadArgument, BadFrame, TactileError


@pytest.fixture(scope='module')
def running(pad):
    return pad.chain().begun()


def blind(pad):
    """A chain without a camera_info."""
    of = copy.copy(pad)
    of.info = None
    return Chain(of, pad.values)


def test_without_camera_info_nothing_is_placed(pad):
    chain = blind(pad)
    with pytest.raises(BadFrame, match='no camera_info'):
        chain(pad.rest[0])
    chain.look(pad.info)
    assert len(chain(pad.rest[0])['dots'].x) > 515


def test_a_camera_info_of_zeros_gives_dots_but_no_places_and_no_contact(pad):
    chain = blind(pad)
    chain.look(pad.info, k=np.zeros(9), d=[])
    dots = chain.dots(pad.rest[0])
    assert len(dots.id) > 515 and not len(dots.x)
    with pytest.raises(BadFrame, match='camera'):
        chain.contact(dots)
    chain.look(pad.info)
    assert untouched(chain(pad.rest[1]))


@pytest.mark.parametrize('changes', [
    {'k': np.array([np.nan, 0, 320, 0, 688, 240, 0, 0, 1])}, {'k': np.array([0.0, 0, 320, 0, 688, 240, 0, 0, 1])},
    {'d': [np.nan, 0.0, 0.0, 0.0, 0.0]}, {'distortion_model': 'equidistant'}, {'d': [0.0] * 8}], ids=str)
def test_a_camera_info_that_cannot_be_used_is_refused_and_the_old_one_stays(pad, running, changes):
    with pytest.raises(TactileError, match='camera'):
        running.look(pad.info, **changes)
    assert untouched(running(pad.rest[3]))


def test_a_changed_camera_info_resets(pad):
    """The reference is taken anew, so that nothing is measured against rest positions of the other camera."""
    chain = pad.chain().begun(1)
    matrix = np.array(pad.info.k)
    matrix[2] += 1.0
    chain.look(pad.info, k=matrix)
    assert np.abs(duv(chain(pad.rest[1])['dots'])).max() == 0


def test_a_camera_that_changes_its_size_goes_on_with_its_new_camera_info(pad, small_pad):
    chain = pad.chain().begun(1)
    with pytest.raises(BadFrame, match='320 x 240.*640 x 480'):
        chain(small_pad.rest[0])
    assert len(chain(pad.rest[1])['dots'].x) > 515
    chain.look(small_pad.info)
    assert len(chain(small_pad.rest[0])['dots'].x) > 515 and untouched(chain(small_pad.rest[1]))


@pytest.mark.parametrize('match, changes', [('entries', {'u': [1.0]}), ('entries', {'x': [1.0]}), ('grid', {'rows': 5}),
                                            ('surface cap', {'x': [], 'y': [], 'z': []})])
def test_dots_that_cannot_be_used_are_refused(pad, running, match, changes):
    bad = running.dots(pad.rest[3])
    for name, value in changes.items():
        setattr(bad, name, value)
    with pytest.raises(BadFrame, match=match):
        running.contact(bad)
    assert untouched(running(pad.rest[4]))


@pytest.mark.parametrize('changes', [{'rows': 2, 'columns': 2}, {'camera__rotation': [0.0, 0.0]}, {'cap__height': 0.05},
                                     {'cap__curvature_radius': 0.0}, {'reference__frames': 0}, {'membrane__shear_stiffness': float('nan')}])
def test_parameters_that_make_no_sense_are_refused(pad, changes):
    with pytest.raises(BadArgument):
        pad.chain(**changes)
