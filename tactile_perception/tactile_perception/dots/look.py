# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the dots of an image are, measured in that image: polarity, colour channel, size, contrast, blur and noise.

Discs are local maxima of a difference of two Gaussians (Lindeberg, Feature detection with automatic scale selection, 1998) that correlate
with a disc on a ring of ground (Lewis, Fast normalized cross-correlation, 1995). A pattern is a set of discs of one size, sign and
contrast. Its odds against the blobs that any image has are a product over these discs, of likelihood ratios of shape, contrast and
spacing; the pattern with the highest odds wins, and is refused below MIN_LOG_ODDS.
"""
from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache

import cv2
import numpy as np

from ..common.neighbours import Neighbours
from ..errors import BadFrame
from .fit import disc_modes

CHANNELS = ('blue', 'green', 'red', 'grey')

_DIAMETERS = 3.0 * 2 ** (np.arange(10) / 2)  # px, of the scale search: up to 68
_ACROSS = 7.0  # px, diameter of a disc in the reduced images: the smallest in which its edge is seen on all sides
_MAX_PEAKS = 4000  # strongest peaks of a scale that are looked at: bounds the time
_MIN_ACROSS = 8.0  # diameters, smaller side of the image: four dots two diameters apart
MIN_CONTRAST = 6.0  # grey levels: print and light, not rounding
_MIN_CONTRAST_SIGMAS = 4.0  # of the noise of a pixel: noise alone shows fewer than six such discs of three px in an image
DARKEST = 20.0  # grey levels: ground that is darker counts as black, of which a dark dot shows no share
OVERLAP = 0.6  # diameters, smallest distance of two dots
MIN_DOTS = 6  # the corners of a square are four
_MIN_IRREGULAR = 16  # dots without regular spacing: dust, drops and reflections of one size are fewer
RING = 1.4  # outer diameter of the ring over that of the disc: excludes neighbours down to a pitch of 1.2 diameters
_NOISE = 1.0  # grey levels, regularises the normalisation of flat regions

# Likelihoods of one blob as part of a pattern and as one of any image, in decimal logarithms. Any image: counted in photographs, texture,
# noise and gels without markers.
CORRELATIONS = 0.7, 0.85, 0.92  # with a disc: of the blobs of any image 60 % have less than the first, 5 and 1 % more than the others
_SHAPE_ODDS = -0.8, 0.0, 0.7, 1.5  # of worn dots 10 % have less than the first, 60 and 30 % more than the others
_SHAPED = 5.0  # px, diameter: any smaller speck is a disc, which then says nothing
# Of a disc with the sign and contrast of the pattern, and of one of the other sign or half as strong: in any image half of the discs, in a
# print 98 % and 2 %.
_OWN_ODDS, _OTHER_ODDS = 0.29, -1.4
_LEVELS = 20, 50, 80, 95  # percent of the discs' contrasts, tried as that of the pattern
_CONTRAST_SIGMA = 0.25  # of the logarithm of a dot's contrast about its neighbours'; in any image it is uniform within a factor of two
_NEIGHBOURS, _MIRRORED = 4, 0.2  # of which a regular pattern has a mirror image, within so much of the distance
_CHANCE = 0.15  # of that without regularity: the area searched, times the density of dots
MIN_LOG_ODDS = 13.0  # of which 3 pay for the sizes, signs, channels and contrasts that are tried

LARGEST_FITTED = 14.0  # px: larger dots are fitted in a reduced image, which bounds the time
_SAMPLE = 50  # dots from which blur and sizes are measured: bounds the time
_STEPS = 5  # of their fit
_BLUR, _MIN_BLUR = 0.9, 0.2  # px, start and bound
_MIN_FITTED = 1.5  # px, diameter
_MAX_MOVE, _MAX_GROWTH, _MAX_BLUR_STEP = 1.0, 0.15, 0.3  # of one step: px, diameters, px
_NODES = 4.0  # diameters per px at which the fit is linearised


@dataclass(frozen=True)
class Look:
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

    def __str__(self) -> str:
        kind, spacing = 'bright' if self.sign > 0 else 'dark', 'regular' if self.regular > 2 * _CHANCE else 'irregular'
        return f'{len(self.uv)} {kind} blobs of {self.diameter:.0f} px with {spacing} spacing'


def select_channel(image: np.ndarray, channel: str) -> np.ndarray:
    """(H, W) uint8: one channel of a BGR image, or its grey mean; grey images are returned unchanged."""
    if image.ndim == 2:
        return image
    if channel == 'grey':
        return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return cv2.extractChannel(image, CHANNELS.index(channel))


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
    return _in_best_channel(image, colours, best)


def _in_best_channel(image, colours, pattern: Pattern) -> Pattern:
    """The pattern in the channel with the highest contrast in grey levels."""
    contrast = {}
    for channel in (*colours, CHANNELS[-1]):
        discs = discs_at(select_channel(image, channel), pattern.sign, pattern.uv, pattern.diameter)
        contrast[channel] = np.median(discs.amplitude * discs.correlation**4), float(np.median(discs.contrast(pattern.sign)))
    best = max(contrast, key=lambda channel: contrast[channel][0])
    return replace(pattern, channel=best, contrast=contrast[best][1])


def _best_pattern(image, channel: str, signs, best: Pattern | None) -> Pattern | None:
    """The one with the highest odds at any scale of a channel, best or a better one. Its discs have diameters within half an octave."""
    grey = select_channel(image, channel)
    limit = max(MIN_CONTRAST, _MIN_CONTRAST_SIGMAS * _noise(grey))
    scales = [find_peaks(grey, (-1, 1), size, limit) for size in _DIAMETERS[_MIN_ACROSS * _DIAMETERS < min(grey.shape)]]
    for k, diameter in enumerate(_DIAMETERS[:len(scales)]):
        for sign in signs:
            if np.count_nonzero(scales[k][sign].correlation > CORRELATIONS[0]) >= MIN_DOTS:
                found = merge([scale[sign] for scale in scales[max(k - 1, 0):k + 2]], OVERLAP * diameter)
                pattern = _pattern_of(found, scales[k][-sign], sign, channel)
                if pattern is not None and (best is None or pattern.log_odds > best.log_odds):
                    best = pattern
    return best


def merge(peaks: list[Peaks], apart: float) -> Peaks:
    """All discs, of any two closer than apart, px, the one with the higher product of correlation and amplitude."""
    every = Peaks(*(np.concatenate([getattr(part, field.name) for part in peaks]) for field in fields(Peaks)))
    return every.take(without_doubles(every.uv, every.correlation * every.amplitude, apart))


def without_doubles(uv: np.ndarray, score: np.ndarray, apart: float) -> np.ndarray:
    """(N,) bool: without the lower score (N,) of any two positions uv (N, 2) px closer than apart, px."""
    first, second = Neighbours(uv).pairs_within(apart)
    kept = np.ones(len(uv), bool)
    kept[np.where(score[first] < score[second], first, second)] = False
    return kept


def _is_coloured(image) -> bool:
    part = image[::8, ::8].astype(np.int16)
    return bool(np.percentile(np.ptp(part, axis=2), 90) > 12)  # grey levels, over noise and white balance


def _pattern_of(found: Peaks, opposite: Peaks, sign: int, channel: str) -> Pattern | None:
    """The pattern of highest odds among discs of about one diameter, over contrasts; None with fewer than six discs."""
    contrast, shape = np.log(found.contrast(sign)), np.searchsorted(CORRELATIONS, found.correlation)
    shape_odds = np.where((found.diameter < _SHAPED) & (shape > 0), 0.0, np.take(_SHAPE_ODDS, shape))
    against = np.log(opposite.contrast(sign)[opposite.correlation > CORRELATIONS[0]])
    small = (found.diameter >= _SHAPED).astype(int)  # of these any disc counts, of larger ones such of some roundness
    best = None
    for level in np.unique(np.percentile(contrast[shape > 0], _LEVELS)) if shape.any() else ():
        alike = np.abs(contrast - level) < np.log(2)
        disc = np.flatnonzero(alike & (shape > 0))
        if len(disc) < MIN_DOTS:
            continue
        others = np.count_nonzero((shape > small) & (np.abs(contrast - level + 2 * np.log(2)) < np.log(2))) + np.count_nonzero(
            np.abs(against - level) < np.log(2))
        log_odds = shape_odds[alike].sum() + _OWN_ODDS * len(disc) + _OTHER_ODDS * others
        spacing, regular = _spacing_odds(found.uv[disc], contrast[disc])
        if len(disc) >= (MIN_DOTS if regular > 2 * _CHANCE else _MIN_IRREGULAR) and (best is None or log_odds + spacing > best.log_odds):
            best = Pattern(sign, channel, float(np.median(found.diameter[disc])), float(np.exp(level)), float(log_odds + spacing),
                           found.uv[disc], regular)
    return best


def _spacing_odds(uv, contrast) -> tuple[float, float]:
    """Decimal logarithm of the odds of contrasts (N,), logarithms, and positions uv (N, 2) px of dots, by those of their neighbours; and
    the share of neighbours that have a mirror image."""
    count = min(_NEIGHBOURS, len(uv) - 1)
    tree = Neighbours(uv)
    distance, near = tree.query(uv, (2 * count if len(uv) > 2 * count else count) + 1)
    away = contrast - np.median(contrast[near], axis=1)
    alike = np.log10(2 * np.log(2) / (np.sqrt(2 * np.pi) * _CONTRAST_SIGMA)) - away**2 / (2 * _CONTRAST_SIGMA**2 * np.log(10))
    near, distance = near[:, 1:count + 1], distance[:, 1:count + 1]
    nearest = tree.query((2 * uv[:, None] - uv[near]).reshape(-1, 2))[0]
    mirrored = np.count_nonzero(nearest < _MIRRORED * distance.ravel())
    by_chance = _binomial_tail(mirrored, near.size, _CHANCE)
    return float(alike.sum() - np.log10(max(by_chance, 1e-300))), mirrored / near.size


def _binomial_tail(successes: int, trials: int, probability: float) -> float:
    """Probability of at least so many successes."""
    count = np.arange(successes, trials + 1)
    factorials = np.cumsum(np.log(np.maximum(np.arange(trials + 1), 1)))
    log_ways = factorials[trials] - factorials[count] - factorials[trials - count]
    return float(np.exp(log_ways + count * np.log(probability) + (trials - count) * np.log1p(-probability)).sum())


def find_peaks(grey: np.ndarray, signs: tuple[int, ...], diameter: float, limit: float = MIN_CONTRAST) -> dict[int, Peaks]:
    """Discs of this diameter, px, and a contrast over limit, grey levels, in an image (H, W) uint8, by sign."""
    small, scale, across = _reduced(grey, diameter)
    inner, outer = (cv2.GaussianBlur(small, (0, 0), s * across, borderType=cv2.BORDER_REFLECT) for s in (0.28, 0.5))
    relief = inner - outer
    reach = max(1, int(0.4 * across))
    margin, found = int(np.ceil(across / 2)), {}
    square = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    for sign in signs:
        rise = relief if sign > 0 else -relief
        is_peak = (rise >= np.maximum(cv2.dilate(rise, square), limit / 4))[margin:-margin, margin:-margin]
        row, column = np.divmod(np.flatnonzero(is_peak), is_peak.shape[1])
        row, column = row + margin, column + margin
        if len(row) > _MAX_PEAKS:
            kept = np.argpartition(-rise[row, column], _MAX_PEAKS)[:_MAX_PEAKS]
            row, column = row[kept], column[kept]
        correlation, amplitude, ground = _correlate_patches(small, sign, column, row, across)
        good = (correlation > CORRELATIONS[0] / 2) & (amplitude > limit)
        uv = (np.stack([column, row], axis=1)[good] + 0.5) / scale - 0.5
        found[sign] = Peaks(uv, *(values[good].astype(float) for values in (correlation, amplitude, ground)), np.full(len(uv), diameter))
    return found


def discs_at(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> Peaks:
    """Discs of this diameter, px, in an image (H, W) uint8, at uv (N, 2) px, whatever is there."""
    small, scale, across = _reduced(grey, diameter)
    column, row = np.clip(np.rint((uv + 0.5) * scale - 0.5).astype(int), 0, np.array(small.shape[::-1]) - 1).T
    return Peaks(uv, *_correlate_patches(small, sign, column, row, across), np.full(len(uv), diameter))


def _reduced(grey, diameter):
    """The image, float32, reduced as far as discs of this diameter allow; its scale (2,), and their diameter in it."""
    factor = min(1.0, _ACROSS / diameter)
    small = grey if factor == 1 else cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    scale = np.array([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0]])
    return small.astype(np.float32), scale, diameter * float(scale.mean())


@lru_cache(maxsize=64)
def _template(across: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, n) float32 share of each pixel inside a disc, px across, and inside disc and ring."""
    half, fine = int(np.ceil(RING * across / 2 + 0.5)), 8
    at = (np.arange((2 * half + 1) * fine) + 0.5) / fine - half - 0.5
    away = np.hypot(at[:, None], at)
    blocks = 2 * half + 1, fine, 2 * half + 1, fine
    return tuple((away < radius).reshape(blocks).mean(axis=(1, 3)).astype(np.float32) for radius in (across / 2, RING * across / 2))


