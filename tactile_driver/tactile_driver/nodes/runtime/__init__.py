# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What every node of every package stands on: its process, its parameters, timers, diagnostics."""
