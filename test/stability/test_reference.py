# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A reference taken under a press is detected and reported; results continue, and set_reference corrects it."""
import numpy as np


def test_an_untouched_reference_is_not_suspected(pad):
    chain = pad.chain().begun(pad)
    assert chain.dots.warning == ''
    chain(pad.pressed)
    assert chain.dots.warning == ''


def test_a_pressed_reference_is_noticed_said_and_usable(pad):
    chain = pad.chain()
    tracks, _ = chain(pad.pressed)
    assert 'set_reference' in chain.dots.warning
    assert len(tracks) > 515 and np.abs(tracks.duv).max() == 0
    tracks, result = chain(pad.rest[0])
    assert np.nanmax(np.abs(tracks.duv)) > 3 and np.isnan(result.wrench).all()
    truth = pad.scene.render(0.0).truth
    assert np.linalg.norm(tracks.uv - truth.dot_uv[tracks.id], axis=1).max() < 1.5

    chain.dots.set_reference()
    tracks, result = chain(pad.rest[1])
    assert chain.dots.warning == '' and np.abs(tracks.duv).max() == 0
    for image in pad.rest[2:4]:
        _, result = chain(image)
        assert result.region.area == 0 and not result.contacts
    _, result = chain(pad.pressed)
    true = pad.truth.contacts[0]
    assert len(result.contacts) == 1 and abs(result.contacts[0].depth - true.depth) < 0.3e-3
    assert abs(result.contacts[0].force - true.force) < 0.15 * true.force


def test_the_reference_stands_still_while_something_touches(pad):
    """A touch of two minutes is as deep at its end as at its beginning."""
    chain = pad.chain().begun(pad)
    first = chain(pad.pressed)[1].contacts[0].depth
    for _ in range(12):
        chain.stamp += 10.0
        _, result = chain(pad.pressed)
    assert abs(result.contacts[0].depth - first) < 0.1e-3
    assert not chain(pad.rest[3])[1].contacts
