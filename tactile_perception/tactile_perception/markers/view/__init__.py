# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensor, and its markers as they appear in the viewing plane: the field that all methods read."""
