# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Work on a recording that fails as the recording says; here, so that the workers of a cluster can import it."""
import os
import signal
import time

from tactile_perception.core.errors import BadRecording
from tactile_perception.tools.many import WorkResult


def work(bag, target, given):
    """Write a file that says what was read; the text of the recording may ask for a fault."""
    wish, marker = bag.read_text(), bag.with_suffix('.tried')
    target.write_text('begun')
    if wish == 'fail':
        raise BadRecording(f'{bag.name}: damaged')
    if wish == 'bug':
        raise ValueError('a bug')
    if wish == 'die' or wish == 'die once' and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if wish == 'interrupt' and not marker.exists():
        marker.touch()
        os.kill(os.getppid(), signal.SIGINT)
        time.sleep(60)
    target.write_text(f'{wish} in {given.word}')
    return WorkResult(0, f'{len(wish)} bytes\nmore')