def _correlate_patches(image, sign: int, column: np.ndarray, row: np.ndarray, across: float) -> tuple[np.ndarray, ...]:
    """Normalised correlation, amplitude and ground (N,) of a disc, px across, on a ring, at pixels of an image (H, W) float32."""
    disc, both = _template(round(across, 2))
    half = len(disc) // 2
    padded = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_REFLECT)
    patches = np.lib.stride_tricks.sliding_window_view(padded, disc.shape)[row, column].reshape(len(row), disc.size)
    contrast, weight = (disc - both * (disc.sum() / both.sum())).ravel(), both.ravel()
    product, norm = patches @ contrast, float((contrast**2).sum())
    mean = patches @ weight / weight.sum()
    variance = np.maximum((patches - mean[:, None])**2 @ weight, 0) + weight.sum() * _NOISE**2
    return sign * product / np.sqrt(variance * norm), sign * product / norm, mean - product / norm * (disc.sum() / both.sum())


def measure_look(image: np.ndarray, sign: int) -> Look:
    """The look of an image's dots; image: (H, W) or (H, W, 3) uint8; sign: 1 for bright dots, -1 for dark ones. Raises BadFrame."""
    return describe_dots(image, find_pattern(image, (sign,)))


def describe_dots(image: np.ndarray, pattern: Pattern) -> Look:
    """The look of the dots of a pattern in an image: their diameters, positions, contrasts and grounds are fitted by Gauss-Newton steps to
    some of them, the blur to all alike. Raises BadFrame where these are no discs."""
    grey, step = select_channel(image, pattern.channel), int(np.ceil(pattern.diameter / LARGEST_FITTED))
    noise, grey = _noise(grey) / step, shrink(grey, step)
    typical, uv = pattern.diameter / step, (pattern.uv + 0.5) / step - 0.5
    half = int(np.ceil(0.75 * typical + 2.5))
    middle = np.rint(uv).astype(int)
    inside = ((middle >= half) & (middle < np.array(grey.shape[::-1]) - half)).all(axis=1)
    chosen = np.flatnonzero(inside)[::max(1, int(inside.sum() / _SAMPLE))]
    if len(chosen) < MIN_DOTS:
        raise BadFrame(f'too few dots: {pattern}, of which {len(chosen)} are whole; check that the camera sees the sensor')
    middle, place = middle[chosen], (uv - middle)[chosen]
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1)
    pixels = grey[middle[:, 1, None] + y, middle[:, 0, None] + x].astype(float)
    blur, diameter = _BLUR, np.full(len(chosen), typical)
    for _ in range(_STEPS):
        solved, residual = _step(pixels, x - place[:, :1], y - place[:, 1:], diameter, blur)
        contrast, change = solved[:, 0], solved[:, 1:5] / np.where(solved[:, :1] == 0, np.inf, solved[:, :1])
        good = (contrast * pattern.sign > MIN_CONTRAST) & (residual < 2 * np.median(residual))
        if good.sum() < MIN_DOTS:
            raise BadFrame(f'no dots: {pattern}, which are not discs; check light, focus and the parameter polarity')
        place = place + np.clip(change[:, :2], -_MAX_MOVE, _MAX_MOVE)
        diameter = np.clip(diameter + np.clip(change[:, 2], -_MAX_GROWTH * typical, _MAX_GROWTH * typical), 0.4 * typical, 1.8 * typical)
        blur = max(blur + float(np.clip(np.median(change[good, 3]), -_MAX_BLUR_STEP, _MAX_BLUR_STEP)), _MIN_BLUR)
    low, typical, high = (float(size) for size in np.percentile(diameter[good], [2, 50, 98]))
    if typical < _MIN_FITTED:
        raise BadFrame(f'the dots of {typical * step:.1f} px in the frame are too small to be fitted: bring the camera nearer')
    return Look(pattern.channel, step, max(0.8 * low, 0.9 * _MIN_FITTED), typical, 1.15 * high, blur, float(np.median(contrast[good])),
                float(np.clip(np.median(solved[good, 5]), 0, 255)), noise)


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
    matrix = weighted @ rows.swapaxes(1, 2) + 1e-6 * np.eye(6)
    solved = np.linalg.solve(matrix, weighted @ pixels[..., None])[..., 0]
    rest = ((pixels - (solved[:, None] @ rows)[:, 0])**2 * window).sum(axis=1) / window.sum(axis=1)
    solved[:, 3] += solved[:, 0] * (node - diameter)  # relative to the diameter before
    return solved, np.sqrt(rest) / np.maximum(np.abs(solved[:, 0]), 1e-3)


def _noise(grey):
    """Standard deviation of pixel noise, grey levels, from the median absolute second difference; at least that of rounding."""
    rows = grey[:len(grey) // 6 * 6].reshape(-1, 6, grey.shape[1])[:, :3].astype(np.int16)  # three of six tell as much
    second = np.diff(rows[:, 0] - 2 * rows[:, 1] + rows[:, 2], 2)
    return max(float(np.median(np.abs(second))) / (0.6745 * 6), 0.3)
