# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Image sources of sensors with one camera."""
