# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots in images: small ones fitted by likelihood, what they look like, and large markers."""
import os
import warnings
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_driver.parameters.table import defaults
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.dots.appearance import measure_appearance
from tactile_perception.dots.detect import METHODS, DotDetector
from tactile_perception.dots.fit import DiscModel
from tactile_perception.dots.parameters import DOT_PARAMETERS
from tactile_perception.dots.tracker import DotOptions, DotTracker, Mask, make_tracker

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', ''))


@pytest.fixture(autouse=True)
def no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        yield


def noisy(image, noise, seed=0):
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, 1, image.shape) * noise), 0, 255).astype(np.uint8)


def nearest(dots, uv):
    """Index of the dot nearest to each position, and its distance."""
    distance = np.hypot(*(uv[:, None] - dots.uv).transpose(2, 0, 1))
    return distance.argmin(1), distance.min(1)


@pytest.mark.parametrize('polarity, ground, contrast', [('dark', 185.0, -130.0), ('bright', 40.0, 130.0)])
def test_places_areas_and_sigma(draw_dots, lattice, polarity, ground, contrast):
    uv, diameter = lattice
    clean = draw_dots(uv, diameter, ground=ground, contrast=contrast)
    detector, normal, ratio = DotDetector(polarity), [], []
    for seed in range(8):
        dots = detector.detect(noisy(clean, 4.0, seed))
        assert len(dots) == len(uv)
        k, _ = nearest(dots, uv)
        normal.append((dots.uv[k] - uv) / dots.sigma[k, None])
        ratio.append(dots.area[k] / (np.pi / 4 * diameter**2))
    assert 0.8 < np.mean(np.square(normal)) < 1.25
    assert np.median(dots.sigma) < 0.03
    assert np.mean(ratio) == pytest.approx(1, abs=0.02)


def test_noise_that_grows_with_light_shows_in_each_sigma(draw_dots, lattice):
    uv, diameter = lattice
    clean = draw_dots(uv, diameter)
    growing = np.where(np.arange(160) < 80, 1.0, 6.0)
    detector, normal = DotDetector('dark'), []
    for seed in range(12):
        dots = detector.detect(noisy(clean, growing, seed))
        k, _ = nearest(dots, uv)
        normal.append((dots.uv[k] - uv) / dots.sigma[k, None])
    squares = np.square(normal).mean((0, 2))
    quiet, loud = uv[:, 0] < 70, uv[:, 0] > 90
    assert 0.7 < squares[quiet].mean() < 1.35
    assert 0.7 < squares[loud].mean() < 1.35


def test_dots_cut_by_the_border_are_left_out(draw_dots, lattice):
    uv, diameter = lattice
    shifted = uv - [uv[0, 0], 0]  # the first column's centres lie on the border
    dots = DotDetector('dark').detect(noisy(draw_dots(shifted, diameter), 2.0))
    _, distance = nearest(dots, shifted[shifted[:, 0] > 6])
    assert distance.max() < 0.1
    assert dots.uv[:, 0].min() > 3


def test_dots_under_glare_are_left_out_rather_than_misplaced(draw_dots, lattice):
    uv, diameter = lattice
    image = draw_dots(uv, diameter)
    y, x = np.mgrid[:120, :160]
    image += 400 * np.exp(-((x - uv[19, 0] - 2) ** 2 + (y - uv[19, 1]) ** 2) / 3.5**2)
    dots = DotDetector('dark').detect(noisy(image, 2.0))
    k, distance = nearest(dots, uv)
    far = np.arange(len(uv)) != 19
    assert distance[far].max() < 0.1
    assert distance[19] > 3


def test_sloping_light_moves_no_dot(draw_dots, lattice):
    uv, diameter = lattice
    dots = DotDetector('dark').detect(noisy(draw_dots(uv, diameter) * np.linspace(0.6, 1.4, 160), 0.5))
    assert len(dots) == len(uv)
    assert abs((dots.uv[nearest(dots, uv)[0]] - uv)[:, 0].mean()) < 0.01  # without the correction 0.07


