# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A gripper that holds objects by what its tactile sensors report: simulated by MuJoCo, and its controller. MuJoCo is an optional extra."""
