# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_bringup.installed import share  # noqa: E402
from tactile_bringup.simulate.calibrations import calibrate_specimen, main  # noqa: E402
from tactile_bringup.simulate.camera import write_scene  # noqa: E402
from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_perception.press.calibration import read_touch  # noqa: E402
from tactile_perception.tools.process_bag import main as process_bag  # noqa: E402

LARGEST = 1_500_000  # bytes of a file that ships
# sensor: errors (m) of place and depth in the median over the frames of one press
SENSORS = {'areal_single': (0.5e-3, 0.2e-3), 'areal_dual': (0.6e-3, 0.1e-3), 'air_cushion': (3e-3, 3e-3)}


def shipped(sensor):
    return Path(share('calibration', f'{sensor}_sim.yaml'))


def contacts_in(bag, sensor, topic):
    """Contacts of each frame, by stamp."""
    with BagReader(bag) as reader:
        return {raw.stamp_ns: decode(raw.data, raw.type_name).contacts for raw in reader.messages({f'/{sensor}/{topic}'})}


@pytest.mark.parametrize('sensor', SENSORS)
@pytest.mark.full
def test_the_calibration_that_ships_tells_where_a_press_is(sensor, tmp_path):
    write_scene(tmp_path / 'bag', f'{sensor}_press', 5.0, frames=16)
    params = share('params', f'{sensor}_sim.yaml')
    assert process_bag([str(tmp_path / 'bag'), str(tmp_path / 'out'), '--params', params, '--calibration', str(shipped(sensor))]) == 0
    told, true = (contacts_in(tmp_path / 'out', sensor, topic) for topic in ('contacts', 'ground_truth/contacts'))
    assert not [stamp for stamp in told if told[stamp] and not true[stamp]]
    pairs = [(told[stamp], true[stamp]) for stamp in told if true[stamp]]
    assert len(pairs) > 4 and all(len(ours) == 1 for ours, _ in pairs[2:])
    places = np.array([[(c.position.x, c.position.y, c.depth) for c in (ours[0], its[0])] for ours, its in pairs if ours])
    off = np.abs(places[:, 0] - places[:, 1])
    assert np.median(np.hypot(*off[:, :2].T)) < SENSORS[sensor][0] and np.median(off[:, 2]) < SENSORS[sensor][1]


@pytest.mark.parametrize('sensor', SENSORS)
def test_it_is_small_and_holds_the_best_method(sensor):
    found = read_touch(shipped(sensor), sensor)
    assert shipped(sensor).with_suffix('.npz').stat().st_size < LARGEST and len(shipped(sensor).read_text().splitlines()) <= 200
    assert list(found.methods) == [found.best] and np.isfinite(found.stiffness) and len(found.file.residuals) > 2


def numbers_of(value):
    """All numbers in nested dictionaries, lists and arrays."""
    if isinstance(value, dict):
        value = list(value.values())
    return [number for part in value for number in numbers_of(part)] if isinstance(value, list) else list(np.ravel(value).astype(float))


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize('sensor', SENSORS)
def test_it_is_made_again_the_same(sensor, tmp_path):
    calibrate_specimen(sensor, tmp_path / 'again.yaml')
    again, ours = (read_touch(path, sensor) for path in (tmp_path / 'again.yaml', shipped(sensor)))
    assert again.best == ours.best
    np.testing.assert_allclose(*(numbers_of(file.file.fitted) for file in (again, ours)), rtol=1e-3, atol=1e-6)


def test_an_unknown_type_is_one_line(tmp_path, capsys):
    assert main([str(tmp_path), 'touchpad']) == 1
    assert capsys.readouterr().err.count('\n') == 1
