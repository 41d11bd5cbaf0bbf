# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of a grasp: the scene, the images of both sensors, and the curves."""
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')

from tactile_bringup.grasp.video import Film, main  # noqa: E402


def test_a_picture_shows_the_scene_both_sensors_and_the_curves():
    film = Film()
    world = SimpleNamespace(draw=lambda width, height: np.full((height, width, 3), 200, np.uint8), lifted_s=4.5)
    sensors = SimpleNamespace(array=SimpleNamespace(counts=np.full((44, 44), 60, np.uint8)),
                              touchpad=SimpleNamespace(image=np.full((480, 640, 3), (0, 0, 255), np.uint8)))
    for step in range(100):
        film(world, SimpleNamespace(time_s=0.01 * step, grip_force=4.0, least_force=2.0, displacement=np.full(3, np.nan)), sensors, ())
    assert len(film.pictures) == 6, 'one of each tenth of a second after the start'
    scene, array, touchpad, strip = (film.pictures[-1][part].reshape(-1, 3) for part in (
        np.s_[:360, :360], np.s_[20:180, 360:], np.s_[200:360, 360:], np.s_[360:, :]))
    assert (scene == 200).all() and len(np.unique(array, axis=0)) == 1 and (touchpad == (0, 0, 255)).all()
    below = strip.reshape(-1, 540, 3)[20:].astype(int)
    assert (below[..., 1] > below[..., 2] + 50).any() and (below.min(axis=-1) > 100).any(), 'green force and grey minimum'


def test_an_unknown_object_is_refused(capsys):
    assert main(['grasp.webp', '--object', 'piano']) == 1 and 'piano' in capsys.readouterr().err
