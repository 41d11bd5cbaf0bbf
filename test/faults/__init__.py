# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A package, so that fixtures shared by its tests (scope package) end with the last test."""
