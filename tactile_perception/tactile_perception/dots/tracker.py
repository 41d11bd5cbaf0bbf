# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From an image to dots: detection, indexing (or linking), displacement from a reference, and 3D positions."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from .. import _core
from ..common.dots import Dots, DotTracks
from ..core.errors import BadArgument, BadFrame
from .detect import Detector, DotDetector
from .links import Linker
from .number import AUTO, REGISTER, SORT, WITHOUT_GRID, GridNumbering, grid_numbering
from .reference import CalibratedRest, Reference

_JUMPED = 'since the frame before the dots moved by about half their spacing or more'
_SLOWER = 'raise the frame rate, or move more slowly'
_WHITE = 128  # grey levels, from which a pixel of a picture is the sensor: JPEG blurs black and white


class Mask:
    """Keeps detectors to the sensor.

    text: path of an image of the frames' size, white where the sensor is, or the corners x,y,x,y,... of a polygon, px. Raises BadArgument
    for a path without an image, fewer than three corners, and an image without white.
    """

    def __init__(self, text: str):
        self._text, self._corners, self._picture = text, _corners(text), None
        if self._corners is None:
            picture = cv2.imread(text, cv2.IMREAD_GRAYSCALE) if Path(text).is_file() else None
            if picture is None:
                raise BadArgument(f'parameter mask: {text!r} is neither an image file nor a polygon x,y,x,y,... of three corners and more')
            self._picture = (picture >= _WHITE).astype(np.uint8)
            if not self._picture.any():
                raise BadArgument(f'parameter mask: {text} has no white, which marks the sensor')
        self._inside, self._depth = None, None  # (H, W) uint8, and px from each pixel to the nearest outside

    def applied(self, image: np.ndarray) -> np.ndarray:
        """The image, uint8 (H, W) or (H, W, 3), with an even ground around the sensor, of the sensor's mean. Raises BadFrame for another
        size than the mask's, and where a polygon leaves nothing."""
        if self._inside is None or self._inside.shape != image.shape[:2]:
            self._inside = self._drawn(image.shape[:2])
            self._depth = cv2.distanceTransform(self._inside, cv2.DIST_L2, 5)
        ground = np.empty_like(image)
        ground[:] = np.rint(cv2.mean(image, self._inside)[:image.shape[2] if image.ndim == 3 else 1]).astype(np.uint8)
        return cv2.copyTo(image, self._inside, ground)

    def kept(self, dots: Dots) -> Dots:
        """Those of the dots in the applied image that lie within the mask as a whole; at its border some are cut."""
        column, row = np.rint(dots.uv).astype(int).clip(0, np.array(self._inside.shape[::-1]) - 1).T
        whole = self._depth[row, column] > np.sqrt(dots.area / np.pi)
        return dots.take(whole)

    def outlines(self, shape: tuple[int, int]) -> list[np.ndarray]:
        """The borders, (N, 2) px each, of what is kept of an image of shape (H, W). Raises BadFrame as `applied`."""
        return [ring[:, 0] for ring in cv2.findContours(self._drawn(shape), cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)[0]]

    def _drawn(self, shape: tuple[int, int]) -> np.ndarray:
        size = f'{shape[1]} x {shape[0]} px'
        if self._picture is None:
            drawn = cv2.fillPoly(np.zeros(shape, np.uint8), [np.rint(self._corners).astype(np.int32)], 1)
            if not drawn.any():
                raise BadFrame(f'parameter mask: the polygon {self._text} lies outside the images of {size}')
            return drawn
        if self._picture.shape != shape:
            rows, columns = self._picture.shape
            raise BadFrame(f'parameter mask: {self._text} is {columns} x {rows} px, the images are {size}; draw it on one of them')
        return self._picture


def _corners(text: str) -> np.ndarray | None:
    """(N, 2) px of 'x,y,x,y,...'; None for what is no list of numbers. Raises BadArgument for too few or an odd number."""
    try:
        numbers = np.array([float(word) for word in text.split(',')])
    except ValueError:
        return None
    if len(numbers) < 6 or len(numbers) % 2 or not (np.abs(numbers) < 1e6).all():
        raise BadArgument(f'parameter mask: a polygon needs three corners and more, x,y,x,y,x,y,... in px, not {text!r}')
    return numbers.reshape(-1, 2)


