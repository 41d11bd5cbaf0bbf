# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Row and column, or number, of each dot: methods by name."""
