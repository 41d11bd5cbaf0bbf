# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from PIL import Image, ImageSequence
from tactile_driver.errors import BadArgument

from tactile_bringup.demo.animation import animate, main
from tactile_bringup.demo.video import Video


@pytest.fixture
def video(tmp_path):
    """Return two seconds of a picture that gets brighter, 640 x 480 px, 15 frames a second."""
    made = Video(tmp_path / 'demo')
    for k in range(30):
        made.add(k / 15, np.full((480, 640, 3), 8 * k, np.uint8))
    made.close()
    return made.path


def test_the_picture_plays_as_the_video_does(video, tmp_path):
    picture = tmp_path / 'demo.webp'
    frames, size = animate(video, picture)
    with Image.open(picture) as image:
        assert (image.n_frames, image.size, image.info['loop']) == (frames, (480, 360), 0)
        shown, seconds = [], []
        for frame in ImageSequence.Iterator(image):
            shown.append(np.asarray(frame.convert('L')).mean())
            seconds.append(1e-3 * frame.info['duration'])
    assert sum(seconds) == pytest.approx(2.0, abs=0.02)
    np.testing.assert_allclose(shown, 24 * np.arange(10), atol=10)
    assert size == picture.stat().st_size


def test_a_small_video_keeps_its_size(tmp_path):
    made = Video(tmp_path / 'demo')
    for k in range(4):
        made.add(k / 15, np.full((48, 64, 3), 50 * k, np.uint8))
    made.close()
    animate(made.path, tmp_path / 'demo.webp')
    with Image.open(tmp_path / 'demo.webp') as image:
        assert (image.n_frames, image.size) == (2, (64, 48))


def test_the_quality_falls_until_the_picture_fits(tmp_path):
    rng, made = np.random.default_rng(0), Video(tmp_path / 'demo')
    for k in range(4):
        made.add(k / 15, rng.integers(0, 256, (96, 128, 3)).astype(np.uint8))
    made.close()
    _, best = animate(made.path, tmp_path / 'best.webp')
    _, smaller = animate(made.path, tmp_path / 'smaller.webp', int(0.8 * best))
    assert smaller <= 0.8 * best
    with pytest.raises(BadArgument, match='shorter'):
        animate(made.path, tmp_path / 'none.webp', 100)
    assert not (tmp_path / 'none.webp').exists()


def test_what_cannot_be_done_is_one_line(video, tmp_path, capsys):
    text = tmp_path / 'text.mp4'
    text.write_text('no video')
    for source, picture, word in ((text, 'a.webp', 'no frame'), (tmp_path / 'none.mp4', 'a.webp', 'no frame'), (video, 'a.gif', '.webp'),
                                  (video, 'no_folder/a.webp', 'no_folder')):
        assert main([str(source), str(tmp_path / picture)]) == 1
        said = capsys.readouterr().err
        assert word in said and said.startswith('animate: ') and said.count('\n') == 1
    assert main([str(video), str(tmp_path / 'a.webp')]) == 0
