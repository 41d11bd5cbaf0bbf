# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect.auto import AutoDetector
from tactile_perception.errors import BadFrame

UV = np.stack(np.divmod(np.arange(24), 4), 1) * 46.0 + 40.3


def picture(draw_dots, diameter, bare):
    discs = draw_dots(UV, np.full(24, diameter), (220, 320), 0.9, 0.0, 1.0)
    field = cv2.GaussianBlur(np.random.default_rng(0).normal(size=discs.shape), (0, 0), 1.5)
    return np.clip(30 + 120 * discs * (field < np.quantile(field, 1 - bare)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('diameter, bare, chosen', [(5.0, 0.0, 'LikelihoodDetector'), (12.0, 0.0, 'LikelihoodDetector'),
                                                    (22.0, 0.45, 'DiscDetector')])
def test_the_image_decides(draw_dots, diameter, bare, chosen):
    detector = AutoDetector(1)
    assert detector.chosen == ''
    assert len(detector.detect(picture(draw_dots, diameter, bare))) == 24 and detector.chosen == chosen


def test_it_decides_anew_when_dots_come_in_pieces(draw_dots):
    detector = AutoDetector(1)
    detector.detect(picture(draw_dots, 12.0, 0.0))
    assert detector.chosen == 'LikelihoodDetector'
    assert len(detector.detect(picture(draw_dots, 24.0, 0.5))) == 24 and detector.chosen == 'DiscDetector'


def test_a_frame_in_which_no_method_sees_dots_is_refused():
    with pytest.raises(BadFrame, match='no method'):
        AutoDetector(1).detect(np.full((120, 160), 100, np.uint8))
