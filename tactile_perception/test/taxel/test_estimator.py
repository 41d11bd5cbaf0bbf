# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import copy
from dataclasses import replace

import cv2
import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, moments, picture

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.taxel.pad import DEVICE_B, InkSpecimen, PadSpecimen
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES, Key, TaxelScene, TaxelScript
from tactile_perception.common.estimates import AMBIGUOUS, GROSS, NONE, SATURATED
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.evaluation.scores import macro_f1
from tactile_perception.published.taxel_array_image_processing import PaperMethod, edge_loops, image_moments
from tactile_perception.taxel.estimator import TAXEL_METHODS, TaxelEstimator, TaxelSettings
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS, grasped_object, taxel_estimator
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.response import Response
from tactile_perception.taxel.wrench import GraspedObject

KNOWN = TaxelSettings(response=Response((500.0, 0.0, 0.0), known=True))


def whole(image):
    return np.clip(np.round(image + 3), 0, 255).astype(np.uint8)


def run(images, settings=KNOWN, array=ARRAY, untouched=8, estimator=None):
    """Results of images after some untouched frames."""
    estimator = estimator or TaxelEstimator(array, SoftPad(), settings)
    rest = [np.full(array.shape, 3, np.uint8)] * untouched
    return [estimator.process(values, 1 + 0.01 * k) for k, values in enumerate([*rest, *images])][untouched:]


@pytest.mark.parametrize('method', TAXEL_METHODS)
@pytest.mark.parametrize('image', [np.zeros((44, 44)), np.full((44, 44), 255.0), np.full((44, 44), 40.0),
                                   255.0 * (np.indices((44, 44)).sum(axis=0) % 2), np.eye(44) * 200])
def test_difficult_images_raise_nothing_and_show_no_slip(method, image):
    settings = TaxelSettings(method=method, response=KNOWN.response)
    for result in run([whole(image)] * 6, settings)[1:]:
        assert result.slip.state == NONE and np.isfinite(result.region.area)


def test_uniform_load():
    result = run([whole(np.full((44, 44), 40.0))] * 2)[1]
    assert result.region.area == pytest.approx(44e-3**2, rel=0.06) and np.isnan(result.region.orientation)
    assert result.wrench[2] == pytest.approx(-40 * 500 * 44e-3**2, rel=0.02)


def test_a_jump_by_half_the_array_is_a_new_contact_without_slip():
    results = run([whole(picture(bar(-12, length=10)))] * 8 + [whole(picture(bar(12, length=10)))] * 8)
    assert [results[k].contacts[0].id for k in (7, 8)] == [1, 2]
    assert all(result.slip.state == NONE for result in results)


def test_dead_rows_through_the_contact():
    image = whole(picture(bar(0.4, 0.3, 0.2)))
    image[[15, 21]] = 0
    dead = tuple(int(n) for row in (15, 21) for n in range(44 * row, 44 * row + 44))
    region = run([image], TaxelSettings(response=KNOWN.response, dead=dead))[0].region
    assert region.centroid[:2] == pytest.approx([0.4e-3, 0.3e-3], abs=0.1e-3)
    assert region.orientation == pytest.approx(0.2, abs=np.radians(0.6))


