# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of driver nodes, of their health, and of what all nodes share."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class NodeConstants:
    """Constants of driver nodes, of their health, and of what all nodes share."""

    take_s: float = constant(0.2, 's', 'limit', 'wait for one frame, after which the publishing thread looks whether it shall end')
    max_warnings: int = constant(10, '1', 'limit', 'more do not fit a line of /diagnostics; hostile images give thousands')
    settle_s: float = constant(
        0.5, 's', 'limit',
        'time without a new subscription after which a recording starts: a recorder subscribes to one topic after the other, and the '
        'perception to the images once somebody subscribes to its results')
    farewell_s: float = constant(
        2.0, 's', 'limit',
        'stay of a node after the end of a recording: /diagnostics says so at least once, and other processes finish their last messages')
    supervision_s: float = constant(
        0.1, 's', 'limit',
        'period of the supervision; a device that is plugged in again is open within a frame or two of a slow camera')
    min_rate_share: float = constant(0.9, '1', 'limit', 'share of the nominal rate below which there is a warning')
    max_saturated_share: float = constant(0.01, '1', 'limit', 'share of saturated samples above which there is a warning')
    max_skipped_share: float = constant(0.05, '1', 'limit',
                                        'share of skipped frames that is not reported: the machine was busy for a moment')
    max_contact_step: float = constant(5e-3, 'm', 'limit', 'between frames; a contact that moves further gets a new id')
    max_read_s: float = constant(0.1, 's', 'limit', 'duration of one read of messages')
    calm_s: float = constant(1.0, 's', 'limit', 'time without an event after which it is logged again')
    switch_s: float = constant(
        5e-4, 's', 'measured',
        "switch interval of threads: with Python's 5 ms, a thread with a frame to publish waits for the one that reads the next")
    max_end_s: float = constant(12.0, 's', 'limit',
                                'of the end of a process, which then reports where it hangs; launch kills it 15 s after Ctrl-C')
    max_close_s: float = constant(3.0, 's', 'limit', 'the same for the end of a process whose nodes have written everything')
    max_waiting_images: int = constant(4, '1', 'limit', 'received images that wait; the pairing of two cameras keeps 8 more')


NODES = NodeConstants()
