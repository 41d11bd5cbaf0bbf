# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated touchpad: untouched images, one of a ball pressed in, and the stages' parameters for it."""
from pressed_ball import ball  # noqa: F401
