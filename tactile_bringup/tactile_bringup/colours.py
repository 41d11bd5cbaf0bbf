# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What colour means what, in pictures and in RViz alike. The touchpad's water is red: nothing that matters is."""

#: (r, g, b), 0 to 1, by dot state: untouched, sticking, slipping (the constants of ContactRegion).
STATE_COLOURS = ((0.45, 0.62, 0.80), (0.20, 0.85, 0.35), (1.00, 0.15, 0.90))
STATE_NAMES = ('untouched', 'sticking', 'slipping')
REGION = (1.00, 0.82, 0.10)
HOLE = (0.30, 0.90, 1.00)
CONTACT = (1.00, 1.00, 1.00)
ARROW = (1.00, 1.00, 0.35)
FORCE = (1.00, 0.55, 0.10)
TORQUE = (0.60, 0.40, 1.00)
TEXT = (1.00, 1.00, 1.00)


def bgr(colour: tuple[float, float, float]) -> tuple[int, int, int]:
    """The colour as OpenCV draws it."""
    red, green, blue = (round(255 * c) for c in colour)
    return blue, green, red
