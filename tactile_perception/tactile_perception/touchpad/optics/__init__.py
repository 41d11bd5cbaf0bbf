# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Range by colour: absorption along the path of the light."""
