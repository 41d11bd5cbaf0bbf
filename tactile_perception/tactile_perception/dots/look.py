# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the dots of an image are, measured in that image: polarity, colour channel, size, contrast, blur and noise.

A dot is one of many alike. At each scale, peaks of the difference of two Gaussians (Lindeberg, Feature detection with automatic scale
selection, 1998) that correlate with a disc on a ring of ground (Lewis, Fast normalized cross-correlation, 1995) count by their contrast,
but none for more than most: a lamp, a rim or a letter is one of few, and its brightness counts for nothing. The scale and the sign with
the most contrast win.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from ..errors import BadFrame
from .fit import disc_modes

CHANNELS = ('blue', 'green', 'red', 'grey')

_DIAMETERS = 3.0 * 2 ** (np.arange(19) / 4)  # px, of the scale search: up to 68; four to an octave, where the response falls by 5 %
_ACROSS = 7.0  # px, diameter of a disc in the reduced images: the fewest in which its edge is seen on all sides
_MOST = 1500  # strongest peaks at a scale that are looked at: bounds the time
LEAST = 6.0  # grey levels, least contrast: print and light, not rounding
_OVER_NOISE = 4.0  # standard deviations of a pixel, least contrast: noise alone shows fewer than six such discs of three px in an image
_CORRELATED = 0.5, 0.62, 0.74, 0.84, 0.92  # candidates of the least correlation with a disc: worn dots have 0.6, texture seldom 0.8
LOWER = 0.8  # times the least correlation that tells dots from others: where dots differ, in size or by wear, some have less
_MANY = 30  # dots: sensors have as many; of lamps, screws and letters of one size there are fewer
FEWEST = 6  # dots: the corners of a square are four
RING = 1.4  # outer diameter of the ring over that of the disc: excludes neighbours down to a pitch of 1.2 diameters
_TEXTURE = 0.1  # of the dots, as many of the opposite sign: texture has 0.25 to 4, real prints up to 0.02
_SHARES = 0.35, 0.7  # of the typical contrast: most dots have from the second to twice that, texture as often half as much
_NOISE = 1.0  # grey levels, regularises the normalisation of flat regions

LARGEST_FITTED = 14.0  # px: larger dots are fitted in a reduced image, which bounds the time
_SAMPLE = 50  # dots that tell blur and sizes: bounds the time
_STEPS = 5  # of their fit
_BLUR, _LEAST_BLUR = 0.9, 0.2  # px, start and bound
_FARTHEST, _LONGEST, _LONGEST_BLUR = 1.0, 0.15, 0.3  # longest steps: px, diameters, px
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
    """Discs: uv (N, 2) px; correlation (N,), 0 to 1; amplitude (N,): grey levels of disc over ring."""

    uv: np.ndarray
    correlation: np.ndarray
    amplitude: np.ndarray


@dataclass(frozen=True)
class Kind:
    """sign: 1 for bright dots, -1 for dark; diameter: px; lowest: least correlation with a disc; score: contrast that they explain;
    peaks: in the image that showed them."""

    sign: int
    channel: str
    diameter: float
    lowest: float
    score: float
    peaks: Peaks | None


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


def find_kind(image: np.ndarray, signs: tuple[int, ...]) -> Kind:
    """The dots that explain most of an image, (H, W) or (H, W, 3) uint8, of one of the signs. Raises BadFrame without any.

    Every second scale of the grey image comes first, and its neighbours in all channels then; colours are looked through alone where grey
    shows nothing.
    """
    diameters = _DIAMETERS[3 * _DIAMETERS < min(image.shape[:2])].tolist()
    colours = CHANNELS[:-1] if image.ndim == 3 and _coloured(image) else ()
    found = _best_kind(image, CHANNELS[-1:], signs, diameters[::2]) or _best_kind(image, colours, signs, diameters[::2])
    if found is None:
        polarity = '' if len(signs) > 1 else 'bright ' if signs[0] > 0 else 'dark '
        raise BadFrame(f'no {polarity}dots found in the frame: check light, focus and the parameter polarity; a dot is one of many alike')
    near = [diameter for diameter in diameters if abs(np.log2(diameter / found.diameter)) < 0.3]
    return _best_kind(image, (*colours, CHANNELS[-1]), (found.sign,), near, found)


