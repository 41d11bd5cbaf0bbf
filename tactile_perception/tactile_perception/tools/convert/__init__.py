# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""convert_recording: one module for each kind of recording."""
