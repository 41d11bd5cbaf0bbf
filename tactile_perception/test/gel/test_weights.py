# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate of a gel: newtons by known weights, from recordings of the simulated gel."""
import numpy as np
import pytest
import yaml

from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.parameters.table import defaults
from tactile_driver.recordings.writer import write_messages
from tactile_driver.simulation.sensors import gel
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.common.messages import wrench_to_message
from tactile_perception.core.errors import BadCalibration
from tactile_perception.gel.parameters import GEL_PARAMETERS
from tactile_perception.gel.stage import GelStage
from tactile_perception.gel.tools import calibrate_weights
from tactile_perception.tools.calibrate import main

RATE = 5.0
VALUES = {'rows': gel.GEL.rows, 'columns': gel.GEL.columns, 'gel.thickness': gel.MATERIAL.thickness,
          'gel.dot_depth': gel.MATERIAL.depth, 'gel.poisson_ratio': gel.MATERIAL.poisson, 'gel.pitch': gel.GEL.pitch}


@pytest.fixture(scope='module')
def session(tmp_path_factory):
    """A parameter file without a modulus, and a recording of a ball that is pressed on, with its force."""
    folder = tmp_path_factory.mktemp('gel')
    params, bag = folder / 'gel.yaml', folder / 'press'
    params.write_text(yaml.safe_dump({'/**': {'ros__parameters': {'sensor_type': 'gel'} | VALUES | {'reference.frames': 3}}}))
    scene = open_scene('gel_demo', RATE, seed=4)
    camera = scene.camera
    info = calibration_to_message(pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height)))

    def messages():
        yield 10**9, 'camera_info', info
        for number in range(scene.frames):
            seen, stamp = scene.render(number / RATE), round((1 + number / RATE) * 1e9)
            header = header_of(stamp, 'gel')
            yield stamp, 'image_raw', image_to_message(Frame(seen.image, stamp, 'bgr8'), '', header)
            yield stamp, 'ground_truth/wrench', wrench_to_message(seen.truth.wrench, header)
    write_messages(bag, '/gel', messages())
    return params, bag


@pytest.mark.full
def test_known_weights_give_the_modulus_and_its_error(session, tmp_path):
    params, bag = session
    output = tmp_path / 'my_gel.yaml'
    report = calibrate_weights([bag], params, output)
    fitted = yaml.safe_load(output.read_text())['fitted']
    off = np.log(fitted['young_modulus'] / gel.MATERIAL.young)
    assert abs(off) < 0.1 and abs(off) < 3 * fitted['force_sigma'] < 0.6
    assert f'{fitted["young_modulus"]:.4g} Pa' in report
    stage = GelStage({**defaults(GEL_PARAMETERS), **VALUES, 'calibration': str(output)})
    assert stage.health()[0] == '', 'forces are known now'
    with pytest.raises(BadCalibration, match='above 0'):
        calibrate_weights([bag], params, output, weight=-1.0)


@pytest.mark.full
def test_the_command_takes_one_weight(session, tmp_path, capsys):
    params, bag = session
    output = tmp_path / 'my_gel.yaml'
    assert main([str(bag), '--params', str(params), '--output', str(output), '--weight', '1.5']) == 0
    assert '1 loads' in capsys.readouterr().out and yaml.safe_load(output.read_text())['calibrated_range']['force'] == [1.5, 1.5]
    assert main([str(bag), '--params', str(params), '--output', str(output), '--sphere-radius', '0.01']) == 1


def test_a_missing_calibration_is_refused(tmp_path):
    with pytest.raises(BadCalibration, match='no such file'):
        GelStage({**defaults(GEL_PARAMETERS), **VALUES, 'calibration': str(tmp_path / 'none.yaml')})
