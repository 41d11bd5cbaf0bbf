# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A scene: specimen, moving objects, frames and their truth."""
