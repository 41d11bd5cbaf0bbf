# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A package, so that what its tests share (scope package) ends with the last of them."""
