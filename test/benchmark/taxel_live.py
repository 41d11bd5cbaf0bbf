# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The taxel array over ROS, from a serial port to all results: lost frames, latency, CPU and memory of each process.

    python test/benchmark/taxel_live.py [--duration 60] [--rate 500] [--size 44] [--scene demo] [--out out/benchmark]

The emulator sends frames through a pseudo-terminal; taxel_array_node and taxel_contact_node run as separate processes with the calibration
that ships. This process subscribes to image_raw and to all four results. Latency: from the stamp of a frame to the receipt of its
contact_region here. A frame is lost if the stamps of image_raw have a gap, or if an image has no contact_region. Frames that the emulator
itself did not send in time on a busy machine count as lost too.
"""
from __future__ import annotations


from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Image
from tactile_bringup.installed import share
from tactile_msgs.msg import ContactRegion, Contacts, Slip

import port_live

CALIBRATED = 44  # taxels along both sides, of the simulated array


def array(rate: float, size: int, scene: str) -> port_live.PortSensor:
    """An array of size x size taxels at rate frames/s; sizes but the calibrated one are told without force."""
    values = {'rows': size, 'columns': size}
    if size == CALIBRATED:
        values['calibration'] = share('calibration', 'taxel_array_sim.yaml')
    return port_live.PortSensor(
        ('tactile_driver.emulators.taxel', '--rate', str(rate), '--scene', scene, '--rows', str(size), '--columns', str(size)),
        ('taxel_array_node', 'taxel_contact_node'), values, ('image_raw', Image),
        lambda _message: (1, 1 / rate), {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped},
        'frame')


def main() -> None:
    """Run, print, write taxel_live.md and taxel_live.json."""
    parser = port_live.arguments(__doc__)
    parser.add_argument('--rate', type=float, default=500.0, help='frames a second')
    parser.add_argument('--size', type=int, default=CALIBRATED, help='rows and columns')
    parser.add_argument('--scene', default='demo')
    given = parser.parse_args()
    port_live.report(array(given.rate, given.size, given.scene), 'taxel_live', given)


if __name__ == '__main__':
    main()
