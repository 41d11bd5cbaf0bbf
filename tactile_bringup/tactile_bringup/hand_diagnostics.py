# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The configuration with which diagnostic_aggregator groups /diagnostics by the sensors of a hand. No ROS here."""
from __future__ import annotations

import yaml

from .hand_file import Hand


def aggregator_configuration(hand: Hand) -> str:
    """The parameter file's text: one analyzer for each sensor, which takes what the nodes in its namespace report."""
    analyzers = {sensor.frame: {'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': sensor.name, 'startswith': [f'/{sensor.name}/']}
                 for sensor in hand.sensors}
    return yaml.safe_dump({'analyzers': {'ros__parameters': {'path': hand.frame, **analyzers}}}, sort_keys=False)
