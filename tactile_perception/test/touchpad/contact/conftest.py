# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes made by geometry alone: a cap of dots with an object pressed into it."""
from cap_with_dots import pad, recording  # noqa: F401
