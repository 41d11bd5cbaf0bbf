# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import played
import pytest

from tactile_perception.psd.model_fit import fit_finger
from tactile_perception.psd.presses import find_presses


def fitted(chosen, seed=0):
    return fit_finger(find_presses([played.recording('calibration', seed, chosen)], 4.9))


def test_a_full_calibration(fit):
    assert fit.notes == [] and fit.places == 107
    assert np.degrees(fit.errors.mean()) < 0.6 < np.degrees(fit.paper_errors.mean())
    assert fit.span['theta'] == pytest.approx([0, np.radians(70)], abs=1e-6)
    assert fit.residuals['force_relative'] < 0.15 and fit.residuals['depth_relative'] < 0.08
    model = fit.model
    assert model.smooth is not None and model.level is not None and model.cross is not None
    assert 0.2 < model.levels(np.zeros((1, 2)))[0] < 1.0


@pytest.mark.parametrize(('chosen', 'smooth', 'note'), [
    (slice(0, 3), None, 'too few'), (slice(0, 9), None, 'too few'), (slice(0, 14), 3, 'affine'), (slice(0, None, 4), 5, None)])
def test_with_fewer_positions_it_falls_back_with_a_note(chosen, smooth, note):
    fit = fitted(chosen)
    terms = None if fit.model.smooth is None else len(fit.model.smooth.slopes)
    assert terms in (smooth, None)
    assert note is None or any(note in line or 'no better' in line for line in fit.notes)


def test_fewer_places_are_less_exact_but_never_worse_than_the_paper():
    few, many = fitted(slice(0, None, 3)), fitted(slice(None))
    grid = np.stack(np.meshgrid(np.linspace(-0.45, 0.45, 25), np.linspace(-0.45, 0.45, 25)), axis=-1).reshape(-1, 2)
    from tactile_perception.psd.geometry import error_angle
    assert np.degrees(error_angle(few.model.normals(grid), many.model.normals(grid))).mean() < 0.6
    assert few.errors.mean() <= few.paper_errors.mean()


def test_the_light_of_a_contact_moves_its_place():
    """A strong press looks nearer to the pole than it is; at the typical light nothing moves."""
    model = fitted(slice(None)).model
    place = np.array([[0.4, 0.0], [0.0, -0.4]])
    light = model.shift.light(place)
    dim, typical, bright = (np.arccos(model.normals(place, part * light)[:, 2]) for part in (0.5, 1.0, 1.5))
    assert (np.degrees(bright - dim) > 0.3).all()
    assert typical == pytest.approx(np.arccos(model.normals(place)[:, 2]))
