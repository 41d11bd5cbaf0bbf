# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the dots of an image are, measured in that image: polarity, colour channel, size, contrast, blur and noise.

Discs are local maxima of a difference of two Gaussians (Lindeberg, Feature detection with automatic scale selection, 1998) that correlate
with a disc on a ring of ground (Lewis, Fast normalized cross-correlation, 1995). A pattern is a set of discs of one sign. The odds of a
disc against a blob of any image are a product of likelihood ratios: of its shape, of its contrast and diameter about those near, and of the
equally spaced lines that it makes with two others. The pattern with the highest product over its discs wins, and is refused below
MIN_LOG_ODDS. Discs that are unlikely by themselves are none of its dots.
"""
from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from math import lgamma

import cv2
import numpy as np

from .. import _core
from ..common.neighbours import Neighbours
from ..core.errors import BadFrame
from .fit import disc_modes

CHANNELS = ('blue', 'green', 'red', 'grey')

_DIAMETERS = 3.0 * 2 ** (np.arange(10) / 2)  # px, of the scale search: up to 68
_ACROSS = 6.0  # px, diameter of a disc in the reduced images: the smallest in which its edge is seen on all sides
_MAX_PEAKS = 4000  # strongest peaks of a scale that are looked at: bounds the time
MIN_CONTRAST = 6.0  # grey levels: print and light, not rounding
_MIN_CONTRAST_SIGMAS = 4.0  # of the noise of a pixel: noise alone shows fewer than six such discs of three px in an image
DARKEST = 20.0  # grey levels: ground that is darker counts as black, of which a dark dot shows no share
OVERLAP = 0.6  # diameters, smallest distance of two dots
_MIN_IRREGULAR = 16  # dots without regular spacing: dust, drops and reflections of one size are fewer
RING = 1.4  # outer diameter of the ring over that of the disc: excludes neighbours down to a pitch of 1.2 diameters

# Likelihoods of one blob as part of a pattern and as one of any image, in decimal logarithms. Any image: counted in photographs, texture,
# noise and gels without markers.
CORRELATIONS = 0.7, 0.85, 0.92  # with a disc: of the blobs of any image 60 % have less than the first, 5 and 1 % more than the others
_SHAPE_ODDS = -0.8, 0.0, 0.7, 1.5  # of worn dots 10 % have less than the first, 60 and 30 % more than the others
_SHAPED = 5.0  # px, diameter: any smaller speck is a disc, which then says nothing
_PRINT = _core.dots.PrintModel()
MIN_DOTS = _PRINT.min_dots
_OWN_ODDS, _OTHER_ODDS = np.log10([2 * _PRINT.own_share, 2 - 2 * _PRINT.own_share])  # of one disc: half of those in any image are such
_LEVELS = 20, 50, 80, 95  # percent of the discs' contrasts, tried as that of the pattern
# Holes of a mesh and fields of a chessboard: squareness from 0.7, wires thinner than the holes. Dots have up to 0.2; markers that are cut,
# or dots of 6 px in a binary image, have up to 0.9, but are farther apart.
_MAX_SQUARENESS, _MESH_PITCH = 0.68, 2.0  # the second in diameters
_GREY_GAIN = 1.25  # of the noise of one channel over that of the mean of three that depend on each other a little
MIN_LOG_ODDS = 9.0  # 3 for the sizes, signs, channels and contrasts that are tried, 6 for one error in a million images

LARGEST_FITTED = 14.0  # px: larger dots are fitted in a reduced image, which bounds the time
_SAMPLE = 120  # dots from which blur and sizes are measured: bounds the time
_STEPS = 4  # of their fit
_MARGIN = 3.5  # px outside a dot's edge that the fit uses
_BLUR, _MIN_BLUR = 0.9, 0.5  # px, start and bound: from a sharper edge, binary images too, the steps of a fit do not converge
_MIN_FITTED = 1.5  # px, diameter
_DAMPING = 0.1  # of the steps of diameter and blur, which look alike in dots of 3 px
_NODES = 2.0  # diameters per px at which the fit is linearised
# Of a disc's contrast, root mean square that its image leaves unexplained, at most, and the share of such discs among dots that are fitted:
# nine of ten printed dots have less than 0.16, worn ones less than 0.27 to 0.5.
_MAX_RESIDUAL, MIN_DISCS = 0.2, 0.9


@dataclass(frozen=True)
class Appearance:
    """Appearance of dots in a frame.

    channel: a name in CHANNELS; step: factor by which the image is reduced; smallest, typical, largest: diameters, px of the reduced
    image; blur: standard deviation, px of the reduced image; contrast (dot minus background), ground (background), noise: grey levels.
    """

    channel: str
    step: int
    smallest: float
    typical: float
    largest: float
    blur: float
    contrast: float
    ground: float
    noise: float


@dataclass
class Peaks:
    """Discs: uv (N, 2) px; correlation (N,), 0 to 1; amplitude, ground (N,): grey levels of disc over ring, and of the ring; diameter
    (N,) px."""

    uv: np.ndarray
    correlation: np.ndarray
    amplitude: np.ndarray
    ground: np.ndarray
    diameter: np.ndarray

    def take(self, some: np.ndarray) -> Peaks:
        """A subset; some: (N,) bool or indices."""
        return Peaks(*(getattr(self, field.name)[some] for field in fields(self)))

    def contrast(self, sign: int) -> np.ndarray:
        """(N,) in grey levels of bright dots; of dark dots, which take a share of the light, in per cent of the ground."""
        return self.amplitude if sign > 0 else 100 * self.amplitude / np.maximum(self.ground, DARKEST)

    def logarithms(self, sign: int) -> np.ndarray:
        """(N, 2) of contrasts and diameters; see KnownDots."""
        return np.log(np.stack([np.maximum(self.contrast(sign), 1), self.diameter], axis=1))


@dataclass(frozen=True)
class Pattern:
    """sign: 1 for bright dots, -1 for dark; diameter: px; contrast: see Peaks; log_odds: decimal, against blobs of any image; uv: (N, 2)
    px, of its discs; regular: the share of their neighbours that have a mirror image."""

    sign: int
    channel: str
    diameter: float
    contrast: float
    log_odds: float
    uv: np.ndarray
    regular: float

    @property
    def pitch(self) -> float:
        """Median distance to the nearest disc, px."""
        return float(np.median(Neighbours(self.uv).query(self.uv, 2)[0][:, 1]))

    def __str__(self) -> str:
        kind, spacing = 'bright' if self.sign > 0 else 'dark', 'regular' if self.regular > 2 * _PRINT.chance else 'irregular'
        return f'{len(self.uv)} {kind} blobs of {self.diameter:.0f} px with {spacing} spacing'


def select_channel(image: np.ndarray, channel: str) -> np.ndarray:
    """(H, W) uint8: one channel of a BGR image, or its grey mean; grey images are returned unchanged."""
    if image.ndim == 2:
        return image
    if channel == 'grey':
        return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return _core.dots.extract_channel(image, CHANNELS.index(channel))


def shrink(grey: np.ndarray, step: int) -> np.ndarray:
    """The image with each block of step x step pixels averaged into one."""
    rows, columns = (side // step for side in grey.shape)  # what is left over at the border would change the scale
    return grey if step == 1 else cv2.resize(grey[:rows * step, :columns * step], (columns, rows), interpolation=cv2.INTER_AREA)


def find_pattern(image: np.ndarray, signs: tuple[int, ...]) -> Pattern:
    """The pattern of dots with the highest odds in an image, (H, W) or (H, W, 3) uint8, of one of the signs. Raises BadFrame without any.

    The grey image is searched first, and colours where it shows no pattern.
    """
    colours = CHANNELS[:-1] if image.ndim == 3 and _is_coloured(image) else ()
    best = None
    for channel in (CHANNELS[-1], *colours):
        if best is None or best.log_odds < MIN_LOG_ODDS:
            best = _best_pattern(image, channel, signs, best)
    if best is None or best.log_odds < MIN_LOG_ODDS:
        seen = 'no blobs' if best is None else f'{best}, odds of 10^{best.log_odds:.0f} against those of any image'
        asked = '' if len(signs) > 1 else 'bright ' if signs[0] > 0 else 'dark '
        raise BadFrame(f'no pattern of {asked}dots: {seen}; is this a sensor without markers? Check light, focus and the parameters '
                       'polarity and mask')
    best = _in_best_channel(image, colours, best)
    if best.diameter >= _SHAPED and best.pitch <= _MESH_PITCH * best.diameter:
        squareness = _squareness(select_channel(image, best.channel), best)
        if squareness > _MAX_SQUARENESS:
            raise BadFrame(f'no pattern of dots: {best}, nearer to squares than to discs (0 for discs, 1 for squares: {squareness:.2f}), '
                           'as in a mesh; is this a sensor without markers? Check the parameters polarity and mask')
    return best


def _squareness(grey, pattern: Pattern) -> float:
    """Fourth moment of the median image of a pattern's blobs, after the linear map that makes its second moments equal: 0 for ellipses,
    and 1 for parallelograms, whose moment is their squared area over 60; a blur that is alike in all directions adds nothing to it."""
    small, scale, across = reduced(grey, pattern.diameter)
    disc, both = _template(round(across, 2))
    half = len(disc) // 2
    column, row = np.clip(np.rint((pattern.uv + 0.5) * scale - 0.5).astype(int), half, np.array(small.shape[::-1]) - 1 - half).T
    patches = pattern.sign * np.lib.stride_tricks.sliding_window_view(small, disc.shape)[row - half, column - half]
    patches = patches - np.median(patches[:, both - disc > 0.5], axis=1)[:, None, None]
    patches /= np.maximum(np.percentile(patches[:, disc > 0.5], 75, axis=1), 1)[:, None, None]
    weight = (np.maximum(np.median(patches, axis=0), 0) * both).ravel()
    area, weight = weight.sum() / weight.max(), weight / weight.sum()
    offset = np.indices(disc.shape).reshape(2, -1).astype(float)
    offset -= (offset @ weight)[:, None]
    root = np.linalg.cholesky(offset * weight @ offset.T)
    x, y = np.linalg.solve(root, offset)
    return float(60 * abs(weight @ (x + 1j * y)**4) * np.linalg.det(root)**2 / area**2)


def find_candidates(image: np.ndarray, sign: int) -> dict[int, Peaks]:
    """Every blob of an image, (H, W) or (H, W, 3) uint8, that could be a dot, alone: by sign, 1 bright, -1 dark; sign 0: both."""
    found, signs = {}, (sign,) if sign else (-1, 1)
    grey = select_channel(image, CHANNELS[-1])
    scales = _all_peaks(grey, signs, _min_contrast(grey))
    for each in signs:
        peaks = merge([scale[each] for scale in scales], OVERLAP * _DIAMETERS[0])
        peaks = peaks.take(peaks.correlation > CORRELATIONS[0])
        if len(peaks.uv):
            apart = OVERLAP * float(np.median(peaks.diameter))
            peaks = peaks.take(without_doubles(peaks.uv, peaks.correlation * peaks.amplitude, apart))
        found[each] = peaks
    return found


def _in_best_channel(image, colours, pattern: Pattern) -> Pattern:
    """The pattern in the channel with the highest contrast; in grey where others have little more, since their noise is independent."""
    strength = {}
    for channel in (*colours, CHANNELS[-1]):
        discs = discs_at(select_channel(image, channel), pattern.sign, pattern.uv, pattern.diameter)
        gain = _GREY_GAIN if channel == CHANNELS[-1] else 1
        strength[channel] = gain * np.median(discs.amplitude * discs.correlation**4), float(np.median(discs.contrast(pattern.sign)))
    best = max(strength, key=strength.get)
    return replace(pattern, channel=best, contrast=strength[best][1])


def _best_pattern(image, channel: str, signs, best: Pattern | None) -> Pattern | None:
    """The one with the highest odds at any scale of a channel, best or a better one. Its discs have diameters within half an octave."""
    grey = select_channel(image, channel)
    limit = _min_contrast(grey)
    scales = _all_peaks(grey, (-1, 1), limit)
    for k, diameter in enumerate(_DIAMETERS[:len(scales)]):
        wanted = [sign for sign in signs if np.count_nonzero(scales[k][sign].correlation > CORRELATIONS[0]) >= MIN_DOTS]
        if wanted:
            found = {sign: merge([scale[sign] for scale in scales[max(k - 1, 0):k + 2]], OVERLAP * diameter) for sign in (-1, 1)}
            for sign in wanted:
                pattern = _pattern_of(found[sign], found[-sign], sign, channel, limit)
                if pattern is not None and (best is None or pattern.log_odds > best.log_odds):
                    best = pattern
    return best


def _all_peaks(grey, signs, limit: float) -> list[dict[int, Peaks]]:
    """Discs of all diameters of the search and a contrast over limit, grey levels, by sign."""
    return [find_peaks(grey, signs, size, limit) for size in _DIAMETERS[MIN_DOTS * _DIAMETERS < min(grey.shape)]]


def _min_contrast(grey) -> float:
    """Contrast from which discs are searched, grey levels."""
    return max(MIN_CONTRAST, _MIN_CONTRAST_SIGMAS * _noise(grey))


def merge(peaks: list[Peaks], apart: float) -> Peaks:
    """All discs, of any two closer than apart, px, the one with the higher product of correlation and amplitude."""
    every = joined_peaks(peaks)
    return every.take(without_doubles(every.uv, every.correlation * every.amplitude, apart))


def joined_peaks(peaks: list[Peaks]) -> Peaks:
    """All discs of several searches."""
    return Peaks(*(np.concatenate([getattr(part, field.name) for part in peaks]) for field in fields(Peaks)))


def without_doubles(uv: np.ndarray, score: np.ndarray, apart: np.ndarray | float) -> np.ndarray:
    """(N,) bool: without the lower score (N,) of any two positions uv (N, 2) px closer than the larger apart, px, of both."""
    return _core.dots.without_doubles(np.ascontiguousarray(uv), score, np.broadcast_to(np.asarray(apart, float), len(uv)))


def _is_coloured(image) -> bool:
    part = image[::8, ::8].astype(np.int16)
    return bool(np.percentile(np.ptp(part, axis=2), 90) > 12)  # grey levels, over noise and white balance


def _pattern_of(found: Peaks, opposite: Peaks, sign: int, channel: str, limit: float) -> Pattern | None:
    """The pattern of highest odds among discs of about one diameter and a contrast over limit, grey levels, over contrasts; None with fewer
    than six discs."""
    contrast, shape = np.log(found.contrast(sign)), np.searchsorted(CORRELATIONS, found.correlation)
    own = own_odds(found.correlation, found.diameter)
    against = np.log(opposite.contrast(sign)[opposite.correlation > CORRELATIONS[0]])
    small = (found.diameter >= _SHAPED).astype(int)  # of these any disc counts, of larger ones such of some roundness
    best = None
    for level in np.unique(np.percentile(contrast[shape > 0], _LEVELS)) if shape.any() else ():
        alike = np.abs(contrast - level) < np.log(2)
        disc = np.flatnonzero(alike & (shape > 0))
        others = np.count_nonzero((shape > small) & (np.abs(contrast - level + 2 * np.log(2)) < np.log(2))) + np.count_nonzero(
            np.abs(against - level) < np.log(2))
        log_odds = own[alike].sum() + _OTHER_ODDS * others
        if len(disc) >= MIN_DOTS and (best is None or log_odds > best[0]):
            best = log_odds, level, disc, others
    if best is None:
        return None
    log_odds, level, disc, others = best
    # Most blobs of a texture are little above the limit, so that their contrasts are alike, too.
    is_clear = np.median(found.amplitude[disc]) > 2 * limit
    logarithms = contrast[disc, None] if is_clear else np.zeros((len(disc), 0))
    dots, odds, known = _core.dots.likely_dots(found.uv[disc], logarithms, own[disc], None)
    count, rejected = np.count_nonzero(dots), np.count_nonzero(~dots)
    log_odds += odds - own[disc].sum() - count * _OWN_ODDS - (rejected + others) * _OTHER_ODDS + _sign_odds(count, rejected + others)
    disc = disc[dots]
    regular = 0.0 if known is None else known.regular
    if len(disc) < (MIN_DOTS if regular > 2 * _PRINT.chance else _MIN_IRREGULAR):
        return None
    return Pattern(sign, channel, float(np.median(found.diameter[disc])), float(np.exp(level)), float(log_odds), found.uv[disc], regular)


def _sign_odds(own: int, others: int) -> float:
    """Decimal log odds of that many discs of the pattern's sign and contrast beside others. In any image the share of discs of a sign is
    the same for all, and uniform from 0 to 1: stars and sparks are bright."""
    by_chance = lgamma(own + 1) + lgamma(others + 1) - lgamma(own + others + 2)
    return float(own * np.log10(_PRINT.own_share) + others * np.log10(1 - _PRINT.own_share) - by_chance / np.log(10))


def own_odds(correlation: np.ndarray, diameter: np.ndarray) -> np.ndarray:
    """Decimal log odds (N,) of blobs of a pattern's sign and contrast by their correlation (N,) with a disc of a diameter (N,), px."""
    shape = np.searchsorted(CORRELATIONS, correlation)
    return np.where(shape > 0, _OWN_ODDS, 0) + np.where((diameter < _SHAPED) & (shape > 0), 0.0, np.take(_SHAPE_ODDS, shape))


