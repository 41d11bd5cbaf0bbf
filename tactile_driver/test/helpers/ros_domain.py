# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""ROS domains for tests: no two test processes of a machine share one, and none meets the nodes of its user."""
from __future__ import annotations

import itertools
import os
import socket

#: The ports of higher domains reach into the range from which Linux gives ports to anybody (ROS 2 documentation, "The ROS_DOMAIN_ID").
LARGEST = 101
_NEXT = itertools.count(os.getpid())


def claimed() -> tuple[int, socket.socket]:
    """A domain from 1 to 101 that no other test has, and the socket that holds it until it is closed or its process ends.

    The claim is a TCP socket on the number of the domain's first DDS port, which is one of UDP: 7400 + 250 domain (RTPS 2.5, 9.6.2.3).
    Raises RuntimeError where all are taken.
    """
    for _ in range(LARGEST):
        number, claim = 1 + next(_NEXT) % LARGEST, socket.socket()
        try:
            claim.bind(('127.0.0.1', 7400 + 250 * number))
        except OSError:
            claim.close()
        else:
            return number, claim
    raise RuntimeError(f'other tests hold all ROS domains from 1 to {LARGEST}: end some of them')
