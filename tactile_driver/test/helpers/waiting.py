# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Waits for states, with so much patience that no load of the machine matters."""
import time

PATIENCE_S = 60.0


def until(condition, executor=None, patience_s=PATIENCE_S):
    """Wait until condition() is true, meanwhile spinning an executor; what it returned last, which may hold for a moment only."""
    end = time.monotonic() + patience_s
    while not (found := condition()) and time.monotonic() < end:
        if executor is None:
            time.sleep(0.01)
        else:
            executor.spin_once(timeout_sec=0.05)
    return found