@dataclass(frozen=True)
class DotOptions:
    """What dots are tracked.

    rows, columns: size of the printed grid, both 0 for an irregular pattern; polarity: a name in detect.POLARITIES; detection: a name in
    detect.METHODS; numbering: a name in number.METHODS or WITHOUT_GRID (without a grid, a grid method's name selects 'tracks'), or AUTO:
    rows and columns that are 0 are those of the first frame's dots where these form a grid; pattern: (K, 2) px, positions of a pattern to
    register, the first frame's dots by default; mask: what of the image shows the sensor, None for all.
    """

    rows: int = 0
    columns: int = 0
    polarity: str = 'dark'
    detection: str = 'likelihood'
    numbering: str = 'lattice'
    pattern: np.ndarray | None = None
    mask: Mask | None = None


class DotTracker:
    """Tracks the dots of one camera frame by frame.

    detector: replaces the one that the options name; reference: Reference() by default; as_tracks: a Reference of dots that are reported as
    tracks while their positions on the grid are not certain, None to refuse such frames; positions: 3D positions of the dots, an object
    with locate(image, tracks, stamp_s) -> (N, 3) m in the sensor frame, NaN: unknown, warning, why there are none, '', and reset(), which
    drops what depends on the reference; seam: px, column of an image stitched from two cameras beyond which the right one sees. Raises
    BadArgument for unknown names and bad sizes.

    unnumbered: why the dots of the last frame have no numbers, and what would help; ''.
    """

    def __init__(self, options: DotOptions = DotOptions(), detector: Detector | None = None, reference: Reference | None = None,
                 as_tracks: Reference | None = None, positions=None, seam: float | None = None):
        rows, columns, numbering = options.rows, options.columns, options.numbering
        if not (rows == columns == 0 or (rows >= 2 and columns >= 2)):
            raise BadArgument(f'rows and columns must both be 0 (no grid) or at least 2, not {rows} and {columns}')
        self.rows, self.columns = rows, columns
        self.reference = Reference() if reference is None else reference
        self._detector = DotDetector(options.polarity, options.detection) if detector is None else detector
        self._mask, self._positions, self._seam = options.mask, positions, seam
        self._auto = self._search_grid = numbering == AUTO and not rows
        self._name, self._changed = 'lattice' if numbering == AUTO else numbering, ''
        self._numbering = self._make_numbering(self._name, options.pattern)
        self._linker, self._track_reference = Linker(), as_tracks
        self.unnumbered = ''
        self._stamp_s = -np.inf
        self._size: tuple | None = None

    def _make_numbering(self, name: str, pattern: np.ndarray | None):
        if self.rows:
            return grid_numbering(name, self.rows, self.columns)
        if name not in WITHOUT_GRID:
            grid_numbering(name, 2, 2)  # an unknown name is refused
        return WITHOUT_GRID.get(name, WITHOUT_GRID['tracks'])(pattern)

    def set_reference(self) -> None:
        """Use the next frame as the untouched reference."""
        self._changed = ''
        self.reference.reset()
        if self._track_reference is not None:
            self._track_reference.reset()
        if self._positions is not None:
            self._positions.reset()

    def _start_again(self, stamp_s: float) -> None:
        """Take a new reference, of dots whose appearance was measured again."""
        self.set_reference()
        self._changed = (f'at {stamp_s:.1f} s the dots no longer looked as before; their appearance was measured again '
                         f'({self._detector.found or "other dots"}) and a new reference taken. Release the sensor, then call set_reference')
        if self._auto:
            self.rows, self.columns, self._search_grid = 0, 0, True
        elif self.rows:
            self._numbering = self._make_numbering(self._name, None)

    @property
    def positions(self):
        """The object that estimates the dots' 3D positions; None without one."""
        return self._positions

    @property
    def warning(self) -> str:
        """Why the reference may not show the untouched sensor, or why the last image has no 3D positions; ''."""
        return self.reference.warning or self._changed or (self._positions.warning if self._positions is not None else '')

    @property
    def jumps(self) -> str:
        """How many dots got no link so far, and how many frames were far apart; '' where they have grid numbers, which need no links."""
        if self.rows and not self.unnumbered:
            return ''
        lost, far = self.links.lost, self.links.far
        return f'{lost} dots not linked, {far} frames more than half a spacing apart; {_SLOWER}' if lost or far else ''

    @property
    def found(self) -> str:
        """What is tracked, as a person would say it: '165 bright dots of 9 px, no grid'; '' before the first frame."""
        if self._size is None:
            return ''
        grid = f'grid of {self.rows} x {self.columns}' if self.rows else 'no grid'
        return f'{self._detector.found or "dots"}, {grid}'

    def process(self, image: np.ndarray, stamp_s: float, touched: bool | None = None) -> DotTracks:
        """Indexed dots of an image, and their 3D positions; dots without a certain index are left out.

        image: uint8 (H, W) or (H, W, 3) BGR; stamp_s: exposure time, s; touched: whether a later stage detected contact, None if unknown.
        Raises BadFrame for a bad image or stamp, and when no dot can be indexed with certainty; a bad frame leaves the tracker unchanged.
        """
        self._check(image, stamp_s)
        if self._seam is not None and not self.reference.taken and not self._shows_both(image):
            raise BadFrame('one of the two views is black: both must be there when the reference is taken; check its camera or topic')
        dots = self._detect(image, stamp_s)
        loose = self._track_reference is not None and self.rows
        track = self._link(self._linker, dots, stamp_s, image.shape[1::-1]) if loose else None
        try:
            id, self.unnumbered = self._number(dots, stamp_s, image.shape[1::-1]), ''
        except BadFrame as error:
            if not loose:
                raise
            id, self.unnumbered = None, f'{error}. Until then dots are tracks without grid numbers'
        self._stamp_s, self._size = stamp_s, image.shape
        tracks = self._displaced(dots, track, stamp_s, (0, 0), self._track_reference, touched) if loose else None
        if id is not None:
            tracks = self._displaced(dots, id, stamp_s, (self.rows, self.columns), self.reference, touched)
        if self._positions is not None:
            tracks.xyz = self._positions.locate(image, tracks, stamp_s)
        return tracks

    def _shows_both(self, image: np.ndarray) -> bool:
        """Whether a stitched image shows both views; the half of a view that is missing is black."""
        seam = round(self._seam)
        return bool(image[:, :seam].any() and image[:, seam + 1:].any())

    def _detect(self, image, stamp_s):
        measured = self._detector.measured
        dots = _detected(self._detector, self._mask, image)
        if not len(dots):
            raise BadFrame('no dots found: check light, the parameters polarity and mask, and the view')
        if 0 < measured < self._detector.measured:
            self._start_again(stamp_s)
        if self._search_grid:
            self.rows, self.columns = _core.dots.find_grid(dots.uv)
            self._numbering = GridNumbering(self.rows, self.columns, is_whole=False) if self.rows else self._linker
            self._search_grid = False
        return dots

    def _displaced(self, dots, id, stamp_s, grid, reference, touched) -> DotTracks:
        """Tracks of those dots that have an id (N,), in the order of their ids; of a print that nobody described those that have moved as
        their neighbours have."""
        seen = np.argsort(id)[np.count_nonzero(id < 0):]
        id, uv, sigma = id[seen], dots.uv.take(seen, axis=0), dots.sigma[seen]
        tracks = DotTracks(*grid, id, uv, dots.area[seen], sigma, reference.update(id, uv, sigma, stamp_s, grid[1], touched))
        if not self._auto:
            return tracks
        kept, known = np.ones(len(id), bool), np.isfinite(tracks.duv[:, 0])
        kept[known] = _core.dots.continuous(tracks.rest_uv[known], uv[known])
        self.links.lost += np.count_nonzero(~kept)
        return tracks.take(kept)

    def _check(self, image: np.ndarray, stamp_s: float) -> None:
        if not isinstance(image, np.ndarray) or image.dtype != np.uint8 or image.ndim not in (2, 3) or not image.size:
            raise BadFrame('the image must be a non-empty uint8 array with two or three dimensions')
        if self._size is not None and image.shape != self._size:
            raise BadFrame(f'the image changed its shape from {self._size} to {image.shape}; start a new tracker for another size')
        if not self._stamp_s < stamp_s < np.inf:
            raise BadFrame(f'stamp {stamp_s} s is not finite or not later than the last one, {self._stamp_s} s')

    @property
    def _is_linked(self) -> bool:
        return isinstance(self._numbering, Linker)

    @property
    def links(self) -> Linker:
        """The tracks of dots without grid numbers."""
        return self._numbering if self._is_linked else self._linker

    def _link(self, numbering, dots: Dots, stamp_s: float, size: tuple) -> np.ndarray:
        restarts = self.links.restarts
        id = numbering.update(dots, stamp_s, size)
        if self.links.restarts > restarts and numbering is not self._numbering:
            self._track_reference.reset()
        elif self.links.restarts > restarts:
            self.set_reference()
            self._changed = (f'at {stamp_s:.1f} s all dots were new: those before could not be followed, and a new reference was taken. '
                             'Release the sensor, then call set_reference')
        return id

    def _number(self, dots: Dots, stamp_s: float, size: tuple) -> np.ndarray:
        if not self.rows:
            id = self._link(self._numbering, dots, stamp_s, size)
            if not (id >= 0).any():
                reason = f'{_JUMPED}, so that each could be its neighbour; {_SLOWER}' if self._is_linked else 'too few match the pattern'
                raise BadFrame(f'dots not indexed: {reason}')
            return id
        numbers = self._numbering.number(dots.uv, *size)
        if numbers.reason:
            hint = '' if self.reference.taken else '; check the parameters polarity, rows and columns'
            raise BadFrame(f'dots not indexed: {numbers.reason}{hint}')
        return numbers.id


