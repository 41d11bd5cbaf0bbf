# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What all sources share: the protocol, the reading thread, stamps, serial ports."""
