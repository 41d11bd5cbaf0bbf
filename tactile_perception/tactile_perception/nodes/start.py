# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Entry points of this package's nodes and tools; why they are apart from them: tactile_driver.nodes.start."""
from tactile_driver.nodes.start import start_node, start_tool


def dot_tracker_node() -> None:
    """The process dot_tracker_node."""
    start_node('tactile_perception.nodes.dot_tracker_node')


def contact_region_node() -> None:
    """The process contact_region_node."""
    start_node('tactile_perception.nodes.contact_region_node')


def contact_point_node() -> None:
    """The process contact_point_node."""
    start_node('tactile_perception.nodes.contact_point_node')


def psd_contact_node() -> None:
    """The process psd_contact_node."""
    start_node('tactile_perception.nodes.psd_contact_node')


def taxel_contact_node() -> None:
    """The process taxel_contact_node."""
    start_node('tactile_perception.nodes.taxel_contact_node')


def process_bag() -> None:
    """The command process_bag."""
    start_tool('tactile_perception.offline.process_bag')


def calibrate() -> None:
    """The command calibrate."""
    start_tool('tactile_perception.offline.calibrate')


def convert_recording() -> None:
    """The command convert_recording."""
    start_tool('tactile_perception.offline.convert_recording')


def evaluate() -> None:
    """The command evaluate."""
    start_tool('tactile_perception.offline.evaluate')
