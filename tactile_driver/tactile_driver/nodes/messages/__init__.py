# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions of frames, samples and ground truth to messages."""
