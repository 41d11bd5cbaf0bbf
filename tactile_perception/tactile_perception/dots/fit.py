# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Model of one printed dot: its image, a blurred disc; tables for its maximum-likelihood fit in small patches (src/dots/disc.cpp); and the
appearance of the dots, measured in one image: colour channel, size, contrast, blur and noise.

The fit's model is linearised at nodes of sub-pixel position and diameter. At each node, the weighted least-squares estimate of the
differences from the node is a matrix applied to the patch. The rows of these matrices span few dimensions, so a patch is projected onto
them once, and every Gauss-Newton step works on these dimensions. Each of them is even or odd along both axes: nodes in one quadrant serve
all four, and a patch is folded first.
"""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..errors import BadFrame

_REACH = 6.0  # standard deviations at which a Gaussian is truncated: 1e-9 lies beyond
# Strips over which a disc is integrated: so many, and so many per radius over blur. The sum over a half circle of angles converges
# exponentially; with these it is within 1e-7 of the brightness for discs of 1.5 to 30 px and any blur (measured).
_STRIPS, _STRIPS_PER_BLUR = 6, 3.2
_PER_PIXEL = 24  # samples of a profile per pixel
_PIXEL_VARIANCE = 1.0 / 12.0  # px^2, of a square pixel
_DIFFERENCE = 0.02  # px, step of numerical derivatives


def _normal_integral() -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and the standard normal cumulative distribution there (NumPy has no error function)."""
    t = np.linspace(-_REACH, _REACH, 4801)
    density = np.exp(-0.5 * t**2)
    total = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    return t, total / total[-1]


_T, _NORMAL = _normal_integral()


def blurred_disc(radius: np.ndarray, diameter: float, blur: float) -> np.ndarray:
    """Radial profile of a blurred disc of unit brightness, at distances radius (any shape, px) from its centre.

    diameter: px; blur: px, standard deviation of the optics without the pixel. The disc is integrated over strips, each a difference of
    normal distribution functions, which is exact up to the number of strips.
    """
    grid = np.arange(int(np.max(radius) * _PER_PIXEL) + 2) / _PER_PIXEL
    return np.interp(radius, grid, _profile(grid, diameter, blur))


def _profile(radius, diameter, blur):
    s = np.sqrt(blur**2 + _PIXEL_VARIANCE)
    half = diameter / 2
    strips = _STRIPS + int(_STRIPS_PER_BLUR * half / s)
    angle = (np.arange(strips) + 0.5) / strips * np.pi - np.pi / 2
    along, share = half * np.sin(angle), half * np.cos(angle) * np.pi / strips
    chord = 2 * np.interp(half * np.cos(angle) / s, _T, _NORMAL) - 1
    near = radius[radius < half + _REACH * s]  # radius ascends
    exponent = (near[:, None] - along) / s
    exponent *= exponent
    exponent *= -0.5
    density = np.exp(exponent, out=exponent)
    return np.concatenate([density @ (share * chord / (s * np.sqrt(2 * np.pi))), np.zeros(len(radius) - len(near))])


@dataclass
class DiscModes:
    """Image of a disc and its derivatives by position, diameter, blur and two components of ellipticity (any shape)."""

    shape: np.ndarray
    by_u: np.ndarray
    by_v: np.ndarray
    by_diameter: np.ndarray
    by_blur: np.ndarray
    oval: np.ndarray
    oval_oblique: np.ndarray


def disc_modes(x: np.ndarray, y: np.ndarray, diameter: float, blur: float) -> DiscModes:
    """The image of a disc and its derivatives at offsets x, y (same shape, px) from its centre; diameter, blur: px."""
    radius = np.hypot(x, y)
    grid = np.arange(int(radius.max() * _PER_PIXEL) + 2) / _PER_PIXEL
    h = _DIFFERENCE
    middle = _profile(grid, diameter, blur)
    by_diameter = (_profile(grid, diameter + h, blur) - _profile(grid, diameter - h, blur)) / (2 * h)
    by_blur = (_profile(grid, diameter, blur + h) - _profile(grid, diameter, max(blur - h, 0.0))) / (2 * h)
    inverse = 1 / np.maximum(radius, 1e-6)
    outward = np.interp(radius, grid, np.gradient(middle, 1 / _PER_PIXEL)) * inverse
    edge = np.interp(radius, grid, by_diameter)
    turn = edge * inverse**2
    return DiscModes(np.interp(radius, grid, middle), -outward * x, -outward * y, edge, np.interp(radius, grid, by_blur),
        turn * (x * x - y * y), 2 * turn * x * y)