def find_peaks(grey: np.ndarray, signs: tuple[int, ...], diameter: float, limit: float = MIN_CONTRAST) -> dict[int, Peaks]:
    """Discs of this diameter, px, and a contrast over limit, grey levels, in an image (H, W) uint8, by sign."""
    small, scale, across = reduced(grey, diameter)
    inner, outer = (cv2.GaussianBlur(small, (0, 0), s * across, borderType=cv2.BORDER_REFLECT) for s in (0.28, 0.5))
    relief, reach, found = inner - outer, max(1, int(0.4 * across)), {}
    for sign in signs:
        search = _core.dots.DiscSearch(sign=sign, margin=int(np.ceil(across / 2)), reach=reach, height=limit / 4, contrast=limit,
                                       correlation=CORRELATIONS[0] / 2, most=_MAX_PEAKS)
        discs = _core.dots.find_discs(small, relief, *_template(round(across, 2)), search)
        found[sign] = Peaks((discs[:, :2] + 0.5) / scale - 0.5, sign * discs[:, 2], sign * discs[:, 3], discs[:, 4],
                            np.full(len(discs), diameter))
    return found


def discs_at(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: np.ndarray | float) -> Peaks:
    """Discs of these diameters (N,), px, or of one, in an image (H, W) uint8, at uv (N, 2) px, whatever is there."""
    diameter, seen = np.broadcast_to(diameter, len(uv)), np.zeros((len(uv), 5))
    small, scale, across = reduced(grey, float(np.median(diameter)) if len(uv) else _ACROSS)
    column, row = np.clip(np.rint((uv + 0.5) * scale - 0.5).astype(int), 0, np.array(small.shape[::-1]) - 1).T
    half_octave = np.rint(2 * np.log2(np.maximum(diameter * scale.mean(), 1) / across))  # in less than a pixel there is no disc
    for each in np.unique(half_octave):
        some = half_octave == each
        seen[some] = _core.dots.discs_at(small, *_template(round(across * 2**(each / 2), 2)), column[some], row[some])
    return Peaks(uv, sign * seen[:, 2], sign * seen[:, 3], seen[:, 4], diameter)


