# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A gripper that holds objects by what its tactile sensors report: simulated by MuJoCo, and its controller. MuJoCo is an optional extra.

The nodes' package sets the number of threads of linear algebra before NumPy is imported: with another number sums differ in their last
bits, which a closed loop amplifies to tenths of a millimetre.
"""
import tactile_driver.nodes  # noqa: F401
