# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of the viewer."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class ViewConstants:
    """Constants of the viewer."""

    max_array_side: int = constant(128, 'px', 'limit', 'a smaller grey image comes from a pressure array, not from a camera')
    waiting_messages: int = constant(5, '1', 'limit', 'of a topic; older ones are dropped')
    topic_check_s: float = constant(1.0, 's', 'limit', 'between two searches for topics')
    max_wait_s: float = constant(5.0, 's', 'limit', 'for results before raw data are subscribed to')
    node_check_s: float = constant(1.0, 's', 'limit', 'between two searches for nodes')
    candidates_s: float = constant(0.5, 's', 'measured',
                                   'between two images whose candidates are drawn; those of 640 x 480 px cost 22 ms of a core')
    grpc_port: int = constant(9876, '1', 'prior', 'preferred port of the data')
    web_port: int = constant(9090, '1', 'prior', 'preferred port of the page')
    last_data_s: float = constant(1.0, 's', 'limit', 'for the last data to reach a viewer that ends: Ctrl-C is answered at once')


VIEW = ViewConstants()
