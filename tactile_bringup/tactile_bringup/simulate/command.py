# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""simulate: writes a scene of a simulated sensor as a recording with ground truth, as fast as the machine computes it.

The bag holds the topics of the driver and ground_truth/*, for calibrate, process_bag and evaluate.
"""
from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tactile_driver.command import tells_errors
from tactile_driver.simulation.psd.scene import PSD_SCENES
from tactile_driver.simulation.sensors.scenes import SCENES
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES

from .camera import write_scene
from .psd import SENSOR_TYPE as PSD_FINGER, write_psd_scene
from .taxel import SENSOR_TYPE as TAXEL_ARRAY, write_taxel_scene

CAMERA = 'camera'
#: Kind of sensor -> function that writes a scene to a bag, default rate (Hz), names of the scenes.
WRITERS = {CAMERA: (write_scene, 30.0, SCENES), PSD_FINGER: (write_psd_scene, 1000.0, PSD_SCENES),
           TAXEL_ARRAY: (write_taxel_scene, 100.0, TAXEL_SCENES)}


@tells_errors('simulate')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 1 and one error line on failure."""
    scenes = '\n'.join(f'{kind}: {", ".join(sorted(names))}' for kind, (_, _, names) in WRITERS.items())
    parser = argparse.ArgumentParser('simulate', description=__doc__, epilog='scenes\n' + scenes,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('sensor', choices=list(WRITERS), help=f'kind of sensor; {CAMERA}: touchpad, sheets and dome, told by the scene')
    parser.add_argument('scene')
    parser.add_argument('bag', type=Path, help='rosbag2 to write (MCAP); it must not exist')
    parser.add_argument('--rate', type=float, help='frames or samples a second; default ' +
                        ', '.join(f'{rate:g} ({kind})' for kind, (_, rate, _) in WRITERS.items()))
    parser.add_argument('--seed', type=int, default=0, help='of the noise and of the irregularities of the specimen')
    given = parser.parse_args(args)
    write, rate, _ = WRITERS[given.sensor]
    count = write(given.bag, given.scene, given.rate or rate, given.seed)
    print(f'{given.bag}: {count} frames or samples of {given.scene}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
