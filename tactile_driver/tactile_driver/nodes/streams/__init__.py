# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Streams: an open source is read in one thread and published in another, with its health for /diagnostics."""
