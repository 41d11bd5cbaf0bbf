# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From dot positions to loads, dot states, contact regions, contacts and slip."""
