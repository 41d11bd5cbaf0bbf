# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from tactile_bringup.demo import summary as video
from tactile_bringup.demo.summary import Video


def frames_of(path):
    capture, found = cv2.VideoCapture(str(path)), []
    while True:
        good, frame = capture.read()
        if not good:
            return capture.get(cv2.CAP_PROP_FPS), found
        found.append(int(frame.mean() + 0.5))


@pytest.mark.parametrize('forms', [(('.mp4', 'mp4v'),), (('.avi', 'MJPG'),)])
def test_it_plays_at_the_speed_of_the_stamps(tmp_path, monkeypatch, forms):
    monkeypatch.setattr(video, '_FORMS', forms)
    it = Video(tmp_path / 'demo')
    for k in range(60):
        it.add(100.0 + k / 30, np.full((48, 64, 3), 4 * k, np.uint8))
    it.close()
    rate, found = frames_of(it.path)
    assert rate == pytest.approx(15.0)
    assert len(found) in (30, 31)
    assert np.abs(np.array(found) - 8 * np.arange(len(found))).max() <= 12  # a frame is 8


def test_a_gap_is_shown_as_a_still(tmp_path):
    it = Video(tmp_path / 'demo')
    for stamp_s in (0.0, 1.0):
        it.add(stamp_s, np.zeros((48, 64, 3), np.uint8))
    it.close()
    assert len(frames_of(it.path)[1]) == 16


def test_without_frames_there_is_no_file(tmp_path):
    Video(tmp_path / 'demo').close()
    assert list(tmp_path.iterdir()) == []
