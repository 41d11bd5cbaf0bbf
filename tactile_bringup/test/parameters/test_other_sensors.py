# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter files of sensors that others make, on recordings of such sensors: driver's source and perception's stages, no process."""
import os
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.parameters.camera import CAMERA_PARAMETERS  # noqa: E402
from tactile_driver.parameters.taxel import TAXEL_DRIVER_PARAMETERS  # noqa: E402
from tactile_driver.sources.base.protocol import EndOfSource  # noqa: E402
from tactile_driver.sources.camera.registry import make_source  # noqa: E402
from tactile_driver.sources.taxel.registry import make_taxel_source  # noqa: E402
from tactile_perception.dots.stage import DotStage  # noqa: E402
from tactile_perception.taxel.stage import TaxelStage  # noqa: E402
from tactile_perception.parameters.file import read_parameters  # noqa: E402
from tactile_perception.parameters.taxel import TAXEL_PARAMETERS  # noqa: E402
from tactile_perception.parameters.touchpad import DOT_PARAMETERS  # noqa: E402

FOLDER = Path(__file__).resolve().parents[2] / 'params'
RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', ''))
GEL, PINS = RECORDINGS / 'gelsight_mini' / 'mini_example.avi', RECORDINGS / 'pin_array_127'
GRASP = RECORDINGS / 'dsa_slip' / 'slip_hockey_ball.npz'
pytestmark = pytest.mark.skipif(not GEL.is_file(), reason='TACTILE_RECORDINGS holds no gelsight_mini')


def images(source, most):
    """Messages of the first frames of a source."""
    source.open()
    try:
        for _ in range(most):
            frame = source.read()
            yield image_to_message(frame, '', header_of(frame.stamp_ns, 'pad'))
    except EndOfSource:
        pass
    finally:
        source.close()


def dots_of(name, path, most, **changes):
    """Dots of each image, as camera_node and dot_tracker_node make them of a file with these parameters."""
    file = FOLDER / f'{name}.yaml'
    source = make_source(read_parameters(file, 'camera_node', CAMERA_PARAMETERS) | {'source': 'file', 'path': str(path)}, time.time_ns)
    stage = DotStage(read_parameters(file, 'dot_tracker_node', DOT_PARAMETERS) | changes)
    return [stage.process(image)['dots'][0] for image in images(source, most)]


def counts(dots):
    return np.array([len(message.id) for message in dots])


def test_a_gel_with_a_grid_of_dark_markers():
    dots = dots_of('marker_gel', GEL, 219)
    assert len(dots) == 219 and np.median(counts(dots)) >= 67 and counts(dots).max() <= 70, '7 x 10 markers are in view in full'
    assert np.nanmedian(np.hypot(dots[-1].du, dots[-1].dv)) < 0.7, 'px; the finger has gone'


def test_a_dome_of_127_pins():
    dots = dots_of('pin_dome', PINS, 125)
    assert len(dots) == 125 and counts(dots).min() >= 126 and np.mean(counts(dots) == 127) > 0.95


@pytest.mark.full
@pytest.mark.parametrize(('path', 'polarity', 'true', 'allowed'), [(PINS, 'bright', 127, 4), (GEL, 'dark', 70, 3)])
def test_markers_in_any_arrangement(path, polarity, true, allowed):
    dots = dots_of('worn_markers', path, 40, polarity=polarity)
    assert len(dots) == 40 and abs(np.median(counts(dots)) - true) <= allowed


@pytest.mark.parametrize('pad', ['pad0', 'pad4'])
def test_a_pressure_array_in_a_grasp(pad):
    file, most = FOLDER / 'pressure_array_14x6.yaml', 360
    own = {'source': 'file', 'path': str(GRASP), 'topic': pad}
    source = make_taxel_source(read_parameters(file, 'taxel_array_node', TAXEL_DRIVER_PARAMETERS) | own, time.time_ns)
    stage = TaxelStage(read_parameters(file, 'taxel_contact_node', TAXEL_PARAMETERS))
    results = [stage.process(image) for image in images(source, most)]
    told = np.array([len(result['contacts'][0].contacts) > 0 for result in results])
    pressed = np.load(GRASP)[pad][:most].any(axis=(1, 2))  # untouched cells of this array give 0
    assert pressed.sum() > 60 and not (told & ~pressed).any() and (told & pressed).sum() >= 0.95 * pressed.sum()
    assert all(result['contact_region'][0].area > 0 for result, one in zip(results, told) if one)