@pytest.mark.parametrize('shape', [(1, 30), (30, 1), (1, 1), (2, 2), (256, 256)])
def test_any_size(shape):
    array = TaxelArray(*shape, 1e-3)
    image = np.zeros(shape)
    image[:, shape[1] // 3:2 * shape[1] // 3 + 1] = 100
    for result in run([whole(image)] * 3, array=array):
        assert result.region.area > 0 and result.slip.state == NONE


def test_a_checkerboard_is_a_broken_image_with_few_results():
    even = np.indices((44, 44)).sum(axis=0) % 2 * 120.0
    for result in run([whole(even), whole(120 - even)] * 3):
        assert result.slip.state == NONE and np.isnan(result.region.orientation) and np.isnan(result.wrench).all()
        assert len(result.contacts) == 64 and all(c.flags & AMBIGUOUS and np.isnan(c.force) for c in result.contacts)


def test_rows_that_die_are_detected_in_contact_and_interpolated():
    image = whole(picture(bar(0.4, 0.3, 0.2)))
    image[[15, 21]] = 3
    results = run([image] * 14)
    assert len(results[0].region.outlines) > 1, 'they part the contact at first'
    region = results[-1].region
    assert len(results[-1].contacts) == 1 and region.area == pytest.approx(160e-6, rel=0.08)
    assert region.centroid[:2] == pytest.approx([0.4e-3, 0.3e-3], abs=0.1e-3)


def test_a_column_that_turns_nan_is_interpolated_and_does_not_slip():
    image = picture(bar()) + 3.0
    gone = image.copy()
    gone[:, 24] = np.nan
    for result in run([image] * 8 + [gone] * 8):
        assert result.region.area == pytest.approx(160e-6, rel=0.08) and len(result.contacts) == 1 and result.slip.state == NONE
        assert np.isfinite(result.pressure).all() and np.isfinite(result.wrench[2])


@pytest.mark.parametrize('shape', [(1, 40), (40, 1)])
def test_a_load_along_a_single_line_of_taxels(shape):
    array = TaxelArray(*shape, 1e-3)
    along = 0 if shape[0] == 1 else 1

    def load(position):
        return whole(100 * np.clip(4.5 - np.abs(np.arange(40) - position), 0, 1).reshape(shape))
    results = run([load(20 + 0.1 * k) for k in range(20)], array=array)
    positions = [result.contacts[0].position[along] for result in results]
    assert np.diff(positions) == pytest.approx(np.full(19, 1e-4), abs=5e-5)
    assert positions[-1] - positions[0] == pytest.approx(1.9e-3, abs=1.5e-4)
    assert results[-1].wrench[2] == pytest.approx(-500 * 1e-6 * 800, rel=0.1)


def test_depth_and_weight_give_the_wrench():
    estimator = TaxelEstimator(ARRAY, SoftPad())
    estimator.grasped = GraspedObject(4e-4, np.array([0.0, 2.0, 0.0]), np.array([0.01, 0.0, 0.0]))
    result = run([whole(picture(bar()))], estimator=estimator)[0]
    assert result.wrench[2] == pytest.approx(-3e5 / 0.002 * 4e-4 * result.region.area)
    assert result.wrench[[0, 1, 5]] == pytest.approx([0, 1.0, 0.01])
    assert result.contacts[0].position[2] == pytest.approx(-4e-4)


@pytest.mark.parametrize('method, strength, by_depth', [('mechanics', 1, False), ('paper', 1, True), ('mechanics', 9, True)])
def test_calibrated_pressure_is_preferred_to_depth_unless_saturated(method, strength, by_depth):
    image, depth = whole(strength * picture(bar())), 2e-3
    known = run([image], TaxelSettings(method=method, response=KNOWN.response))[0]
    estimator = TaxelEstimator(ARRAY, SoftPad(), TaxelSettings(method=method, response=KNOWN.response))
    estimator.grasped = GraspedObject(depth)
    result = run([image], estimator=estimator)[0]
    expected = 3e5 / 0.002 * depth * result.region.area if by_depth else -known.wrench[2]
    assert -result.wrench[2] == pytest.approx(expected) and result.contacts[0].depth == depth


def test_refused_frames():
    estimator = TaxelEstimator(ARRAY, SoftPad())
    estimator.process(np.zeros((44, 44)), 1.0)
    for values, stamp in ((np.zeros((43, 44)), 2.0), (np.full((44, 44), np.nan), 2.0), (np.zeros((44, 44)), 1.0)):
        with pytest.raises(BadFrame):
            estimator.process(values, stamp)


def test_set_reference_uses_the_next_frame():
    estimator = TaxelEstimator(ARRAY, SoftPad(), KNOWN)
    first = run([whole(picture(bar()))], estimator=estimator)[0]
    estimator.set_reference()
    assert first.contacts and not estimator.process(whole(picture(bar())), 5.0).contacts


def test_an_unknown_method_is_refused_with_the_list_of_known_ones():
    with pytest.raises(BadArgument, match='mechanics, paper'):
        TaxelEstimator(ARRAY, SoftPad(), TaxelSettings(method='magic'))


@pytest.mark.full
@pytest.mark.parametrize('thickness', [2e-3, 3e-3])
def test_the_moment_of_a_heavy_grasp(thickness):
    """On a bonded pad the pressure on the taxels is offset from that on the surface, by the thickness times friction over load."""
    specimen, depth = PadSpecimen(thickness=thickness), 3e-4
    pulled = 0.8 * specimen.grip * specimen.press * depth / specimen.pull
    path = ((0.0, 0, -1e-4), (0.4, 0, -1e-4), (0.7, 0, depth), (1.2, pulled, depth), (1.4, pulled, depth))
    scene = TaxelScene(TaxelScript('bar', tuple(Key(t, 4e-3 + x, -3e-3, 0.3, down) for t, x, down in path)), 40.0, 0, specimen,
                       InkSpecimen(uneven=0.0, loop=0.0, memory=0.0))
    pad = SoftPad(specimen.thickness, specimen.press * specimen.thickness, specimen.pull * specimen.thickness, specimen.grip)
    estimator = TaxelEstimator(ARRAY, pad, KNOWN)
    for k in range(scene.frames):
        values, truth = scene.render(k / scene.rate)
        estimator.grasped = GraspedObject(depth, np.array([*2 * truth.wrench[:2], 0.0]))
        found = estimator.process(values, 1 + k / scene.rate).wrench
    assert np.linalg.norm(truth.wrench[:2]) > 0.3 * abs(truth.wrench[2])
    assert np.linalg.norm(found[3:5] - truth.wrench[3:5]) < 0.04 * np.linalg.norm(truth.wrench[3:5])


@pytest.mark.parametrize('face', ['sphere', 'roller', 'disc'])
def test_the_area_of_a_face_that_saturates_taxels(face):
    """Pressed to 45 % of the pad, a curved face saturates a third of its taxels and a flat one most."""
    specimen, ink = DEVICE_B[0], replace(DEVICE_B[1], uneven=0.0)
    depth = ((0.0, -1e-4), (0.4, -1e-4), (0.7, 9e-4), (0.9, 9e-4))
    scene = TaxelScene(TaxelScript(face, tuple(Key(t, 6e-4, -3e-4, 0.2, down) for t, down in depth)), 40.0, 5, specimen, ink)
    pad = SoftPad(specimen.thickness, specimen.press * specimen.thickness, specimen.pull * specimen.thickness, specimen.grip)
    estimator = TaxelEstimator(ARRAY, pad, TaxelSettings(response=Response((420.0, 0.0, 0.0), known=True)))
    for k in range(scene.frames):
        values, truth = scene.render(k / scene.rate)
        found = estimator.process(values, 1 + k / scene.rate)
    assert (values == 255).sum() > 50 and found.contacts[0].flags & SATURATED
    assert found.region.area == pytest.approx(truth.area, rel=0.1)


def played(name, rate, noise=1, seed=7, settings=KNOWN, ink=None):
    """Frames of a scene with contact: table of true and estimated states of slip; confidence and correctness of each frame."""
    specimen = PadSpecimen()
    ink = ink or InkSpecimen(uneven=0.0, loop=0.0, memory=0.0, noise=0.6 * noise)
    scene = TaxelScene(TAXEL_SCENES[name], rate, seed, specimen, ink)
    pad = SoftPad(specimen.thickness, specimen.press * specimen.thickness, specimen.pull * specimen.thickness, specimen.grip)
    estimator, confusion, stated = TaxelEstimator(ARRAY, pad, settings), np.zeros((3, 3), int), []
    for k in range(scene.frames):
        values, truth = scene.render(k / rate)
        found = estimator.process(values, 1 + k / rate).slip
        if truth.area > 0:
            confusion[truth.slip_state, found.state] += 1
            stated.append((found.confidence, truth.slip_state == found.state))
    return confusion, *np.array(stated).T


@pytest.mark.full
@pytest.mark.parametrize('rate, noise', [(50.0, 3), (200.0, 1)])
def test_slip_and_its_confidence_at_other_rates_and_under_noise(rate, noise):
    confusion, confidence, right = played('drag', rate, noise)
    assert macro_f1(confusion) > 0.8
    doubtful = confidence < 0.97
    assert right[~doubtful].mean() > 0.95 and doubtful.sum() >= 10
    assert right[doubtful].mean() == pytest.approx(confidence[doubtful].mean(), abs=0.2)


@pytest.mark.full
def test_the_confidence_of_slip_without_calibrated_pressure_matches_its_accuracy():
    scenes = [played(name, 50.0, seed=11, settings=TaxelSettings(), ink=InkSpecimen())
              for name in ('slide', 'rock', 'grip', 'smooth', 'cycle')]
    confusion = sum(scene[0] for scene in scenes)
    confidence, right = (np.concatenate(parts) for parts in list(zip(*scenes))[1:])
    sure, doubtful = confidence > 0.9, confidence <= 0.9
    assert right[sure].mean() > 0.95 and sure.sum() <= confusion[:, NONE].sum(), 'only no slip is sure'
    assert right[doubtful].mean() == pytest.approx(confidence[doubtful].mean(), abs=0.2) and doubtful.sum() > 100


def test_a_roller_that_rolls_does_not_slip_and_a_smooth_bar_does():
    confusion, _, right = played('roll', 50.0)
    assert confusion[NONE, NONE] > 150 and right.all()
    assert macro_f1(played('smooth', 50.0)[0][[[NONE], [GROSS]], [NONE, GROSS]]) > 0.9


def square(error, covariance):
    """Of an error (3,) along the surface, over its covariance (6, 6), per degree of freedom."""
    return error[:2] @ np.linalg.solve(covariance[:2, :2], error[:2]) / 2


def test_the_covariances_hold_for_lower_friction_than_that_of_the_pad():
    scene, pad = TaxelScene(TAXEL_SCENES['smooth'], 50.0, 3, ink=InkSpecimen(uneven=0.0, loop=0.0, memory=0.0)), PadSpecimen()
    estimator = TaxelEstimator(ARRAY, SoftPad(pad.thickness, pad.press * pad.thickness, pad.pull * pad.thickness, pad.grip), KNOWN)
    squares, motions, velocities = [], [], []
    for k in range(scene.frames):
        values, truth = scene.render(k / scene.rate)
        found = estimator.process(values, 1 + k / scene.rate)
        contacts = found.contacts
        if np.isfinite(truth.motion[0]) and np.isfinite(found.region.motion_interval):
            motions.append(square(found.region.motion_translation - truth.motion[:3], found.region.motion_covariance))
        if truth.slip_state == GROSS and found.slip.state != NONE:
            velocities.append(square(found.slip.linear - truth.motion[:3] * scene.rate, found.slip.velocity_covariance))
        if truth.slip_state == GROSS and len(contacts) == 1:
            off, covariance = contacts[0].position[:2] - truth.centroid[:2], contacts[0].position_covariance[:2, :2]
            squares.append(off @ np.linalg.solve(covariance, off) / 2)
    assert len(squares) > 30 and 0.1 < np.mean(squares) < 3
    assert len(motions) > 100 and 0.03 < np.mean(motions) < 2
    assert len(velocities) > 30 and 0.2 < np.median(velocities) < 2


def test_a_copy_is_independent_and_gives_the_same_results():
    images = [whole(picture(bar(0.05 * k))) for k in range(30)]
    estimator = TaxelEstimator(ARRAY, SoftPad(), KNOWN)
    run(images[:15], estimator=estimator)
    other = copy.deepcopy(estimator)
    found, again = ([one.process(image, 2 + 0.01 * k) for k, image in enumerate(images[15:])] for one in (estimator, other))
    for one, two in zip(found, again):
        np.testing.assert_array_equal(one.wrench, two.wrench)
        np.testing.assert_array_equal(one.slip.linear, two.slip.linear)


VALUES = defaults(TAXEL_PARAMETERS)


@pytest.mark.parametrize('wrong', [{'object.gravity': [0.0, 0.0, 0.0]}, {'object.gravity': [1.0]}, {'object.centre_of_mass': [0.0]}])
def test_a_wrong_object_is_refused(wrong):
    with pytest.raises(BadArgument, match='three numbers'):
        grasped_object(VALUES | wrong)


def test_dead_taxels_reach_the_estimator():
    with pytest.raises(BadArgument, match='dead'):
        taxel_estimator(VALUES | {'dead_taxels': [44 * 44]})


@pytest.mark.parametrize('noise', [0.2, 2.0, 50.0])
def test_the_first_frames_of_an_untouched_array_show_no_contact_at_any_noise(noise):
    estimator, rng = taxel_estimator(VALUES | {'bits': 16}), np.random.default_rng(4)
    frames = 3000 + rng.normal(0, noise, (5, 44, 44))
    assert [estimator.process(frame.astype(np.uint16), 0.01 * k).contacts for k, frame in enumerate(frames)] == [[]] * 5


def test_a_sensor_that_is_touched_at_the_start():
    image = np.zeros((44, 44), np.uint8)
    image[10:30, 10:30] = 90
    found = [len(taxel_estimator(VALUES | {'reference.start': start}).process(image, 1.0).contacts) for start in ('first', 'zero')]
    assert found == [0, 1]


def seen(paper, image, stamp_s):
    return paper.observe(image, 0.5, np.zeros(image.shape, bool), stamp_s)


def test_every_nonzero_taxel_is_in_contact():
    regions = seen(PaperMethod(ARRAY), picture(bar()), 1.0).regions
    assert moments(*regions.all).area > 1.3 * 160e-6
    assert moments(*regions.all).centroid[:2] == pytest.approx([0, 0], abs=0.1e-3)


def test_edges_follow_a_contact_and_its_hole():
    x, y = np.meshgrid(ARRAY.x, ARRAY.y)
    far = np.hypot(x, y)
    image = cv2.GaussianBlur(((far < 14e-3) & (far > 7e-3)).astype(np.float32), (0, 0), 0.8)
    outlines, holes = edge_loops(image, ARRAY)
    for loops, radius in ((outlines, 14e-3), (holes, 7e-3)):
        assert len(loops) == 1
        assert np.hypot(*loops[0][:, :2].T) == pytest.approx(radius, abs=1e-3)


def test_a_contact_at_the_rim_of_the_array_has_a_closed_outline():
    image = np.zeros((44, 44), np.float32)
    image[:, 22:] = 50
    (outline,), holes = edge_loops(image, ARRAY)
    assert not holes and np.ptp(outline[:, 1]) > 42e-3 and np.ptp(outline[:, 0]) == pytest.approx(22e-3, abs=1.5e-3)


def test_an_image_without_load_has_no_edges():
    assert edge_loops(np.zeros((44, 44), np.float32), ARRAY) == ([], [])


def test_flow_of_features_is_slip():
    paper = PaperMethod(ARRAY)
    for k, x in enumerate((0, 0, 0.4)):
        image = picture(bar(x))
        slip = seen(paper, image, 0.1 * k).slip
        assert slip.state == (NONE, NONE, GROSS)[k]
    assert slip.linear[0] == pytest.approx(4e-3, rel=0.3)


def test_empty_and_constant_images_have_no_features():
    paper = PaperMethod(ARRAY)
    for k, image in enumerate([np.zeros((44, 44), np.float32), np.full((44, 44), 9, np.float32)] * 2):
        assert seen(paper, image, float(k)).slip.state == NONE


def test_centroid_and_angle_follow_from_the_values():
    array = TaxelArray(20, 30, 0.001, 255.0)
    image = np.zeros((20, 30))
    for k in range(8):
        image[4 + k, 6 + 2 * k:8 + 2 * k] = 10.0
    position, angle = image_moments(image, array)
    assert np.degrees(angle) == pytest.approx(26.6, abs=1.0)
    assert position == pytest.approx([13.5e-3 - 14.5e-3, 7.5e-3 - 9.5e-3], abs=1e-9)
    assert image_moments(100 * image, array)[0] == pytest.approx(position)
    assert np.isnan(image_moments(np.zeros((20, 30)), array)[1])
