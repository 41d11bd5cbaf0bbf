# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.touchpad.membrane import RangeScale, Membrane, MembraneMaterial


def test_the_factor_is_of_displacements():
    assert RangeScale(value=-0.05).factor == 0.95


def _follow(pad, frames, gain, scale):
    rng = np.random.default_rng(3)
    material = MembraneMaterial(pad.info['shear_modulus_times_thickness'], pad.info['rest_gauge_pressure'], pad.info['curvature_radius'])
    membrane, state = Membrane(pad.rest, 23, 23, material), None
    for frame in frames:
        rays, ranges, _ = pad.measure(frame, rng, spread=28e-6, gain=gain)
        state = membrane.solve(pad.camera.centre, rays, ranges, np.full(529, 28e-6), np.arange(529), state, scale=scale)
    return state


@pytest.mark.parametrize('name, gain', [('tp_disc_twist', 0.06), ('tp_rect_drag', -0.04), ('tp_rect_drag', 0.0)])
def test_the_factor_is_found_from_what_is_out_of_balance(touchpad, name, gain):
    scale = RangeScale()
    _follow(touchpad(name), [1, 3, 5, 7, *range(8, 31), *range(9, 31)], gain, scale)
    assert (1 + scale.value) * (1 + gain) == pytest.approx(1, abs=0.022)


def test_a_known_factor_and_an_untouched_pad_teach_nothing(touchpad):
    pad = touchpad('tp_rect_drag')
    known = RangeScale(sigma=0.0, value=0.01)
    _follow(pad, range(3, 13), 0.05, known)
    assert known.value == 0.01
    idle = RangeScale()
    _follow(pad, [0, 1] * 6, 0.05, idle)
    assert idle.value == 0
