# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration files that are missing, truncated or of another sensor: the node exits with one line and its own exit code."""
import pytest
from fault_rig import PATIENCE, made, planned

from tactile_bringup import share
from tactile_driver.errors import TactileError as DriverError
from tactile_driver.nodes.runtime.run import EXIT_FAILURE
from tactile_perception.core.errors import TactileError

READERS = {'areal_single': 'press_contact_node', 'areal_dual': 'press_contact_node', 'air_cushion': 'press_contact_node',
           'psd_finger': 'psd_contact_node', 'taxel_array': 'taxel_contact_node'}
OTHERS = {'psd_finger': 'taxel_array'}
FAULTS = {'missing': 'nowhere.yaml', 'cut off': 'cut.yaml', 'of another sensor': 'other.yaml', 'no file of ours': 'strange.yaml'}


@pytest.fixture
def files(tmp_path):
    """files(sensor type): the folder with a bad file for each fault but the missing one."""
    def write(sensor_type):
        good = open(share('calibration', f'{sensor_type}_sim.yaml')).read()
        (tmp_path / 'cut.yaml').write_text(good[:2 * len(good) // 3])
        (tmp_path / 'other.yaml').write_text(open(share('calibration', f'{OTHERS.get(sensor_type, "psd_finger")}_sim.yaml')).read())
        (tmp_path / 'strange.yaml').write_text('!!python/object/apply:os.mkdir [executed]\n')
        return tmp_path
    return write


@pytest.mark.parametrize('fault', FAULTS)
@pytest.mark.parametrize(('sensor_type', 'executable'), READERS.items())
def test_a_bad_calibration_file_is_named(bench, files, monkeypatch, sensor_type, executable, fault):
    folder = files(sensor_type)
    monkeypatch.chdir(folder)
    plan = planned(sensor_type, bench.fresh('file'))
    with pytest.raises((TactileError, DriverError), match=FAULTS[fault]) as caught:
        made(plan, executable, calibration=str(folder / FAULTS[fault]))
    assert len(str(caught.value)) < 600
    assert not (folder / 'executed').exists(), 'what a file says is never executed'


@pytest.mark.parametrize('fault', FAULTS)
def test_a_node_with_a_bad_calibration_file_ends_with_one_line_and_its_own_code(bench, files, fault):
    path = files('psd_finger') / FAULTS[fault]
    process = bench.start('tactile_perception', 'psd_contact_node', bench.fresh('file'), calibration=path)
    assert process.wait(PATIENCE) == EXIT_FAILURE
    lines = [line for line in process.log.strip().splitlines() if 'RTPS_' not in line]  # by the middleware, about killed processes
    assert len(lines) == 1 and FAULTS[fault] in lines[0], process.log
    bench.rows.append((f'calibration file {fault}', f'{lines[0].split("]: ")[-1]} (exit code {EXIT_FAILURE})', float('nan')))