def test_a_new_look_is_measured_when_dots_are_lost(draw_dots, lattice):
    detector = DotDetector('dark')
    uv, diameter = lattice
    assert len(detector.detect(noisy(draw_dots(uv, diameter), 2.0))) == 48
    larger = detector.detect(noisy(draw_dots(uv * 2, diameter * 2.5, shape=(240, 320)), 2.0))
    assert len(larger) == 48 and nearest(larger, uv * 2)[1].max() < 0.2, 'in px of the whole image, though it was reduced'


@pytest.mark.parametrize('frame, said', [
    (np.zeros((120, 160), np.uint8), 'black'),
    (np.full((120, 160), 255, np.uint8), 'white'),
    (np.full((120, 160, 3), 100, np.uint8), 'constant'),
    (np.random.default_rng(0).normal(120, 6, (240, 320)).astype(np.uint8), 'no pattern of dark dots'),
    (np.zeros((120, 160), np.uint16), 'uint16'),
    (np.zeros((120, 160), float), 'float64'),
    (None, 'NoneType'),
    (np.zeros((120, 160, 4), np.uint8), '160, 4'),
    (np.zeros((0, 0), np.uint8), 'too small'),
])
@pytest.mark.parametrize('seen_before', [False, True])
def test_bad_frames_are_named_and_the_next_good_one_works(draw_dots, lattice, frame, said, seen_before):
    detector = DotDetector('dark')
    good = noisy(draw_dots(*lattice), 2.0)
    if seen_before:
        detector.detect(good)
    with pytest.raises(BadFrame, match=said):
        detector.detect(frame)
    assert len(detector.detect(good)) == 48


def test_unknown_names_list_the_known_ones():
    with pytest.raises(BadArgument, match=', '.join(METHODS)):
        DotDetector('dark', 'guess')
    with pytest.raises(BadArgument, match='dark, bright'):
        DotDetector('grey')
    with pytest.raises(BadArgument, match='detection to auto'):
        DotDetector('any', 'blobs')


@pytest.mark.skipif(not (RECORDINGS / 'simulated/tp_rect_drag').is_dir(), reason='TACTILE_RECORDINGS holds no simulated/tp_rect_drag')
def test_oval_dots_of_a_pressed_pad():
    folder = RECORDINGS / 'simulated/tp_rect_drag'
    truth, detector = np.load(folder / 'truth.npz'), DotDetector('dark')
    error, ratio, normal, missed = [], [], [], []
    for k, path in enumerate(sorted((folder / 'frames').iterdir())[::6]):
        dots = detector.detect(cv2.imread(str(path)))
        k = 6 * k
        seen = truth['visible'][k]
        index, distance = nearest(dots, truth['uv'][k][seen])
        found = distance < 0.3
        missed.append(seen.sum() - found.sum())
        assert len(dots) == found.sum()
        index = index[found]
        error.append(dots.uv[index] - truth['uv'][k][seen][found])
        ratio.append(dots.area[index] / truth['area_px'][k][seen][found])
        normal.append(error[-1] / dots.sigma[index, None])
    assert sum(missed) <= 0.004 * 6 * 529  # 3 to 11, as other dots are taken to measure the appearance
    assert np.sqrt(np.square(np.concatenate(error)).sum(1).mean()) < 0.015
    assert np.mean(np.concatenate(ratio)) == pytest.approx(1, abs=0.01)
    assert 0.5 < np.mean(np.square(np.concatenate(normal))) < 1.5


