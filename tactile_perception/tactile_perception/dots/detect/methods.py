# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dots in an image: the detector that the rest stands on, and the table of methods it can use."""
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
_SMALLEST_FRAME = 32  # px


class DotDetector:
    """Finds printed dots; what they look like is measured in the first good frame and again when they stop looking so.

    polarity: 'dark' dots on bright ground or 'bright' ones on dark; method: a name in METHODS. Raises BadArgument for other names.
    """

    def __init__(self, polarity: str = 'dark', method: str = 'likelihood'):
        if polarity not in POLARITIES:
            raise BadArgument(f'polarity {polarity!r} is unknown: choose from {", ".join(POLARITIES)}')
        if method not in METHODS:
            raise BadArgument(f'dot detection method {method!r} is unknown: choose from {", ".join(METHODS)}')
        self._method = METHODS[method](POLARITIES[polarity])

    def detect(self, image: np.ndarray) -> Dots:
        """The dots of one image, (H, W) or (H, W, 3) BGR uint8, in no order. Raises BadFrame (black, white, constant, no dots, wrong type
        or shape)."""
        check_frame(image)
        return self._method.detect(image)

    @property
    def can_refind(self) -> bool:
        """Whether the method looks for dots where they are expected."""
        return hasattr(self._method, 'refind')

    def refind(self, image: np.ndarray, uv: np.ndarray, area: np.ndarray) -> tuple[Dots, np.ndarray] | None:
        """The dots that are within about a pixel and a half of expected places uv (N, 2) px, of about these areas (N,) px^2, and which of
        the places each is at, (M,) int64; the same as detect() finds there, but sooner. None where the method cannot, or has not yet seen
        what dots look like. Raises BadFrame."""
        check_frame(image)
        return self._method.refind(image, uv, area) if self.can_refind else None


def check_frame(image: np.ndarray):
    """Raise BadFrame, saying why, unless this is a picture that may hold dots."""
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise BadFrame(f'a frame must be an array of uint8, this is {kind}: convert it to mono8 or bgr8')
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        raise BadFrame(f'a frame must be (rows, columns) or (rows, columns, 3), this is {image.shape}')
    if min(image.shape[:2]) < _SMALLEST_FRAME:
        raise BadFrame(f'a frame of {image.shape[1]} x {image.shape[0]} px is too small for dots: at least {_SMALLEST_FRAME} px a side')
    sample = image[::16]
    low, high = int(sample.min()), int(sample.max())
    if high - low < 4:
        name = 'black' if high < 8 else 'white' if low > 247 else 'constant'
        raise BadFrame(f'the frame is {name} (grey levels {low} to {high}): check light, lens cap and exposure')


METHODS = {'likelihood': LikelihoodDetector, 'blobs': BlobDetector, 'discs': DiscDetector, 'auto': AutoDetector, 'paper': PaperDetector,
           'paper_areal': PaperArealDetector, 'paper_cushion': PaperCushionDetector, 'paper_cushion_fast': FastCushionDetector}
