# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The detector of dots and its methods, by name."""
from __future__ import annotations

import numpy as np

from .auto import AutoDetector
from .blobs import BlobDetector
from ...common.dots import Dots
from .discs import DiscDetector
from ...errors import BadArgument, BadFrame
from .likelihood import LikelihoodDetector
from .published import FastCushionDetector, PaperArealDetector, PaperCushionDetector, PaperDetector

POLARITIES = {'dark': -1, 'bright': 1}
_SMALLEST_FRAME = 32  # px, shorter side of a frame. Chosen: the detectors average over boxes of 15 px and more
_LEAST_RANGE = 4  # grey levels; less is a constant frame. Chosen: above the noise of a covered camera


class DotDetector:
    """Detects printed dots. Methods measure the dots' appearance in the first good frame, and again when it changes.

    polarity: 'dark' dots on bright ground or 'bright' ones on dark; method: a name in METHODS. Raises BadArgument for unknown names.
    """

    def __init__(self, polarity: str = 'dark', method: str = 'likelihood'):
        if polarity not in POLARITIES:
            raise BadArgument(f'polarity {polarity!r} is unknown: choose from {", ".join(POLARITIES)}')
        if method not in METHODS:
            raise BadArgument(f'dot detection method {method!r} is unknown: choose from {", ".join(METHODS)}')
        self._method = METHODS[method](POLARITIES[polarity])

    def detect(self, image: np.ndarray) -> Dots:
        """Dots of one image, (H, W) or (H, W, 3) BGR uint8, unordered. Raises BadFrame (wrong type or shape, constant, no dots)."""
        check_frame(image)
        return self._method.detect(image)


def check_frame(image: np.ndarray):
    """Raise BadFrame for an array that is no image of uint8, is too small, or is constant."""
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise BadFrame(f'a frame must be an array of uint8, not {kind}: convert it to mono8 or bgr8')
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise BadFrame(f'a frame must be (rows, columns) or (rows, columns, 3), not {image.shape}')
    if min(image.shape[:2]) < _SMALLEST_FRAME:
        raise BadFrame(f'a frame of {image.shape[1]} x {image.shape[0]} px is too small: at least {_SMALLEST_FRAME} px a side')
    sample = image[::16]
    low, high = int(sample.min()), int(sample.max())
    if high - low < _LEAST_RANGE:
        name = 'black' if high < 8 else 'white' if low > 247 else 'constant'
        raise BadFrame(f'the frame is {name} (grey levels {low} to {high}): check light, lens cap and exposure')


METHODS = {'likelihood': LikelihoodDetector, 'blobs': BlobDetector, 'discs': DiscDetector, 'auto': AutoDetector, 'paper': PaperDetector,
           'paper_areal': PaperArealDetector, 'paper_cushion': PaperCushionDetector, 'paper_cushion_fast': FastCushionDetector}