def _best_kind(image, channels, signs, diameters, best: Kind | None = None) -> Kind | None:
    """The one with the highest score, best or better ones."""
    known = best and (best.channel, best.diameter)
    for channel in channels:
        grey = select_channel(image, channel)
        least = max(LEAST, _OVER_NOISE * _noise(grey))
        for diameter in diameters:
            if (channel, diameter) == known:
                continue
            found = find_peaks(grey, (-1, 1), diameter)
            for sign in signs:
                for lowest in _CORRELATED:
                    score = _explained(found[sign], found[-sign], diameter, lowest, least)
                    if score > (best.score if best else 0):
                        best = Kind(sign, channel, diameter, lowest, score, found[sign])
    return best


def _coloured(image) -> bool:
    part = image[::8, ::8].astype(np.int16)
    return bool(np.percentile(np.ptp(part, axis=2), 90) > 12)  # grey levels, over noise and white balance


def _explained(found: Peaks, opposite: Peaks, diameter: float, lowest: float, least: float) -> float:
    """Contrast that dots of this diameter, px, and at least so many grey levels explain, of each no more than of most, by how alike and how
    many they are; none of texture, which has them in the opposite sign, too, and as strong: gaps of packed dots are fainter."""
    is_round = found.correlation > lowest
    disc = is_round & (found.amplitude > least)
    if disc.sum() < FEWEST:
        return 0.0
    typical = np.median(found.amplitude[disc])
    ratio = found.amplitude[is_round] / typical
    below, usual = (np.count_nonzero((ratio > share) & (ratio < 2 * share)) for share in _SHARES)
    against = np.count_nonzero((opposite.correlation > LOWER * lowest) & (opposite.amplitude > max(least / 2, _SHARES[1] * typical)))
    if against > _TEXTURE * disc.sum() or 2 * below > usual:
        return 0.0
    many = min(1.0, disc.sum() / _MANY)
    score = (np.minimum(found.amplitude[disc], typical)**2 * found.correlation[disc]**8).sum()
    alike = np.count_nonzero((ratio > 0.5) & (ratio < 2)) / disc.sum()
    return float(score * (diameter * alike * many)**2)


def find_peaks(grey: np.ndarray, signs: tuple[int, ...], diameter: float) -> dict[int, Peaks]:
    """Discs of this diameter, px, in an image (H, W) uint8, by sign."""
    small, scale, across = _reduced(grey, diameter)
    inner, outer = (cv2.GaussianBlur(small, (0, 0), s * across, borderType=cv2.BORDER_REFLECT) for s in (0.28, 0.5))
    relief = inner - outer
    reach = max(1, int(0.4 * across))
    lowest = max(LEAST / 4, np.median(np.abs(relief[::4, ::4])) / 0.6745)
    margin, found = int(np.ceil(across / 2)), {}
    square = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    for sign in signs:
        rise = relief if sign > 0 else -relief
        is_peak = (rise >= np.maximum(cv2.dilate(rise, square), lowest))[margin:-margin, margin:-margin]
        row, column = np.divmod(np.flatnonzero(is_peak), is_peak.shape[1])
        row, column = row + margin, column + margin
        if len(row) > _MOST:
            kept = np.argpartition(-rise[row, column], _MOST)[:_MOST]
            row, column = row[kept], column[kept]
        correlation, amplitude = _correlate_patches(small * sign, column, row, across)
        good = (correlation > _CORRELATED[0]) & (amplitude > LEAST / 2)
        uv = (np.stack([column, row], axis=1)[good] + 0.5) / scale - 0.5
        found[sign] = Peaks(uv, correlation[good].astype(float), amplitude[good].astype(float))
    return found


