# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Entry points of this package's nodes and tools; why they are apart from them: tactile_driver.nodes.start."""
from tactile_driver.nodes.start import start_node, start_tool


def markers_node() -> None:
    """The process markers_node."""
    start_node('tactile_bringup.nodes.markers_node')


def finger_markers_node() -> None:
    """The process finger_markers_node."""
    start_node('tactile_bringup.nodes.finger_markers_node')


def taxel_markers_node() -> None:
    """The process taxel_markers_node."""
    start_node('tactile_bringup.nodes.taxel_markers_node')


def record_node() -> None:
    """The process record_node."""
    start_node('tactile_bringup.nodes.record_node')


def demo() -> None:
    """The process demo."""
    start_node('tactile_bringup.demo.main')


def hand_frames_node() -> None:
    """The process hand_frames_node."""
    start_node('tactile_bringup.nodes.hand_frames_node')


def hand_node() -> None:
    """The process hand_node."""
    start_node('tactile_bringup.nodes.keeper')


def hand_config() -> None:
    """The command hand_config."""
    start_tool('tactile_bringup.hand_config')


def status() -> None:
    """The command status."""
    start_tool('tactile_bringup.nodes.status')


def snapshot() -> None:
    """The command snapshot."""
    start_tool('tactile_bringup.nodes.snapshot')
