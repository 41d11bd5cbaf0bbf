# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point and depth from the markers of a sheet or a dome: what the field looks like, and the methods that read it."""
