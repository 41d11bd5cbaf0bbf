# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time of a frame, from the raw message to the messages of all results, relative to cv2.SimpleBlobDetector on the same frame.

    python3 test/benchmark/ratios.py [touchpad areal_single areal_dual air_cushion taxel_array] [--rounds 3] [--bags FOLDER]

Sensor and detector take turns frame by frame, on one thread, so that other load on the machine affects both alike. The detector has its own
search over thresholds, OpenCV's default, and knows the polarity of the dots. Its time depends on the number of dots: it also takes turns on
the frames of the touchpad, which are the only ones for the array, whose frames show no dots.
"""
from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import tactile_driver.nodes  # noqa: F401  sets the number of linear algebra threads, before NumPy is imported

# isort: split
import cv2
import numpy as np
from judged import Case, simulated

from tactile_bringup import share
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.serialization import decode
from tactile_perception.bags.replay import Replay, make_stage
from tactile_perception.core.parameter_files import read_parameters

SCENES = {'touchpad': ('rectangle_drag', 10.0), 'areal_single': ('areal_single_test', 4.0), 'areal_dual': ('areal_dual_test', 4.0),
          'air_cushion': ('air_cushion_test', 4.0), 'taxel_array': ('drag', 50.0)}  # sensor -> scene, Hz
MAX_FRAMES = 80  # a round


def blob_detector(case: Case) -> cv2.SimpleBlobDetector:
    """The detector for the dots of a sensor."""
    wanted = cv2.SimpleBlobDetector_Params()
    kind = type(make_stage(case.params))
    values = read_parameters(case.params, kind.node, kind.parameters)
    wanted.blobColor = 255 if values['polarity'] == 'bright' else 0
    wanted.minArea, wanted.minDistBetweenBlobs, wanted.filterByConvexity, wanted.filterByInertia = 8, 4, False, False
    return cv2.SimpleBlobDetector_create(wanted)


class Frames:
    """The frames of a sensor's scene. calibration: file, None for none."""

    def __init__(self, case: Case, calibration: Path | None):
        self._case, self._calibration = case, calibration
        replay = Replay(case.bag, case.params, calibration)
        with replay.open() as reader:
            info = [decode(item.data, item.type_name) for item in reader.messages({replay.prefix + 'camera_info'} & set(replay.topics))]
            self.messages = [decode(item.data, item.type_name) for item in reader.messages({replay.raw})][:MAX_FRAMES]
        self._camera_info = info[:1]
        self.images = [image_to_array(message) for message in self.messages]

    def restarted(self) -> Callable:
        """A fresh stage's `process`."""
        stage = make_stage(self._case.params, self._calibration)
        for message in self._camera_info if stage.side_inputs else ():
            stage.take('camera_info', message)
        return stage.process


def prepared(folder: Path, sensor: str) -> tuple[Case, Frames]:
    """The scene of a sensor, with the calibration that ships for it, if any."""
    calibration = Path(share('calibration', f'{sensor}_sim.yaml'))
    case = simulated(folder, SCENES[sensor][0], sensor, SCENES[sensor][1])
    return case, Frames(case, calibration if calibration.exists() else None)


def measure(folder: Path, sensor: str, rounds: int) -> np.ndarray:
    """Median ms of a frame of the sensor, of the detector on it, and of the detector on one of the touchpad; the first frames, which set up
    the models, do not count."""
    (case, frames), (dotted_case, dotted) = prepared(folder / sensor, sensor), prepared(folder / 'touchpad', 'touchpad')
    seen = (dotted_case, dotted.images) if sensor == 'taxel_array' else (case, frames.images)
    detectors, spent = [(blob_detector(seen[0]), seen[1]), (blob_detector(dotted_case), dotted.images)], []
    for _ in range(rounds):
        process = frames.restarted()
        for number, message in enumerate(frames.messages):
            times = [time.thread_time()]
            process(message)
            times.append(time.thread_time())
            for detector, images in detectors:
                detector.detect(images[number % len(images)])
                times.append(time.thread_time())
            spent += [np.diff(times)] if number > 2 else []
    return 1e3 * np.median(spent, axis=0)


def main() -> None:
    """Print a line a sensor."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensors', nargs='*', metavar='SENSOR', help=f'of {", ".join(SCENES)}; all by default')
    parser.add_argument('--rounds', type=int, default=3, help='how often each scene is run')
    parser.add_argument('--bags', type=Path, help='folder that keeps the bags for the next run; default: a temporary one')
    given = parser.parse_args()
    if unknown := set(given.sensors) - set(SCENES):
        sys.exit(f'unknown: {", ".join(sorted(unknown))}; the sensors are {", ".join(SCENES)}')
    cv2.setNumThreads(1)
    with TemporaryDirectory() as temporary:
        for sensor in given.sensors or SCENES:
            ours, own, dotted = measure(given.bags or Path(temporary), sensor, given.rounds)
            print(f'{sensor}: {ours:.2f} ms a frame; over the detector on the same frames ({own:.1f} ms) {ours / own:.3f}, '
                  f'on the touchpad ({dotted:.1f} ms) {ours / dotted:.3f}', flush=True)


if __name__ == '__main__':
    main()