@pytest.mark.parametrize('seed', [0, 4, 55, 59])
@pytest.mark.parametrize('method', ['likelihood', 'blobs', 'auto'])
def test_lamps_and_their_reflections_give_dots_or_a_bad_frame(method, seed):
    """Patches as bright as their ground have no centroid, and a disc larger than its window no contrast."""
    rng = np.random.default_rng(seed)
    image = np.full((240, 320), rng.integers(10, 120), np.uint8)
    for _ in range(rng.integers(4, 30)):
        u, v, size = int(rng.integers(5, 310)), int(rng.integers(5, 230)), int(rng.integers(2, 40))
        if rng.uniform() < 0.5:
            cv2.circle(image, (u, v), size, 255, -1)
        else:
            cv2.rectangle(image, (u, v), (u + size, v + size), 255, -1)
    for polarity in ('bright', 'dark'):
        try:
            dots = DotDetector(polarity, method).detect(image)
        except BadFrame:
            continue
        assert np.isfinite(dots.uv).all() and (dots.area > 0).all()


@pytest.mark.parametrize('blur', [0.6, 0.9, 1.4])
def test_blur_size_and_contrast_are_measured(draw_dots, lattice, blur):
    uv, diameter = lattice
    look = measure_appearance(noisy(draw_dots(uv, diameter, blur=blur), 2.0), -1)
    assert look.blur == pytest.approx(blur, abs=0.1)
    assert look.typical == pytest.approx(np.median(diameter), rel=0.06)
    assert look.contrast == pytest.approx(-120, rel=0.05)
    assert look.ground == pytest.approx(180, rel=0.03)
    assert look.noise == pytest.approx(2.0, rel=0.3)
    assert look.smallest < diameter.min() and look.largest > diameter.max()


@pytest.mark.parametrize('sign', [1, -1])
def test_noise_alone_has_no_dots(sign):
    with pytest.raises(BadFrame, match='polarity'):
        measure_appearance(noisy(np.full((240, 320), 120.0), 5.0), sign)


@pytest.mark.parametrize('smallest, largest, blur', [(0.8, 1.2, 0.3), (1.5, 2.0, 0.5), (3.0, 5.0, 0.8), (9.0, 14.0, 1.5)])
def test_tables_of_dots_of_any_size_have_all_directions_of_the_basis(smallest, largest, blur):
    model, other = DiscModel(smallest, largest, blur), DiscModel(8.0, 10.0, 1.0)
    assert model.basis.shape[1] == other.basis.shape[1]
    assert model.estimators.shape[-2:] == (5, model.basis.shape[1]) and np.isfinite(model.estimators).all()


SHAPE = (200, 260)


@pytest.fixture
def markers():
    """(30, 2) positions off the pixel grid at a pitch of 40 px, and (30,) diameters of 18 to 22 px."""
    rng = np.random.default_rng(3)
    row, column = np.divmod(np.arange(30), 6)
    return np.stack([29 + 40.2 * column, 21 + 39.7 * row], 1) + rng.uniform(-0.5, 0.5, (30, 2)), rng.uniform(18, 22, 30)


def errors(dots, uv):
    """(N, 2) px of the dots from the nearest of positions uv, and which of them that is."""
    nearest = np.hypot(*(dots.uv[:, None] - uv).transpose(2, 0, 1)).argmin(1)
    return dots.uv - uv[nearest], nearest


def check(dots, uv, area, limit, share):
    error, nearest = errors(dots, uv)
    assert len(np.unique(nearest)) == len(dots) == len(uv)
    assert np.sqrt((error**2).sum(1).mean()) < limit
    assert np.abs(dots.area / area[nearest] - 1).max() < share
    assert 0.2 < ((error / dots.sigma[:, None])**2).mean() < 1.6


@pytest.mark.parametrize('polarity, ground, contrast', [('bright', 15.0, 180.0), ('dark', 220.0, -180.0)])
def test_places_areas_and_sigma_in_uneven_light(draw_dots, markers, polarity, ground, contrast):
    uv, diameter = markers
    light = np.linspace(1, 1 / 3, SHAPE[1])  # three to one
    image = (ground + contrast * draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)) * light
    check(DotDetector(polarity, 'blobs').detect(noisy(image, 2.0)), uv, np.pi / 4 * diameter**2, 0.05, 0.025)


