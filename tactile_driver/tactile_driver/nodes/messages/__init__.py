# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From frames, samples and ground truth to messages."""
