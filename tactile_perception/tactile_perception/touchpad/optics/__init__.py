# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Range from colour: absorption along the light's path."""
