# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What is found in videos and folders of images of sensors that nobody described, as a table:

    python3 test/benchmark/clips.py [--sheet FOLDER] CLIP ...

CLIP is a video or a folder of images, in the natural order of their names. --sheet writes the first, the middle and the last image with the
dots that are reported, so that found and false ones can be counted by eye.
"""
import argparse
import re
import time
from pathlib import Path

import cv2
import numpy as np

from tactile_perception.common.neighbours import Neighbours
from tactile_perception.core.errors import BadFrame
from tactile_perception.dots.reference import Reference
from tactile_perception.dots.tracker import DotOptions, DotTracker

PERIOD_S = 1 / 30  # of all clips
REPEATS = 12  # of the first image
NEIGHBOURS = 8  # of a dot, whose median displacement a right number follows within half a pitch
SCALE = 1200  # px, width of a picture of the sheet


def frames(path: Path):
    """Images (H, W, 3) uint8 of a video or a folder."""
    if path.is_dir():
        def natural(name: Path) -> list:
            return [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', name.name)]
        images = (cv2.imread(str(name)) for name in sorted(path.iterdir(), key=natural) if name.is_file())
        yield from (image for image in images if image is not None)
        return
    video = cv2.VideoCapture(str(path))
    while (image := video.read()[1]) is not None:
        yield image


def wrong_numbers(tracks) -> int:
    """How many displacements differ from the median of their neighbours' by more than half the neighbours' distance."""
    known = np.isfinite(tracks.duv).all(axis=1)
    reference, duv = (tracks.uv - tracks.duv)[known], tracks.duv[known]
    if len(duv) <= NEIGHBOURS:
        return 0
    distance, near = Neighbours(reference).query(reference, NEIGHBOURS + 1)
    off = np.hypot(*(duv - np.median(duv[near[:, 1:]], axis=1)).T)
    return int(np.count_nonzero(off > np.median(distance[:, 1]) / 2))


def drawn(image, tracks):
    """The image with a circle around each dot and its displacement from the reference."""
    factor = max(1, round(SCALE / image.shape[1]))
    image = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    for uv, duv, area in zip(tracks.uv, np.nan_to_num(tracks.duv), tracks.area):
        middle, start = (np.rint((position + 0.5) * factor - 0.5).astype(int).tolist() for position in (uv, uv - duv))
        cv2.circle(image, middle, int(factor * np.sqrt(area / np.pi)) + 2, (0, 255, 255), 1, cv2.LINE_AA)
        cv2.line(image, start, middle, (0, 0, 255), 2, cv2.LINE_AA)
    return image


def measure(path: Path, sheet: Path | None) -> str:
    """A row of the table."""
    images = list(frames(path))
    tracker = DotTracker(DotOptions(0, 0, 'any', 'auto', 'auto'), as_tracks=Reference())  # as dot_tracker_node has it
    took, counts, wrong, refused, shown = [], [], 0, 0, {0, len(images) // 2, len(images) - 1}
    for k, image in enumerate(images):
        begin = time.process_time()
        try:
            tracks = tracker.process(image, k * PERIOD_S)
        except BadFrame:
            refused += 1
            tracks = None
        took.append(1e3 * (time.process_time() - begin))
        counts.append(0 if tracks is None else len(tracks))
        wrong += 0 if tracks is None else wrong_numbers(tracks)
        if sheet and k in shown and tracks is not None:
            cv2.imwrite(str(sheet / f'{path.stem}_{k}.png'), drawn(image, tracks))
    moved = np.nan
    again = DotTracker(DotOptions(0, 0, 'any', 'auto', 'auto'))
    try:
        repeated = [again.process(images[0], k * PERIOD_S).duv for k in range(REPEATS)]
        moved = max(np.abs(duv).max() for duv in repeated)
    except BadFrame:
        pass
    size = f'{images[0].shape[1]} x {images[0].shape[0]}'
    count = f'{np.median(counts):.0f} ({min(counts)} to {max(counts)})'
    return (f'| {path.name} | {size}, {len(images)} | {tracker.found or "refused"} | {count} | {refused} | {wrong} | {moved:.1f} '
            f'| {tracker.links.restarts}, {tracker.links.lost}, {tracker.links.far} | {took[0]:.0f} | {np.median(took[1:]):.1f} '
            f'| {tracker.warning[:60]} |')


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('clip', nargs='+', type=Path)
    parser.add_argument('--sheet', type=Path)
    options = parser.parse_args()
    if options.sheet:
        options.sheet.mkdir(parents=True, exist_ok=True)
    cv2.setNumThreads(1)
    print('| clip | size, images | found in the first image | reported: median (range) | refused images | wrong numbers '
          '| displacement of a repeated image, px | restarts, unlinked, far | first, ms | later, ms | warning |')
    print('|' + '---|' * 11)
    for path in options.clip:
        print(measure(path, options.sheet), flush=True)


if __name__ == '__main__':
    main()