def correlate(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> np.ndarray:
    """(N,) correlation of an image (H, W) uint8 with discs of this diameter at uv (N, 2), px."""
    small, scale, across = _reduced(grey, diameter)
    column, row = np.clip(np.rint((uv + 0.5) * scale - 0.5).astype(int), 0, np.array(small.shape[::-1]) - 1).T
    return _correlate_patches(small * sign, column, row, across)[0]


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


def _correlate_patches(image: np.ndarray, column: np.ndarray, row: np.ndarray, across: float) -> tuple[np.ndarray, np.ndarray]:
    """Normalised correlation and amplitude (N,) of a disc, px across, on a ring of ground, at pixels of an image (H, W) float32."""
    disc, both = _template(round(across, 2))
    half = len(disc) // 2
    padded = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_REFLECT)
    windows = np.lib.stride_tricks.sliding_window_view(padded, disc.shape)
    patches = windows[row, column].reshape(len(row), disc.size)
    contrast, weight = (disc - both * (disc.sum() / both.sum())).ravel(), both.ravel()
    product, norm = patches @ contrast, float((contrast**2).sum())
    mean = patches @ weight / weight.sum()
    variance = np.maximum((patches - mean[:, None])**2 @ weight, 0) + weight.sum() * _NOISE**2
    return product / np.sqrt(variance * norm), product / norm


def measure_look(image: np.ndarray, sign: int) -> Look:
    """The look of an image's dots; image: (H, W) or (H, W, 3) uint8; sign: 1 for bright dots, -1 for dark ones. Raises BadFrame."""
    kind = find_kind(image, (sign,))
    grey = select_channel(image, kind.channel)
    return describe_dots(grey, kind.peaks.uv[kind.peaks.correlation > LOWER * kind.lowest], kind)


def describe_dots(grey: np.ndarray, uv: np.ndarray, kind: Kind) -> Look:
    """The look of dots near uv (N, 2) px of an image (H, W) uint8: their blurs, diameters, places, contrasts and grounds are fitted by
    Gauss-Newton steps to some of them, the blur to all alike. Raises BadFrame where these are no discs."""
    step = int(np.ceil(kind.diameter / LARGEST_FITTED))
    noise, grey = _noise(grey) / step, shrink(grey, step)
    typical, uv = kind.diameter / step, (uv + 0.5) / step - 0.5
    half = int(np.ceil(0.75 * typical + 2.5))
    middle = np.rint(uv).astype(int)
    inside = ((middle >= half) & (middle < np.array(grey.shape[::-1]) - half)).all(axis=1)
    chosen = np.flatnonzero(inside)[::max(1, int(inside.sum() / _SAMPLE))]
    if len(chosen) < FEWEST:
        raise BadFrame('too few dots found in the frame, or too near to its border: check light, focus and the camera\'s aim')
    middle, place = middle[chosen], (uv - middle)[chosen]
    y, x = np.mgrid[-half:half + 1, -half:half + 1].reshape(2, -1)
    pixels = grey[middle[:, 1, None] + y, middle[:, 0, None] + x].astype(float)
    blur, diameter = _BLUR, np.full(len(chosen), typical)
    for _ in range(_STEPS):
        solved, rest = _step(pixels, x - place[:, :1], y - place[:, 1:], diameter, blur)
        contrast, change = solved[:, 0], solved[:, 1:5] / np.where(solved[:, :1] == 0, np.inf, solved[:, :1])
        good = (contrast * kind.sign > LEAST) & (rest < 2 * np.median(rest))
        if good.sum() < FEWEST:
            raise BadFrame('what was found in the frame are no dots: check light, focus and the parameter polarity')
        place = place + np.clip(change[:, :2], -_FARTHEST, _FARTHEST)
        diameter = np.clip(diameter + np.clip(change[:, 2], -_LONGEST * typical, _LONGEST * typical), 0.4 * typical, 1.8 * typical)
        blur = max(blur + float(np.clip(np.median(change[good, 3]), -_LONGEST_BLUR, _LONGEST_BLUR)), _LEAST_BLUR)
    low, typical, high = np.percentile(diameter[good], [2, 50, 98])
    return Look(kind.channel, step, max(0.8 * float(low), 1.5), float(typical), 1.15 * float(high), blur, float(np.median(contrast[good])),
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
