# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Drivers of tactile sensors.

What is imported takes a second or two: a Ctrl-C meanwhile ends a command of these packages at once and without a word. Nodes and tools
(runtime/run.py, errors.py) set handlers of their own once they run.
"""
import signal
import sys
from pathlib import Path

if Path(sys.argv[0]).parent.name.startswith('tactile_'):
    signal.signal(signal.SIGINT, signal.SIG_DFL)
