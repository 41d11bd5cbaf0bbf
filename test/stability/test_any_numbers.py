# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimators on arbitrary numbers (hypothesis, derandomized): a result on the sensor, no result, or a named error; the next good frame is
processed."""

import numpy as np
import pytest

hypothesis = pytest.importorskip('hypothesis', reason='pip install hypothesis')
from hypothesis import HealthCheck, given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402
from hypothesis.extra import numpy as arrays  # noqa: E402

import hard_taxels  # noqa: E402
from hard_psd import PERIOD, REST, finger, scene  # noqa: E402
from hard_sheets import SHIPPED, field_of, method, pad_inputs, pad_tracks, sheet, stage_of_pad, track_inputs  # noqa: E402
from tactile_perception.errors import TactileError  # noqa: E402
from tactile_perception.taxel.pressure import TaxelArray  # noqa: E402

pytestmark = pytest.mark.filterwarnings('ignore::RuntimeWarning')
few = settings(derandomize=True, database=None, deadline=None, max_examples=40, suppress_health_check=list(HealthCheck))
fewer = settings(few, max_examples=10)
hard = st.one_of(st.sampled_from([0.0, 5e-324, 1e-30, 1e30, 1e300, np.inf, -np.inf, np.nan]), st.floats())
ARRAY = TaxelArray(9, 11, 1e-3)
levels = st.one_of(arrays.arrays(float, ARRAY.shape, elements=st.one_of(st.floats(-50, 255), hard)),
                   arrays.arrays(np.uint8, ARRAY.shape), arrays.arrays(np.float32, ARRAY.shape, elements=st.floats(0, 255, width=32)))
spoiled = st.lists(st.tuples(st.integers(0, 10**6), hard), max_size=30)


@pytest.mark.parametrize('name', ['mechanics', 'paper'])
@few
@given(st.lists(levels, min_size=1, max_size=4))
def test_any_taxel_image(name, images):
    estimator = hard_taxels.begun(name, ARRAY)
    half = 0.5 * ARRAY.pitch * np.array([ARRAY.columns, ARRAY.rows]) + 1e-9
    for k, image in enumerate(images):
        with np.errstate(all='ignore'):
            try:
                result = estimator.process(image, 0.01 * (k + 1))
            except TactileError:
                continue
        assert 0 <= result.region.area <= 4.1 * half[0] * half[1] and np.isfinite(result.pressure).all()
        for contact in result.contacts:
            assert (np.abs(contact.position[:2]) <= half).all() and not np.isinf([contact.force, contact.depth]).any()
    with np.errstate(all='ignore'):
        found = estimator.process(np.full(ARRAY.shape, 100.0), 1.0)
    assert np.isfinite(found.pressure).all()


@pytest.mark.parametrize('name', ['map', 'paper'])
@few
@given(st.lists(arrays.arrays(float, st.tuples(st.integers(1, 40), st.just(4)), elements=st.one_of(st.floats(0, 5), hard)), max_size=3))
def test_any_voltages(name, blocks):
    made = finger(name)
    for volts in blocks:
        with np.errstate(all='ignore'):
            samples = made.detect(volts, PERIOD)
            for begin, end in samples.runs():
                if samples.contact[begin:end].any():
                    normal = made.touch(samples, begin, end).normal
                    assert np.isnan(normal).all() or abs(np.linalg.norm(normal) - 1) < 1e-9
        assert not samples.contact[~np.isfinite(volts).all(axis=1)].any()
    rest = np.tile(scene()[0][:REST], (4, 1))
    made.set_reference()
    made.detect(rest, PERIOD)
    assert not made.detect(rest, PERIOD).contact.any()


@pytest.mark.parametrize('contact', ['membrane', 'paper'])
@fewer
@given(spoiled)
def test_any_dots_of_a_pad(contact, changes):
    stage, inputs = stage_of_pad(contact), pad_inputs()
    true = stage_of_pad(contact).process(pad_tracks(inputs), 1.6)
    xyz = inputs['xyz'].copy()
    for place, value in changes:
        xyz.ravel()[place % xyz.size] = value
    with np.errstate(all='ignore'):
        try:
            result = stage.process(pad_tracks(inputs | {'xyz': xyz}), 1.5)
        except TactileError:
            result = None
    for found in () if result is None else result.contacts:
        assert np.isfinite(found.position).all() and np.abs(found.position).max() < 0.25
    after = stage.process(pad_tracks(inputs), 1.6)
    if contact == 'membrane':
        assert len(after.contacts) == len(true.contacts)
        assert after.contacts[0].position == pytest.approx(true.contacts[0].position, abs=5e-4)


@pytest.mark.parametrize('name', SHIPPED)
@fewer
@given(spoiled, st.sampled_from(['uv', 'duv', 'area', 'sigma']))
def test_any_markers_of_a_sheet(name, changes, which):
    """Told on the sensor or not, and the next good frame is told as if there had been none before."""
    inputs, kind, made = track_inputs(name), SHIPPED[name][0], method(name)
    values = inputs[which].copy()
    for place, value in changes:
        values.ravel()[place % values.size] = value
    with np.errstate(all='ignore'):
        try:
            found = made.estimate(field_of(name, **inputs | {which: values}))
        except TactileError:
            found = []
    reach = 0.5 * max(sheet(kind)[0].sensor.size) or sheet(kind)[0].sensor.rim_radius
    for touch in found:
        assert np.isfinite(touch.position).all() and np.abs(touch.position[:2]).max() <= reach and np.isfinite(touch.depth)
        assert np.isfinite(touch.covariance).all() and np.linalg.eigvalsh(touch.covariance).min() >= -1e-15
    (after,), (plain,) = (some.estimate(field_of(name, **inputs)) for some in (made, method(name)))
    assert after.position == pytest.approx(plain.position, abs=2e-4)
