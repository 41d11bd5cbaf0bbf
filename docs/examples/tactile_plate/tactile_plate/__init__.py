# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A plate on four load cells, as a sensor type of a package of its own."""
