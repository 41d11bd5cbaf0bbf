# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bind the packages' names before pytest does: it would take the source folders of the same names for them (import mode importlib).

The nodes' package comes first: it says, before NumPy is imported, with how many threads nodes and tools compute. With another number a
sum may differ in its last bit from theirs.
"""
import tactile_driver.nodes  # noqa: F401, I001
import tactile_bringup  # noqa: F401
import tactile_perception  # noqa: F401

try:
    from tactile_driver.nodes.runtime.last_net import LastNet
except ImportError:  # there is no ROS, and no node
    pass
else:
    LastNet.strict = True
