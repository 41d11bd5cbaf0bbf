# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The untouched reference, its drift, and checks of it."""
