# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Colours of pictures and RViz markers. No colour that carries meaning is red, because the touchpad's water is red."""
import numpy as np

#: Colours (r, g, b), 0 to 1, by dot state: untouched, sticking, slipping (the constants of ContactRegion). All colours are chosen.
STATE_COLOURS = ((0.45, 0.62, 0.80), (0.20, 0.85, 0.35), (1.00, 0.15, 0.90))
STATE_NAMES = ('untouched', 'sticking', 'slipping')
REGION = (1.00, 0.82, 0.10)
HOLE = (0.30, 0.90, 1.00)
CONTACT = (1.00, 1.00, 1.00)
ARROW = (1.00, 1.00, 0.35)
FORCE = (1.00, 0.55, 0.10)
TORQUE = (0.60, 0.40, 1.00)
TEXT = (1.00, 1.00, 1.00)


#: Colour scale from untouched to full depth, chosen.
_DEPTH_COLOURS = np.array([STATE_COLOURS[0], (0.25, 0.80, 0.60), (0.95, 0.85, 0.20), (1.00, 0.35, 0.10)])


def of_depth(share: np.ndarray) -> np.ndarray:
    """Colours (N, 3) of relative depths (N,): 0 is untouched; 1 and above is full depth."""
    at = np.clip(np.asarray(share, float), 0.0, 1.0) * (len(_DEPTH_COLOURS) - 1)
    return np.column_stack([np.interp(at, np.arange(len(_DEPTH_COLOURS)), channel) for channel in _DEPTH_COLOURS.T])


def bgr(colour: tuple[float, float, float]) -> tuple[int, int, int]:
    """The colour as 8-bit (blue, green, red) for OpenCV."""
    red, green, blue = (round(255 * c) for c in colour)
    return blue, green, red