def reduced(grey, diameter, kind=np.float32):
    """The image, of that type, reduced as far as discs of this diameter allow; its scale (2,), and their diameter in it."""
    step = max(int(diameter / _ACROSS), 1)  # first by a whole number, which is fast
    grey = shrink(grey, step)
    full = np.array(grey.shape[::-1])
    size = np.rint(full * min(1.0, _ACROSS * step / diameter)).astype(int)
    small = grey if (size == full).all() else cv2.resize(grey, size.tolist(), interpolation=cv2.INTER_AREA)
    scale = size / full / step
    return small.astype(kind), scale, diameter * float(scale.mean())


@lru_cache(maxsize=64)
def _template(across: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) float32 share of each pixel inside a disc, px across, and inside disc and ring."""
    half, fine = int(np.ceil(RING * across / 2 + 0.5)), 8
    at = (np.arange((2 * half + 1) * fine) + 0.5) / fine - half - 0.5
    away = np.hypot(at[:, None], at)
    blocks = 2 * half + 1, fine, 2 * half + 1, fine
    return tuple((away < radius).reshape(blocks).mean(axis=(1, 3), dtype=np.float32) for radius in (across / 2, RING * across / 2))


def measure_appearance(image: np.ndarray, sign: int) -> Appearance:
    """The appearance of an image's dots; image: (H, W) or (H, W, 3) uint8; sign: 1 for bright dots, -1 for dark ones. Raises BadFrame."""
    return describe_dots(image, find_pattern(image, (sign,)))