_PHASES = 4  # nodes from 0 to 1 px along each axis: the model is linear between them to 0.001 px for dots from 5 px
_NODE_DIAMETERS = 0.65  # widths of the blurred edge, greatest spacing of the nodes' diameters. Chosen likewise; dots of 3 px: 0.002 px
_TAIL = 2.2  # blurs outside the dot's edge where the window ends: 1 % of the information about its position lies beyond
_TAPER = 2.0  # px over which the window falls from one to zero
_LEAST_HALF = 3  # px: a smaller patch has fewer independent directions than the basis
_SECTORS = {(1, 1): 12, (1, -1): 8, (-1, 1): 8, (-1, -1): 4}  # parity down and across: dimensions. They shift positions by below 0.001 px
_BASIS_UNITS = 32768  # of the kernel: the basis in whole numbers
_LANES = 8  # of the kernel: rows of the basis are padded to a multiple
_MODELS_FIRST = 1e3  # weight of the dots' images against the rows in the compression, so that its loss causes no bias
_PER_SQUARE = 16.0  # entries of a profile per px^2 of squared radius
_PER_DIAMETER = 20.0  # profiles per px of diameter
_BEYOND = 3.5  # blurs outside its edge where a dot's image ends


class DiscModel:
    """Discs of a range of diameters, imaged with a known blur.

    smallest, largest: diameters, px; blur: standard deviation, px. Construction takes some hundredths of a second.
    Attributes for the kernel: basis (K, S) int16 of folded patches with sides of 2 half + 1 px; estimators (D, 4, 4, 5, K) for D
    diameters and distances down and across from the middle pixel, of amplitude times du, dv and ddiameter, amplitude and ground; modes
    (D, 4, 4, 10, K), orthonormal, of a dot's image; gains (D, 4, 4) px^2, variance of a position for unit contrast and noise; levers
    (D, 2) px^2, shift by slopes of ground and dot; profile (P, L): images along the squared radius, per_square entries per px^2.
    """

    def __init__(self, smallest: float, largest: float, blur: float):
        edge = np.hypot(blur, 0.3)
        self.diameters = np.linspace(smallest, largest, 2 + int((largest - smallest) / (_NODE_DIAMETERS * edge)))
        self._tail, self.smallest, self.largest, self.blur = _TAIL * edge, float(smallest), float(largest), float(blur)
        self.half = max(_LEAST_HALF, int(np.ceil(largest / 2 + self._tail - 0.3)))
        self.per_square, self.profile = _PER_SQUARE, self._profiles()
        self._make_nodes()

    def _profiles(self) -> np.ndarray:
        """(P, L) float32 images of discs along the squared radius, zero at the end."""
        length = int((self.largest / 2 + _BEYOND * np.hypot(self.blur, 0.3)) ** 2 * _PER_SQUARE) + 1
        radius = np.sqrt(np.arange(length) / _PER_SQUARE)
        diameters = np.linspace(self.smallest, self.largest, 2 + int((self.largest - self.smallest) * _PER_DIAMETER))
        profile = np.array([blurred_disc(radius, diameter, self.blur) for diameter in diameters], np.float32)
        profile[:, -1] = 0.0
        return profile

    def _make_nodes(self) -> None:
        """Set the tables of all nodes."""
        reach = np.arange(-self.half, self.half + 1, dtype=float)
        modes, windows = (np.concatenate(parts) for parts in zip(*(self._linearised(reach, d) for d in self.diameters)))
        models = modes[:, :, :5]
        weighted = models * windows[:, :, None]
        rows = np.linalg.solve(weighted.transpose(0, 2, 1) @ models, weighted.transpose(0, 2, 1))
        basis, self.basis = _compression(rows, models[:, :, 0], self.half)
        shape = len(self.diameters), _PHASES, _PHASES
        gains = np.einsum('nij,nij->n', rows[:, 1:3], rows[:, 1:3]) / 2
        central, x = slice(None, None, _PHASES**2), np.tile(reach, len(reach))
        self.levers = np.stack([rows[central, 1] @ x, (rows[central, 1] * models[central, :, 0]) @ x], axis=1)
        explained = np.linalg.qr(basis.T @ modes)[0].transpose(0, 2, 1)
        estimators = (rows @ basis)[:, [1, 2, 3, 0, 4]]
        self.estimators = np.ascontiguousarray(estimators.reshape(*shape, 5, -1), np.float32)
        self.modes, self.gains = np.ascontiguousarray(explained.reshape(*shape, 10, -1), np.float32), gains.reshape(shape)

    def _linearised(self, reach, diameter):
        """(nodes, pixels, 10) derivatives of a dot's image by amplitude, u, v, diameter, background, its two slopes, two components of
        ellipticity, and blur; and (nodes, pixels) windows."""
        phases = np.linspace(0, 1, _PHASES)
        v, u, y, x = np.meshgrid(phases, phases, reach, reach, indexing='ij')
        x, y = (x - u).reshape(_PHASES**2, -1), (y - v).reshape(_PHASES**2, -1)
        m = disc_modes(x, y, diameter, self.blur)
        edge = np.clip((diameter / 2 + self._tail - np.hypot(x, y)) / _TAPER + 0.5, 0, 1)
        stack = np.stack([m.shape, m.by_u, m.by_v, m.by_diameter, np.ones_like(x), x, y, m.oval, m.oval_oblique, m.by_blur], 2)
        return stack, edge * edge * (3 - 2 * edge)


