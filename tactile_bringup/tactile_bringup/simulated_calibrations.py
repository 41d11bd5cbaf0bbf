# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Makes calibration/*_sim.yaml: calibrates the simulated specimens, as a user would calibrate his, by presses at known places.

    python3 -m tactile_bringup.simulated_calibrations FOLDER [TYPE ...]

Of the touch methods the files hold the one that did best; the errors of all are there.
"""
from __future__ import annotations

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_perception.calibration.files import read_calibration, write_calibration
from tactile_perception.calibration.touch_file import METHODS, best_method
from tactile_perception.errors import TactileError
from tactile_perception.offline.calibrate_markers import calibrate_markers
from tactile_perception.touch.sensor import MARKER_SENSORS

from .parameter_files import LICENCE
from .sensor_launch import share
from .simulated_bag import write_scene

_RATE = 3.0  # Hz: two to four frames of each depth


def calibrate_specimen(sensor_type: str, output: Path, rate: float = _RATE) -> str:
    """Write the calibration of the simulated specimen of a type to output, from its calibration scene at rate Hz; how it went.

    Raises TactileError for a type that there is none of.
    """
    with TemporaryDirectory() as folder:
        bag = Path(folder) / sensor_type
        write_scene(bag, f'{sensor_type}_calibration', rate)
        told = calibrate_markers([bag], Path(share('params', f'{sensor_type}_sim.yaml')), output)
    keep_best(output, sensor_type)
    return told


def keep_best(path: Path, sensor_type: str) -> None:
    """Leave only the best of the methods in a calibration file, and give it the licence's header: it ships."""
    file = read_calibration(path, sensor_type)
    methods = file.fitted[METHODS]
    best = best_method(file.residuals, methods)
    file.fitted[METHODS] = {best: methods[best]}
    write_calibration(path, file)
    path.write_text(LICENCE + path.read_text())


def main(args: list[str] | None = None) -> int:
    """The command; exit code 0, or 1 with one line that says what is wrong."""
    parser = argparse.ArgumentParser('simulated_calibrations', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('folder', type=Path)
    parser.add_argument('types', nargs='*', default=list(MARKER_SENSORS), help=f'of {", ".join(MARKER_SENSORS)}; all where none is given')
    given = parser.parse_args(args)
    given.folder.mkdir(parents=True, exist_ok=True)
    try:
        for sensor_type in given.types:
            print(calibrate_specimen(sensor_type, given.folder / f'{sensor_type}_sim.yaml'), flush=True)
    except TactileError as error:
        print(f'simulated_calibrations: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
