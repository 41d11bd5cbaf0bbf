# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.psd.scene import PSD_SCENES, open_psd_scene

RATE = 1000.0


@pytest.mark.parametrize('name', sorted(PSD_SCENES))
def test_every_scene_plays_with_its_truth(name):
    scene = open_psd_scene(name, 200.0, 1)
    counts, truth = scene.play(0, scene.samples)
    assert counts.shape == (scene.samples, 4) and counts.dtype == np.uint16
    touching = truth.touching > 0
    assert np.isfinite(truth.normal[touching]).all() and np.isnan(truth.normal[~touching]).all()
    assert np.linalg.norm(truth.normal[touching], axis=1) == pytest.approx(1.0)
    assert touching.any() == (name not in ('rest', 'light'))


def test_taps_last_what_the_paper_has():
    scene = open_psd_scene('taps', RATE)
    touching = scene.play(0, scene.samples)[1].touching > 0
    edges = np.flatnonzero(np.diff(touching.astype(int)))
    assert len(edges) == 32
    assert np.median(edges[1::2] - edges[::2]) / RATE == pytest.approx(0.06, abs=0.02)
    assert np.median(np.diff(edges[::2])) / RATE == pytest.approx(1 / 3.2, abs=2e-3)


def test_it_goes_on_from_where_it_was_and_begins_again():
    scene = open_psd_scene('demo', RATE)
    truth = scene.play(0, scene.samples)[1]
    assert np.array_equal(scene.play(scene.samples + 500, 1200)[1].touching, truth.touching[500:1700])
    k = int(np.flatnonzero(truth.touching)[5])
    touch, = truth.touches(k)
    assert np.linalg.norm(touch.position) == pytest.approx(0.016) and touch.force > 0
    assert truth.touches(0) == []


def test_wrong_words():
    with pytest.raises(BadArgument, match='calibration, demo'):
        open_psd_scene('nowhere', RATE)
    with pytest.raises(BadArgument, match='rate'):
        open_psd_scene('demo', 0.0)
