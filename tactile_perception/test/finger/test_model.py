# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The model of a finger, as the running finger sees it and as a file."""
import numpy as np
import played
import pytest
import yaml

from tactile_perception.calibration.files.format import write_calibration
from tactile_perception.errors import BadCalibration
from tactile_perception.finger.map import EquidistantMap, LightShift, error_angle, fit_smooth_map, position
from tactile_perception.finger.model import Creep, FingerFit, FingerModel, psd_file, read_psd
from tactile_perception.finger.parameters import PsdFinger

PLACE = np.random.default_rng(0).uniform(-0.7, 0.7, (30, 2))


def test_a_finger_runs_the_model_between_the_nodes_of_its_table_too(model):
    finger, (volts, _) = PsdFinger(model), played.scene('slide')
    samples = finger.detect(volts, played.PERIOD)
    sums = samples.sums[samples.contact]
    exact = model.normals(position(sums), sums[:, 2])
    assert len(sums) > 500 and np.degrees(error_angle(finger.normals(samples)[samples.contact], exact)).max() < 0.1


def test_a_table_that_is_none_is_refused(model):
    class Spoilt:
        load_terms, cross_volts, room, creep = model.load_terms, model.cross_volts, model.room, model.creep
        table = model.table[:, :-1]
    with pytest.raises(ValueError, match='^table: '):
        PsdFinger(Spoilt())


def written(path, **numbers):
    model = FingerModel(EquidistantMap(np.array([0.1, -0.2]), 1.6), **numbers)
    fit = FingerFit(model, 30, np.zeros(1), np.zeros(1), {'places': 30}, {'theta': [0.0, 1.0]}, ['few'], np.array([[0, 0, 1.0]]),
                    np.array(['x at 1.0 s']))
    write_calibration(path, psd_file(fit, ['one']))
    return model


def test_a_full_model_there_and_back(tmp_path):
    smooth, _ = fit_smooth_map(PLACE, 1.6 * PLACE, np.full(30, 1e-3))
    shift = LightShift(np.arange(5.0), 0.01 * np.arange(8.0).reshape(4, 2))
    model = written(tmp_path / 'a.yaml', smooth=smooth, shift=shift, level=np.array([0.3, -0.1, 0.0]), level_limits=(0.1, 0.3, 0.7),
                    force=np.arange(8.0), cross=np.arange(6.0), cross_volts=1e-3, room=np.arange(4.0), creep=Creep(0.05, 0.03))
    found = read_psd(tmp_path / 'a.yaml')
    for light in (None, np.full(30, 3.0)):
        assert found.normals(PLACE, light) == pytest.approx(model.normals(PLACE, light), abs=1e-7)
    assert found.levels(PLACE) == pytest.approx(model.levels(PLACE))
    assert found.room.tolist() == [0, 1, 2, 3] and found.creep == Creep(0.05, 0.03)
    assert found.depth is None and found.cross_volts == 1e-3 and found.force.tolist() == list(range(8))
    assert yaml.safe_load((tmp_path / 'a.yaml').read_text())['left_out'] == ['few', 'one']


def test_the_papers_alone(tmp_path):
    written(tmp_path / 'a.yaml')
    found = read_psd(tmp_path / 'a.yaml')
    assert found.smooth is None and found.level is None and found.room is None and found.creep is None and found.paper.beta == 1.6


@pytest.mark.parametrize('spoil', [lambda f: f.pop('paper'), lambda f: f['smooth'].pop('place'), lambda f: f['smooth'].update(noise=[1.0]),
                                   lambda f: f.update(force=[1.0]), lambda f: f.update(reach='far'), lambda f: f['creep'].update(share=1.0),
                                   lambda f: f['creep'].update(seconds=0.0),
                                   lambda f: f.update(shift={'typical': [1.0] * 5, 'slopes': [[1.0, 2.0]]})])
def test_what_is_missing_or_wrong_is_reported(tmp_path, spoil):
    smooth, _ = fit_smooth_map(PLACE, 1.6 * PLACE, np.full(30, 1e-3))
    written(tmp_path / 'a.yaml', smooth=smooth, creep=Creep(0.05, 0.03))
    page = yaml.safe_load((tmp_path / 'a.yaml').read_text())
    spoil(page['fitted'])
    (tmp_path / 'a.yaml').write_text(yaml.safe_dump(page))
    with pytest.raises(BadCalibration, match='a.yaml'):
        read_psd(tmp_path / 'a.yaml')
