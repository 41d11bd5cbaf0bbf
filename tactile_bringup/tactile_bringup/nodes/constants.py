# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the nodes of hands, pictures, recordings, status and guided calibrations."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class BringupNodeConstants:
    """Constants of the nodes of hands, pictures, recordings, status and guided calibrations."""

    probe_delay_s: float = constant(1.0, 's', 'limit', 'for which an image waits for the position of the probe')
    calibrate_period_s: float = constant(0.05, 's', 'limit', "of the node's timer")
    max_late_ns: int = constant(1_000_000_000, 'ns', 'limit', 'between stamps of a topic; a larger step back resets')
    max_gap_ns: int = constant(2_000_000_000, 'ns', 'limit', 'a larger step forward resets')
    max_sets: int = constant(30, '1', 'limit', 'incomplete sets of messages that are kept')
    min_period: float = constant(0.75, '1', 'limit', 'of the period of the rate; stamps jitter by half a frame')
    warning_s: float = constant(3.0, 's', 'limit', 'that a warning is shown; nodes report it once a second')
    endpoint_check_s: float = constant(0.2, 's', 'limit', 'between two checks for publishers and subscribers')
    max_wait_s: float = constant(15.0, 's', 'limit', 'for the perception node to subscribe to raw data, on a busy machine')
    hand_contacts_rate: float = constant(50.0, 'Hz', 'limit', 'of a controller, slower than the fastest sensor')
    max_contacts_age_ns: int = constant(500_000_000, 'ns', 'limit', 'an older message of a sensor says nothing about now')
    joint_history_ns: int = constant(2_000_000_000, 'ns', 'limit', 'longer than the results of any sensor take')
    max_joint_age_ns: int = constant(200_000_000, 'ns', 'limit',
                                     'a joint that reports at 10 Hz or faster is known; slower ones move unseen')
    sweep_s: float = constant(8.0, 's', 'prior', 'of the simulated joints from one limit to the other and back; slow enough to look at')
    sweep_rate: float = constant(30.0, 'Hz', 'prior', 'of their reports')
    waiting_stamps: int = constant(10, '1', 'limit',
                                   'stamps of a sensor of which one of the two messages is kept until the other one comes')
    reserved_bytes: int = constant(4 << 20, 'byte', 'limit', 'for the end of the file and metadata.yaml')
    max_drain_s: float = constant(5.0, 's', 'limit', 'for messages that wait at the end; less than the 12 s that ending may take')
    idle_callbacks: int = constant(10, '1', 'limit', 'without a message, after which none waits; more than the node has timers and events')
    subscriber_check_s: float = constant(0.05, 's', 'limit', 'between two checks for subscribers of raw data')
    start_height: float = constant(0.3, 'm', 'prior', 'of the tip of the simulated stage before the first contact')
    clearance: float = constant(5e-3, 'm', 'prior', 'of the tip between contacts')
    silence_s: float = constant(3.5, 's', 'limit', 'three missed reports (nodes report once a second), and the delay of a busy machine')
    status_period_s: float = constant(1.0, 's', 'prior', 'of the table')
    complete_s: float = constant(2.5, 's', 'limit', 'time without a new node until the table is complete; nodes report once a second')


BRINGUP = BringupNodeConstants()