def test_the_channel_with_the_contrast_is_taken(draw_dots, markers):
    uv, diameter = markers
    inside = draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)
    for channel in range(3):
        image = np.dstack([noisy(15 + (180 if k == channel else 20) * inside, 2.0, k) for k in range(3)])
        dots, alone = DotDetector('bright', 'blobs').detect(image), DotDetector('bright', 'blobs').detect(image[:, :, channel].copy())
        assert np.array_equal(dots.uv, alone.uv)
    grey = np.dstack([noisy(15 + 180 * inside, 12.0, k) for k in range(3)])
    error = [errors(DotDetector('bright', 'blobs').detect(image), uv)[0].std() for image in (grey, grey[:, :, 1].copy())]
    assert error[0] < 0.8 * error[1]  # the channels' noise is their own


def test_cut_hidden_and_false_ones_are_left_out(draw_dots, markers):
    uv, diameter = markers[0] - [29, 0], markers[1]  # the first column lies on the border
    image = 15 + 180 * draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)
    image[int(uv[9, 1]) - 15: int(uv[9, 1]) + 15, int(uv[9, 0]) + 1: int(uv[9, 0]) + 15] = 15  # half hidden
    image[90:112, 58:61] = 255  # a scratch
    image[:, 250:] = 60  # something at the border
    error, nearest = errors(DotDetector('bright', 'blobs').detect(noisy(image, 2.0)), uv)
    assert set(nearest) == set(np.flatnonzero(uv[:, 0] > 20)) - {9}
    assert np.hypot(*error.T).max() < 0.1


def test_glare_on_a_marker_moves_it_little(draw_dots, markers):
    uv, diameter = markers
    y, x = np.mgrid[:SHAPE[0], :SHAPE[1]]
    image = 15 + 150 * draw_dots(uv, diameter, SHAPE, 1.0, 0.0, 1.0)
    image += 150 * np.exp(-((x - uv[14, 0] - 3)**2 + (y - uv[14, 1])**2) / 9)
    error, nearest = errors(DotDetector('bright', 'blobs').detect(noisy(image, 2.0)), uv)
    assert len(error) >= 29
    assert np.hypot(*error.T).max() < 0.4


@pytest.mark.skipif(not (RECORDINGS / 'simulated/as_test').is_dir(), reason='TACTILE_RECORDINGS holds no simulated/as_test')
@pytest.mark.parametrize('name, side, limit, of_area', [('as_test', '', 0.02, 0.005), ('ad_test', '_left', 0.015, 0.005),
                                                       ('ad_test', '_right', 0.015, 0.005), ('ac_test', '', 0.04, 0.012)])
def test_recorded_markers(name, side, limit, of_area):
    truth = np.load(RECORDINGS / 'simulated' / name / 'truth.npz')
    detector, all_errors, normal, ratio, found = DotDetector('bright', 'blobs'), [], [], [], 0
    for k in range(len(truth['timestamps'])):
        seen = truth['visible' + side][k]
        dots = detector.detect(cv2.imread(str(RECORDINGS / 'simulated' / name / f'frames{side}' / f'{k:03d}.webp')))
        error, nearest = errors(dots, truth['uv' + side][k][seen])
        found += len(np.unique(nearest))
        all_errors.append(error)
        normal.append(error / dots.sigma[:, None])
        ratio.append(dots.area / truth['area_px' + side][k][seen][nearest])
    assert found == sum(map(len, all_errors)) >= truth['visible' + side].sum() - 1
    assert np.sqrt((np.vstack(all_errors)**2).sum(1).mean()) < limit
    assert 0.5 < (np.vstack(normal)**2).mean() < 1.5
    assert np.percentile(np.abs(np.concatenate(ratio) - 1), 95) < of_area


