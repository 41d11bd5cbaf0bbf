# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.response import read_taxels, write_taxels
from tactile_perception.errors import BadCalibration
from tactile_perception.taxel.pressure import TaxelArray
from tactile_perception.taxel.response import Loop
from tactile_perception.taxel.response import Response

ARRAY = TaxelArray(3, 4, 1e-3)
RESPONSE = Response((400.0, 0.3, 150.0), 12.5, np.linspace(0.9, 1.1, 12).reshape(3, 4), True, np.arange(12.0).reshape(3, 4),
                    Loop(0.25, 1750.0, 0.04, 0.4, (0.02, 0.01), (0.1, 1.6)))


@pytest.fixture
def path(tmp_path):
    write_taxels(tmp_path / 'c.yaml', RESPONSE, {'held_out_force_mean': 0.03}, {'force': [1.0, 9.0]}, [])
    return tmp_path / 'c.yaml'


def test_what_is_written_is_read(path):
    found = read_taxels(path, ARRAY)
    assert found.scale == pytest.approx(RESPONSE.scale) and found.knee == 12.5 and found.known
    assert found.loop == RESPONSE.loop
    assert found.gain == pytest.approx(RESPONSE.gain, rel=1e-6) and found.zero == pytest.approx(RESPONSE.zero)


def test_another_array_and_broken_numbers_are_refused(path):
    with pytest.raises(BadCalibration, match='3 x 4'):
        read_taxels(path, TaxelArray(4, 4, 1e-3))
    for old, new in (('400.0', '.nan'), ('150.0', '-150.0'), ('knee: 12.5', 'knee: 0.0'), ('share: 0.25', 'share: 2.0'),
                     ('share: 0.25', 'part: 0.25')):
        broken = path.with_name('broken.yaml')
        broken.write_text(path.read_text().replace(old, new, 1))
        with pytest.raises(BadCalibration):
            read_taxels(broken, ARRAY)
