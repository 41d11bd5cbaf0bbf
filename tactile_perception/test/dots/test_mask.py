# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What lies beside the sensor is not seen: dots drawn there, lamps, and dots that the mask's border cuts."""
import cv2
import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_perception.dots.tracker import Mask
from tactile_perception.dots.tracker import DotTracker, make_tracker
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.parameters.touchpad import DOT_PARAMETERS
from tactile_perception.touchpad.sensor import Touchpad

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
    values = {**defaults(DOT_PARAMETERS), 'rows': 0, 'columns': 0, 'surface': 'none', 'detection': detection, 'numbering': 'tracks'}
    found = {text: make_tracker(Touchpad.from_parameters(given), given).process(drawn(colour), 0.0).uv
             for text, given in (('all', values), ('masked', {**values, 'mask': mask}))}
    assert len(found['all']) > len(OWN) + 10, 'the picture tempts'
    assert len(found['masked']) == len(OWN)
    assert np.linalg.norm(found['masked'][:, None] - OWN, axis=2).min(axis=1).max() < 0.5


def test_a_dot_that_the_mask_cuts_is_none():
    tracker = DotTracker(0, 0, mask=Mask('40,40,212,40,212,200,40,200'))  # the last column's dots reach from 205 to 215
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
        DotTracker(0, 0, mask=Mask(str(tmp_path / 'small.png'))).process(drawn(), 0.0)
    with pytest.raises(BadFrame, match='outside the images'):
        DotTracker(0, 0, mask=Mask('500,500,600,500,600,600')).process(drawn(), 0.0)