def describe_dots(image: np.ndarray, pattern: Pattern, worn: bool = True) -> Appearance:
    """The appearance of the dots of a pattern in an image: diameters, positions, contrasts and grounds of some are fitted by Gauss-Newton
    steps, the blur to all alike. Raises BadFrame where these are no discs; worn: whether most may be worn."""
    grey, step = select_channel(image, pattern.channel), int(np.ceil(pattern.diameter / LARGEST_FITTED))
    noise, grey = _noise(grey) / step, shrink(grey, step)
    typical, uv = pattern.diameter / step, (pattern.uv + 0.5) / step - 0.5
    half = int(np.ceil(typical / 2 + _MARGIN))
    middle = np.rint(uv).astype(int)
    inside = ((middle >= half) & (middle < np.array(grey.shape[::-1]) - half)).all(axis=1)
    sample = np.flatnonzero(inside)
    sample = sample[np.linspace(0, len(sample) - 1, min(len(sample), _SAMPLE)).astype(int)]
    if len(sample) < MIN_DOTS:
        raise BadFrame(f'too few dots: {pattern}, of which {len(sample)} are whole; check that the camera sees the sensor')
    middle, start = middle[sample], (uv - middle)[sample]
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1)
    y, x = np.compress(np.hypot(x, y) < half + 0.5, (y, x), axis=1)
    pixels = grey[middle[:, 1, None] + y, middle[:, 0, None] + x].astype(float)
    position, blur, diameter = start, _BLUR, np.full(len(sample), typical)
    for _ in range(_STEPS):
        solved, residual = _step(pixels, x - position[:, :1], y - position[:, 1:], diameter, blur)
        contrast, change = solved[:, 0], solved[:, 1:5] / np.where(solved[:, :1] == 0, np.inf, solved[:, :1])
        good = (contrast * pattern.sign > MIN_CONTRAST) & (residual < 2 * np.median(residual))
        if good.sum() < MIN_DOTS:
            raise BadFrame(f'no dots: {pattern}, which are not discs; check light, focus and the parameter polarity')
        position = np.clip(position + change[:, :2], start - typical / 2, start + typical / 2)
        diameter = np.clip(diameter + change[:, 2], 0.4 * typical, 1.8 * typical)
        blur = max(blur + float(np.median(change[good, 3])), _MIN_BLUR)
    if not worn and np.mean(residual < _MAX_RESIDUAL) < MIN_DISCS:
        raise BadFrame(f'no dots: {pattern}, of which most are not discs; set detection to auto')
    low, typical, high = (float(size) for size in np.percentile(diameter[good], [2, 50, 98]))
    if typical < _MIN_FITTED:
        raise BadFrame(f'the dots of {typical * step:.1f} px in the frame are too small to be fitted: bring the camera nearer')
    return Appearance(pattern.channel, step, max(0.8 * low, 0.9 * _MIN_FITTED), typical, 1.15 * high, blur,
                      float(np.median(contrast[good])), float(np.clip(np.median(solved[good, 5]), 0, 255)), noise)


