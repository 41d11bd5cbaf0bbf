# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The membrane's balance of forces, solved with the measured ranges."""
