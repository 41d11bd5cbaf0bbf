# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.errors import BadFrame
from tactile_driver.matrix import MatrixOrder, matrix_frame

VALUES = np.arange(6, dtype=np.uint8).reshape(2, 3)


@pytest.mark.parametrize('order, expected', [
    (MatrixOrder(), [[0, 1, 2], [3, 4, 5]]),
    (MatrixOrder(transposed=True), [[0, 3], [1, 4], [2, 5]]),
    (MatrixOrder(flip_rows=True), [[3, 4, 5], [0, 1, 2]]),
    (MatrixOrder(transposed=True, flip_columns=True), [[3, 0], [4, 1], [5, 2]]),
])
def test_orders(order, expected):
    assert order.ordered(VALUES).tolist() == expected


def test_eight_bits_stay_and_more_become_sixteen():
    assert matrix_frame(VALUES, (2, 3), 5, 'it').encoding == 'mono8'
    frame = matrix_frame(VALUES.astype(float) * 1000, (0, 0), 5, 'it')
    assert (frame.encoding, frame.image.dtype, frame.image.max(), frame.stamp_ns) == ('mono16', np.uint16, 5000, 5)


@pytest.mark.parametrize('values', [np.zeros((3, 2), np.uint8), np.zeros(6, np.uint8), np.full((2, 3), 0.5), np.full((2, 3), np.nan),
                                    np.full((2, 3), -1), np.full((2, 3), 70000)])
def test_what_is_no_image_is_refused(values):
    with pytest.raises(BadFrame, match='it is skipped'):
        matrix_frame(values, (2, 3), 0, 'the frame')