def _compression(rows, images, half):
    """(pixels, K) orthonormal basis of the dots' images and, with less weight, of the rows: leading principal directions of each parity;
    and (K, S) int16, the same for sums of mirrored pixels, where those on an axis count twice, in _BASIS_UNITS, padded."""
    flat = rows.reshape(-1, rows.shape[2])
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    images = images / np.linalg.norm(images, axis=1, keepdims=True)
    even = np.full((1, rows.shape[2]), rows.shape[2] ** -0.5)
    directions = np.concatenate([flat, np.sqrt(_MODELS_FIRST) * images, np.sqrt(_MODELS_FIRST * len(images)) * even])
    parts = []
    for parity, dimensions in _SECTORS.items():
        mirrored = _mirrored(parity, half)
        part = directions @ mirrored
        parts.append(mirrored @ np.linalg.eigh(part.T @ part)[1][:, :-dimensions - 1:-1])
    basis = np.concatenate(parts, axis=1)
    folded = basis.reshape(2 * half + 1, 2 * half + 1, -1)[half:, half:].copy()
    folded[0] /= 2
    folded[:, 0] /= 2
    padded = np.zeros((basis.shape[1], -(-(half + 1) ** 2 // _LANES) * _LANES), np.int16)
    padded[:, :(half + 1) ** 2] = np.rint(_BASIS_UNITS * folded.reshape(-1, basis.shape[1]).T)
    return basis, padded


def _mirrored(parity, half):
    """(pixels, n) orthonormal patches with this parity, 1 or -1, down and across: one for each pixel and those that mirror it."""
    line = np.arange(-half, half + 1)
    axes = []
    for sign in parity:
        part = np.where(np.abs(line)[:, None] == np.arange(half + 1), np.where(line < 0, sign, 1)[:, None], 0.0)
        part = part if sign > 0 else part[:, 1:]
        axes.append(part / np.linalg.norm(part, axis=0))
    return np.kron(*axes)


CHANNELS = ('blue', 'green', 'red', 'grey')
_BLOCKS = (15, 31, 61, 121)  # px, candidate sides of the box of the local mean: in octaves, for dots of 4 to 60 px
_LEVELS = (0.25, 0.5)  # candidate thresholds, parts of the strongest contrast
_LARGEST_FITTED = 14.0  # px: larger dots are measured in a reduced image, which bounds the time
_MOST = 60  # dots used for the blur: bounds the time
_FEWEST = 4  # dots; fewer cannot be distinguished from dirt
_FLAT = 1e-3  # variance of a disc's image of unit brightness in a window; with less, the window shows nothing of its edge
_ENOUGH = 30  # dots in the middle of the image from which it decides on the channel, in a quarter of the time


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
class _Blobs:
    """Round regions of similar size: centre (N, 2) px, diameter (N,) px, contrast: grey levels, score: likeness to printed dots."""

    centre: np.ndarray
    diameter: np.ndarray
    contrast: float
    score: float


def select_channel(image: np.ndarray, channel: str) -> np.ndarray:
    """(H, W) uint8: one channel of a BGR image, or its grey mean; grey images are returned unchanged."""
    if image.ndim == 2:
        return image
    if channel == 'grey':
        return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return cv2.extractChannel(image, CHANNELS.index(channel))


def shrink(grey: np.ndarray, step: int) -> np.ndarray:
    """The image with each block of step x step pixels averaged into one."""
    return grey if step == 1 else cv2.resize(grey, (grey.shape[1] // step, grey.shape[0] // step), interpolation=cv2.INTER_AREA)


def measure_look(image: np.ndarray, sign: int) -> Look:
    """Measure the channel with the most salient dots, their sizes, contrast and blur.

    image: (H, W) or (H, W, 3) uint8; sign: 1 for bright dots, -1 for dark ones. Raises BadFrame with fewer than four similar dots.
    """
    planes = {channel: select_channel(image, channel) for channel in (CHANNELS if image.ndim == 3 else CHANNELS[-1:])}
    noises = {channel: _noise(grey) for channel, grey in planes.items()}
    channel = CHANNELS[-1] if image.ndim == 2 else _clearest(planes, noises, sign)
    blobs = _find_blobs(planes[channel], sign, noises[channel], _LEVELS)
    if blobs is None:
        raise BadFrame(f'no {"bright" if sign > 0 else "dark"} dots found in the frame: check light, focus and the parameter polarity')
    return _describe(channel, planes[channel], noises[channel], blobs, sign)


def _clearest(planes, noises, sign):
    """The channel, of planes by name, with the most salient dots: in the middle of the image, in the whole if it has few."""
    rows, columns = (side // 4 for side in planes['grey'].shape)
    for part, levels in (np.s_[rows:-rows, columns:-columns], _LEVELS[1:]), (np.s_[:, :], _LEVELS):
        blobs = {name: _find_blobs(grey[part], sign, noises[name], levels) for name, grey in planes.items()}
        best = max(planes, key=lambda name: blobs[name].score / noises[name] if blobs[name] else 0.0)
        if blobs[best] and len(blobs[best].diameter) >= _ENOUGH:
            break
    return best


def _noise(grey):
    """Standard deviation of pixel noise, grey levels, from the median absolute second difference; at least that of rounding."""
    g = grey.astype(np.int16)
    second = g[1:-1:2, 1:-1:2] * 4 - 2 * (g[:-2:2, 1:-1:2] + g[2::2, 1:-1:2] + g[1:-1:2, :-2:2] + g[1:-1:2, 2::2])
    second += g[:-2:2, :-2:2] + g[:-2:2, 2::2] + g[2::2, :-2:2] + g[2::2, 2::2]
    return max(float(np.median(np.abs(second))) / (0.6745 * 6), 0.3)


def _find_blobs(grey, sign, noise, levels):
    smooth = cv2.GaussianBlur(grey, (3, 3), 0).astype(np.float32) * sign
    best = None
    for block in _BLOCKS:
        above = smooth - cv2.blur(smooth, (block, block))
        strongest = np.percentile(above[::2, ::2], 99.5)
        for level in levels:
            if level * strongest < 3 * noise:
                continue
            blobs = _roundish(above, level * strongest)
            if blobs is not None and (best is None or blobs.score > best.score):
                best = blobs
    return best


def _roundish(above, threshold):
    """Regions above the threshold that are round, inside the image and of similar size, or None."""
    _, _, stats, centre = cv2.connectedComponentsWithStats((above > threshold).astype(np.uint8), connectivity=4)
    left, top, wide, high, area = stats[1:].T
    inside = (left > 0) & (top > 0) & (left + wide < above.shape[1]) & (top + high < above.shape[0])
    fill = area / (wide * high)
    good = inside & (area >= 6) & (np.maximum(wide, high) <= 1.6 * np.minimum(wide, high) + 1) & (fill > 0.55)
    if good.sum() < _FEWEST:
        return None
    area, centre = area[good].astype(float), centre[1:][good]
    typical = np.median(np.repeat(area, np.maximum(area / area.min(), 1).astype(int)))
    like = (area > typical / 3.5) & (area < typical * 3)
    if like.sum() < _FEWEST:
        return None
    area, centre = area[like], centre[like]
    at = np.rint(centre).astype(int)
    contrast = float(np.median(above[at[:, 1], at[:, 0]]))
    return _Blobs(centre, np.sqrt(4 / np.pi * area), contrast, len(area) * contrast * np.sqrt(np.median(area)))


def describe_dots(channel: str, grey: np.ndarray, centre: np.ndarray, diameter: np.ndarray, sign: int) -> Look:
    """Look of dots at centre (N, 2) px with diameters (N,) px, in an image (H, W) uint8. Raises BadFrame where these are no discs."""
    return _describe(channel, grey, _noise(grey), _Blobs(centre, diameter, 0.0, 0.0), sign)


def _describe(channel, grey, noise, blobs, sign):
    step = int(np.ceil(np.median(blobs.diameter) / _LARGEST_FITTED))
    grey = shrink(grey, step)
    centre, rough = (blobs.centre + 0.5) / step - 0.5, blobs.diameter / step
    blur, diameter, contrast = _fit_blur(grey, centre, rough, noise / step)
    low, middle, high = np.percentile(diameter, [2, 50, 98])
    if not np.isfinite([blur, low, high, contrast]).all() or not contrast:
        raise BadFrame('the regions found in the frame are no dots: check light, focus and the parameter polarity')
    return Look(channel, step, max(0.8 * float(low), 1.5), float(middle), 1.15 * float(high), blur, sign * contrast, _ground_level(grey,
        centre, 0.5 * middle + 2 + 2 * blur), noise / step)


def _ground_level(grey, centre, away):
    """Median grey level at a distance away, px, diagonally from the dots, where a grid has no dots."""
    away *= np.sqrt(0.5)
    row = np.clip(np.rint(centre[:, 1] + away).astype(int), 0, grey.shape[0] - 1)
    column = np.clip(np.rint(centre[:, 0] + away).astype(int), 0, grey.shape[1] - 1)
    return float(np.median(grey[row, column]))


def _fit_blur(grey, centre, rough, noise):
    """Common blur, diameters and median contrast by grid search: coarse around the regions' centroids, then fine around grey-weighted
    centroids."""
    half = int(np.ceil(np.percentile(rough, 90) / 2 + 3))
    at = np.rint(centre).astype(int)
    inside = ((at >= half) & (at < np.array(grey.shape[::-1]) - half)).all(1)
    chosen = np.flatnonzero(inside)[:: max(1, int(inside.sum() / _MOST))]
    if len(chosen) < _FEWEST:
        raise BadFrame('the dots are too near to the border of the frame: check the camera\'s aim')
    reach = np.arange(-half, half + 1)
    patches = grey[at[chosen, 1, None, None] + reach[:, None], at[chosen, 0, None, None] + reach].astype(float)
    x, y = np.meshgrid(reach, reach)
    offset = centre[chosen] - at[chosen]
    discs = _Discs(np.median(rough[chosen]), 1.5 * half + 2)
    coarse = _scan(patches, _distances(x, y, offset), rough[chosen], discs, range(0, len(discs.blurs), 2), slice(None, None, 2))
    offset = _recentre(patches, offset, x, y, coarse[1])
    near = int(np.argmin(np.abs(discs.blurs - coarse[0])))
    around = range(max(near - 2, 0), min(near + 3, len(discs.blurs)))
    first, last = np.searchsorted(discs.diameters, [coarse[1].min(), coarse[1].max()])
    sizes = slice(max(first - 2, 0), last + 3)
    blur, diameter, contrast = _scan(patches, _distances(x, y, offset), rough[chosen], discs, around, sizes)
    scale = np.median(diameter / rough[chosen])
    return blur, rough * scale, float(np.median(np.abs(contrast)))


def _distances(x, y, offset):
    """(N, H, W) px, distances of pixels at x, y (H, W) from positions (N, 2)."""
    return np.hypot(x - offset[:, 0, None, None], y - offset[:, 1, None, None])


class _Discs:
    """Profiles of blurred discs over a grid of blurs and diameters; about: px, central diameter; outermost: px, radius."""

    def __init__(self, about: float, outermost: float):
        self.blurs = np.array([0.2, 0.35, 0.5, 0.7, 0.9, 1.1, 1.35, 1.6, 2.0, 2.5, 3.2])
        self.diameters = np.linspace(0.6, 1.5, 28) * about
        self._last = int(outermost * _PER_PIXEL)
        self._radius = np.arange(self._last + 1) / _PER_PIXEL
        self._profiles: dict[tuple[int, int], np.ndarray] = {}

    def images(self, blur: int, chosen: range, radius: np.ndarray):
        """For each chosen diameter, the brightness at distances radius (any shape, px) from the centre; blur: index of the blur."""
        index = np.minimum(np.rint(radius * _PER_PIXEL), self._last).astype(np.int32)
        return (self._profile(blur, k).take(index) for k in chosen)

    def _profile(self, blur: int, diameter: int) -> np.ndarray:
        if (blur, diameter) not in self._profiles:
            self._profiles[blur, diameter] = np.float32(blurred_disc(self._radius, self.diameters[diameter], self.blurs[blur]))
        return self._profiles[blur, diameter]


def _scan(patches, radius, rough, discs, blurs, part):
    """(blur, diameters (N,), contrasts (N,)) with the least residual; contrast and ground are free for each dot. blurs: indices; part:
    slice of the diameters."""
    diameters = np.arange(len(discs.diameters))[part]
    totals, found, each = [], [], np.arange(len(rough))
    window = (radius < (rough / 2 + 2.5)[:, None, None]).reshape(len(rough), -1)
    wanted = _Windowed(patches.reshape(len(rough), -1), window)
    radius = radius.reshape(len(rough), -1)
    for blur in blurs:
        fits = [wanted.residual(image) for image in discs.images(blur, diameters, radius)]
        residual, contrast = np.array([f[0] for f in fits]), np.array([f[1] for f in fits])
        k = np.argmin(residual, 0)
        totals.append(np.median(residual[k, each]))
        found.append((discs.diameters[diameters[k]], contrast[k, each]))
    k = int(np.argmin(totals))
    return _vertex(discs.blurs[list(blurs)], totals, k), *found[k]


class _Windowed:
    """Least squares of patches (N, P) within windows (N, P) bool."""

    def __init__(self, patches, window):
        self._window, self._count = window.astype(np.float32), window.sum(1)
        self._mean = (patches * window).sum(1) / self._count
        self._rest = ((patches - self._mean[:, None]) * window).astype(np.float32)
        self._square = np.einsum('ij,ij->i', self._rest, self._rest, dtype=float)

    def residual(self, image):
        """Mean squared residuals (N,) of a fit of image (N, P) with free contrast and ground, and the contrasts (N,)."""
        mean = np.einsum('ij,ij->i', image, self._window) / self._count
        square = np.einsum('ij,ij,ij->i', image, image, self._window) - self._count * mean**2
        contrast = np.einsum('ij,ij->i', image, self._rest) / np.maximum(square, _FLAT * self._count)
        return (self._square - contrast**2 * square) / self._count, contrast


def _vertex(grid, values, k):
    """Position of the minimum by a parabola through the least value and its neighbours."""
    if k == 0 or k == len(grid) - 1:
        return float(grid[k])
    a, b, _ = np.polyfit(grid[k - 1:k + 2], values[k - 1:k + 2], 2)
    return float(np.clip(-b / (2 * a), grid[k - 1], grid[k + 1]))


def _recentre(patches, offset, x, y, diameter):
    """Grey-weighted centroids over discs a little larger than the dots."""
    near = np.hypot(x - offset[:, 0, None, None], y - offset[:, 1, None, None])
    ring = (near > diameter.max() / 2 + 1.0) & (near < diameter.max() / 2 + 2.5)
    ground = (patches * ring).sum((1, 2)) / ring.sum((1, 2))
    weight = (patches - ground[:, None, None]) * np.clip(diameter[:, None, None] / 2 + 1.5 - near, 0, 1)
    total = weight.sum((1, 2))[:, None]
    centroid = np.stack([(weight * x).sum((1, 2)), (weight * y).sum((1, 2))], 1)
    centroid = np.divide(centroid, total, out=np.full_like(offset, np.inf), where=total != 0)
    inside = np.hypot(*(centroid - offset).T) < diameter / 2  # a patch as bright as its ring has no centroid
    return np.where(inside[:, None], centroid, offset)