def tracker_options(values: Mapping, pattern: np.ndarray | None = None, rest: np.ndarray | None = None,
                    image_only: bool = False) -> dict:
    """Arguments of a DotTracker with the given parameters.

    values: of DOT_PARAMETERS; pattern: (K, 2) px, untouched image positions whose order gives the ids of an irregular pattern; rest: (K, 2)
    px, calibrated untouched positions, used to detect contact in the first frame; image_only: no later stage needs grid numbers, so that
    dots without are tracks.
    """
    known = None if rest is None else CalibratedRest(rest)
    constants = values['reference.time_constant'], values['reference.frames']
    numbering = values['numbering'] if pattern is None or values['numbering'] == SORT else REGISTER
    return {'options': DotOptions(values['rows'], values['columns'], values['polarity'], values['detection'], numbering, pattern,
                                  _mask_of(values)),
            'reference': Reference(*constants, known), 'as_tracks': Reference(*constants) if image_only else None}


def make_tracker(*given, **known) -> DotTracker:
    """A tracker with the given parameters; see tracker_options."""
    return DotTracker(**tracker_options(*given, **known))


def _mask_of(values: Mapping) -> Mask | None:
    return Mask(values['mask']) if values['mask'] else None


def _detected(detector, mask: Mask | None, image: np.ndarray) -> Dots:
    """The dots of a checked image, those within the mask."""
    return detector.detect(image) if mask is None else mask.kept(detector.detect(mask.applied(image)))


def find_pattern(image: np.ndarray, values: Mapping) -> np.ndarray:
    """(K, 2) px, image positions of the dots of the untouched sensor, from top to bottom. Raises BadFrame if there are none."""
    uv = _detected(DotDetector(values['polarity'], values['detection']), _mask_of(values), image).uv
    return uv[np.argsort(uv[:, 1])]
