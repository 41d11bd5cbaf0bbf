# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The PSD finger over ROS, from a serial port to contacts: lost samples, latency, CPU and memory of each process.

    python test/benchmark/psd_live.py [--duration 60] [--rate 5000] [--batch-period 0.005] [--out out/benchmark]

The emulator sends frames of five samples through a pseudo-terminal; psd_node and psd_contact_node run as separate processes with the
calibration that ships. This process subscribes to voltages and contacts. Latency: from the last sample of a batch to the receipt of its
contacts here. A sample is lost if the stamps of voltages have a gap, or if a batch has no contacts. Samples that the emulator itself did
not send in time on a busy machine count as lost too.
"""
from __future__ import annotations


from tactile_bringup.installed import share
from tactile_msgs.msg import Contacts, PsdVoltages

import port_live


def finger(rate: float, batch_period: float) -> port_live.PortSensor:
    """The finger at rate samples/s, batch_period s a message."""
    return port_live.PortSensor(
        ('tactile_driver.emulators.psd', '--rate', str(rate)), ('psd_node', 'psd_contact_node'),
        {'batch_period': batch_period, 'calibration': share('calibration', 'psd_finger_sim.yaml')}, ('voltages', PsdVoltages),
        lambda message: (len(message.voltages) // 4, message.sample_period), {'contacts': Contacts}, 'sample')


def main() -> None:
    """Run, print, write psd_live.md and psd_live.json."""
    parser = port_live.arguments(__doc__)
    parser.add_argument('--rate', type=float, default=5000.0, help='samples a second')
    parser.add_argument('--batch-period', type=float, default=0.005, help='s')
    given = parser.parse_args()
    port_live.report(finger(given.rate, given.batch_period), 'psd_live', given)


if __name__ == '__main__':
    main()
