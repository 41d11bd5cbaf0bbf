# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes what a hand's file is worth to other tools: HAND.rviz for RViz, HAND_diagnostics.yaml for diagnostic_aggregator.

    ros2 run tactile_bringup hand_config HAND.yaml FOLDER
"""
from __future__ import annotations

import argparse
from pathlib import Path

from tactile_driver.command import tells_errors

from .hand_diagnostics import aggregator_configuration
from .hand_file import read_hand
from .hand_rviz import rviz_configuration


@tells_errors('hand_config', OSError)
def main(args: list[str] | None = None) -> int:
    """Write both files; the exit code, 1 where the hand's file is wrong or the folder cannot be written to."""
    parser = argparse.ArgumentParser(prog='hand_config', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('hand', type=Path, help='YAML file with the sensors of the hand')
    parser.add_argument('folder', type=Path, help='where to write')
    given = parser.parse_args(args)
    hand = read_hand(given.hand)
    given.folder.mkdir(parents=True, exist_ok=True)
    for end, text in (('.rviz', rviz_configuration(hand)), ('_diagnostics.yaml', aggregator_configuration(hand))):
        path = given.folder / (given.hand.stem + end)
        path.write_text(text)
        print(path)
    return 0
