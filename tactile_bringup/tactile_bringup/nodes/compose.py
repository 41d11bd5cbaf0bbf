# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Several nodes in one process, images and results going from one to the next by a call."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from threading import RLock

from rclpy.node import Node
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.host import Host, SharedPublisher

_DRIVER, _PERCEPTION, _BRINGUP = 'tactile_driver.nodes', 'tactile_perception.nodes', 'tactile_bringup.nodes'
#: Name -> (package, class); the module has the node's name.
NODES = {
    'camera_node': (_DRIVER, 'CameraNode'), 'dual_camera_node': (_DRIVER, 'DualCameraNode'), 'psd_node': (_DRIVER, 'PsdNode'),
    'taxel_array_node': (_DRIVER, 'TaxelArrayNode'), 'dot_tracker_node': (_PERCEPTION, 'DotTrackerNode'),
    'contact_region_node': (_PERCEPTION, 'ContactRegionNode'), 'contact_point_node': (_PERCEPTION, 'ContactPointNode'),
    'psd_contact_node': (_PERCEPTION, 'PsdContactNode'), 'taxel_contact_node': (_PERCEPTION, 'TaxelContactNode'),
    'markers_node': (_BRINGUP, 'MarkersNode'), 'finger_markers_node': (_BRINGUP, 'FingerMarkersNode'),
    'taxel_markers_node': (_BRINGUP, 'TaxelMarkersNode'), 'hand_frames_node': (_BRINGUP, 'HandFramesNode'),
}


@dataclass(frozen=True)
class Plan:
    """One node. params_file: '' for none; parameters: name -> value, before those of the file."""

    node: str
    namespace: str
    params_file: str = ''
    parameters: dict = field(default_factory=dict)

    @property
    def arguments(self) -> list[str]:
        """The node's ROS arguments, but for its own parameters: on a command line they would not go before those of the file."""
        return ['-r', f'__ns:={self.namespace}', *(['--params-file', self.params_file] if self.params_file else [])]


def plans_of(entries: Sequence[dict]) -> list[Plan]:
    """The nodes that are listed, as JSON has them. Raises BadArgument."""
    try:
        plans = [Plan(**entry) for entry in entries]
    except TypeError as error:
        raise BadArgument(f'the list of nodes cannot be read: {error}') from error
    for plan in plans:
        if plan.node not in NODES:
            raise BadArgument(f'node {plan.node!r} is unknown; known are {", ".join(NODES)}')
    if not plans:
        raise BadArgument('the list of nodes is empty; name one or more')
    return plans


def kind_of(plan: Plan) -> type:
    """The node's class; its module, with all that it needs, is imported where it is not yet."""
    package, kind = NODES[plan.node]
    return getattr(import_module(f'{package}.{plan.node}'), kind)


def made(plans: Sequence[Plan]) -> Iterator[Node]:
    """Make the nodes, in the order of the list: whoever takes messages by a call comes after who publishes them. Raises TactileError."""
    shared: dict[str, SharedPublisher] = {}
    locks: dict[str, RLock] = {}
    for plan in plans:
        # Nodes of one sensor, which work one after the other in one thread, share a lock: with one each they could wait for each other.
        host = Host(plan.arguments, plan.parameters, shared, locks.setdefault(plan.namespace, RLock()))
        yield kind_of(plan)(host)
