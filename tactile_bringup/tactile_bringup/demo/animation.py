# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""animate: a video as an animated WebP picture for a web page, as README.md shows the demo."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from tactile_driver.command import tells_errors
from tactile_driver.errors import BadArgument

_RATE = 5.0  # frames a second; chosen: every third one of the demo's video, few enough for 25 s in 3 MB
_WIDTH = 480  # px; chosen: the width at which a web page shows it beside text
_QUALITIES = (75, 60, 45, 30)  # of WebP; chosen: the best that fits is taken, below 30 dots lose their edges
_LARGEST_BYTES = 3_000_000  # chosen: what a page may load at once


@tells_errors('animate', OSError)
def main(args: list[str] | None = None) -> int:
    """The command; exit code 0, or 1 with one line that says what is wrong."""
    parser = argparse.ArgumentParser('animate', description=__doc__)
    parser.add_argument('video', type=Path, help='the demo\'s video, or any other that OpenCV reads')
    parser.add_argument('picture', type=Path, help='file to write, *.webp; one that exists is replaced')
    given = parser.parse_args(args)
    frames, size = animate(given.video, given.picture)
    print(f'{given.picture}: {frames} frames, {1e-6 * size:.1f} MB')
    return 0


def animate(video: Path, picture: Path, largest_bytes: int = _LARGEST_BYTES) -> tuple[int, int]:
    """Write a video as an animated picture that loops, at 5 frames a second, at most 480 px wide and largest_bytes large.

    Returns the counts of frames and bytes. Raises BadArgument for a name that does not end in .webp, a video that cannot be read, and one
    too long for the size.
    """
    if picture.suffix != '.webp':
        raise BadArgument(f'{picture}: the picture is a WebP; give a name that ends in .webp')
    frames = [Image.fromarray(cv2.cvtColor(_fitted(frame), cv2.COLOR_BGR2RGB)) for frame in _frames(video)]
    if not frames:
        raise BadArgument(f'{video}: OpenCV reads no frame from it; is it a video?')
    for quality in _QUALITIES:
        frames[0].save(picture, 'WEBP', save_all=True, append_images=frames[1:], duration=round(1000 / _RATE), loop=0, quality=quality)
        size = picture.stat().st_size
        if size <= largest_bytes:
            return len(frames), size
    picture.unlink()
    raise BadArgument(f'{video}: {len(frames)} frames take {size} bytes at the lowest quality, more than {largest_bytes}; '
                      'take a shorter video')


def _frames(video: Path) -> Iterator[np.ndarray]:
    capture, number, due = cv2.VideoCapture(str(video)), 0, 0.0
    step = capture.get(cv2.CAP_PROP_FPS) / _RATE
    try:
        while capture.grab():
            if number >= due:
                yield capture.retrieve()[1]
                due += step
            number += 1
    finally:
        capture.release()


def _fitted(frame: np.ndarray) -> np.ndarray:
    height, width = frame.shape[:2]
    if width <= _WIDTH:
        return frame
    return cv2.resize(frame, (_WIDTH, round(height * _WIDTH / width)), interpolation=cv2.INTER_AREA)


if __name__ == '__main__':
    sys.exit(main())