SIZE = (240, 320)
ROWS, COLUMNS, PITCH = 5, 6, 30.0
OWN = np.stack(np.meshgrid(60 + PITCH * np.arange(COLUMNS), 60 + PITCH * np.arange(ROWS)), axis=-1).reshape(-1, 2)
POLYGON = '40,40,230,40,230,200,40,200'


def drawn(colour=True):
    """Dots of the sensor on its ground, and beside them brighter ground with dots of the same size and lamps."""
    image = np.full((*SIZE, 3), 220, np.uint8)
    image[40:200, 40:230] = 150
    for u, v in [*OWN, *((x, y) for x in (250, 280, 310) for y in range(15, 240, 30))]:
        cv2.circle(image, (round(16 * u), round(16 * v)), 16 * 5, (40, 40, 40), -1, cv2.LINE_AA, 4)
    cv2.circle(image, (300, 225), 12, (255, 255, 255), -1)
    image = cv2.GaussianBlur(image, (0, 0), 1.0)
    return image if colour else image[..., 1]


@pytest.fixture(params=['polygon', 'picture'])
def mask(request, tmp_path):
    if request.param == 'polygon':
        return POLYGON
    picture = np.zeros(SIZE, np.uint8)
    picture[40:201, 40:231] = 255
    cv2.imwrite(str(tmp_path / 'mask.png'), picture)
    return str(tmp_path / 'mask.png')


@pytest.mark.parametrize('colour', [True, False])
@pytest.mark.parametrize('detection', ['likelihood', 'auto'])
def test_only_dots_of_the_sensor_are_found(mask, detection, colour):
    values = {**defaults(DOT_PARAMETERS), 'rows': 0, 'columns': 0, 'polarity': 'dark', 'detection': detection, 'numbering': 'tracks'}
    found = {text: make_tracker(given).process(drawn(colour), 0.0).uv
             for text, given in (('all', values), ('masked', {**values, 'mask': mask}))}
    assert len(found['all']) > len(OWN) + 10, 'the picture tempts'
    assert len(found['masked']) == len(OWN)
    assert np.linalg.norm(found['masked'][:, None] - OWN, axis=2).min(axis=1).max() < 0.5


def test_a_dot_that_the_mask_cuts_is_none():
    tracker = DotTracker(DotOptions(mask=Mask('40,40,212,40,212,200,40,200')))  # the last column's dots reach from 205 to 215
    assert len(tracker.process(drawn(), 0.0).id) == ROWS * (COLUMNS - 1)


@pytest.mark.parametrize(('text', 'said'), [
    ('nowhere.png', 'neither an image file nor a polygon'), (__file__, 'neither an image file nor a polygon'),
    ('1,2,3,4', 'three corners'), ('1,2,3,4,5,6,7', 'three corners'), ('nan,2,3,4,5,6', 'three corners')])
def test_what_is_no_mask_is_refused(text, said):
    with pytest.raises(BadArgument, match=f'mask.*{said}'):
        Mask(text)


def test_a_mask_that_does_not_fit_the_images_is_named(tmp_path):
    cv2.imwrite(str(tmp_path / 'black.png'), np.zeros(SIZE, np.uint8))
    with pytest.raises(BadArgument, match='no white'):
        Mask(str(tmp_path / 'black.png'))
    cv2.imwrite(str(tmp_path / 'small.png'), np.full((48, 64), 255, np.uint8))
    with pytest.raises(BadFrame, match='small.png is 64 x 48 px, the images are 320 x 240 px'):
        DotTracker(DotOptions(mask=Mask(str(tmp_path / 'small.png')))).process(drawn(), 0.0)
    with pytest.raises(BadFrame, match='outside the images'):
        DotTracker(DotOptions(mask=Mask('500,500,600,500,600,600'))).process(drawn(), 0.0)