def _step(pixels, x, y, diameter, blur) -> tuple[np.ndarray, np.ndarray]:
    """(N, 6) contrast, contrast times changes of u, v, diameter and blur, px, and ground, by least squares; and root mean squares (N,) of
    the rest over the contrast. pixels, x, y: (N, P), at px from the discs' centres."""
    node = np.maximum(np.rint(diameter * _NODES) / _NODES, 1.0)
    rows = np.ones((len(x), 6, x.shape[1]))
    for size in np.unique(node):
        one = node == size
        rows[one, :5] = disc_modes(x[one], y[one], size, blur)[:5].swapaxes(0, 1)
    window = np.clip(diameter[:, None] / 2 + 3 - np.hypot(x, y), 0, 1)
    weighted = rows * window[:, None]
    matrix = weighted @ rows.swapaxes(1, 2) * (1 + np.diag([0, 0, 0, _DAMPING, _DAMPING, 0])) + 1e-6 * np.eye(6)
    solved = np.linalg.solve(matrix, weighted @ pixels[..., None])[..., 0]
    rest = ((pixels - (solved[:, None] @ rows)[:, 0])**2 * window).sum(axis=1) / window.sum(axis=1)
    solved[:, 3] += solved[:, 0] * (node - diameter)  # relative to the diameter before
    return solved, np.sqrt(rest) / np.maximum(np.abs(solved[:, 0]), 1e-3)


def _noise(grey):
    """Standard deviation of pixel noise, grey levels, from the median absolute second difference; at least that of rounding."""
    rows = grey[:len(grey) // 6 * 6].reshape(-1, 6, grey.shape[1])[:, :3].astype(np.int16)  # three of six are as good
    second = np.diff(rows[:, 0] - 2 * rows[:, 1] + rows[:, 2], 2)
    return max(float(np.median(np.abs(second))) / (0.6745 * 6), 0.3)
