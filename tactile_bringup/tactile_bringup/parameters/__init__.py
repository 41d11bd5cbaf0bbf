# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter tables of this package, and params/*.yaml made from all tables."""
