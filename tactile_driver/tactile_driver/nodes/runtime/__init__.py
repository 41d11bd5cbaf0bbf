# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes of all packages share: process, parameters, timers, QoS, diagnostics."""
