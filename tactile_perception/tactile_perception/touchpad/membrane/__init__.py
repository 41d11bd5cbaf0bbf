# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force balance of the membrane, solved together with the measured ranges."""
