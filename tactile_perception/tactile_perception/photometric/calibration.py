# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The fit of slope against colour to presses of a ball of known radius: within the circles of the presses the slopes are those of the
ball."""
from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from ..common.statistics import robust_sigma
from ..core.errors import BadCalibration
from .circles import Circle
from .colour import NormalEquations, features, image_positions
from .constants import PHOTOMETRIC
from .model import DepthModel, Reconstruction, averaged, deeper_half
from .surface import bend


class Press(NamedTuple):
    """The deepest image of a press. name: of recording and time; change: (H, W, 3) and hidden: (H, W), of its working image; circle: of the
    ball."""

    name: str
    image: np.ndarray
    change: np.ndarray
    hidden: np.ndarray
    circle: Circle


class Errors(NamedTuple):
    """Errors at presses that were left out of the fit, in px. depth: (P,) RMS error of the shape of the ball; height: (P,) estimated less
    true height of the cap; cap: (P,) that height; position: (P, 2) of the deepest point; untouched: (P,) RMS depth of the untouched skin;
    free: (P, 2), of the skin beside the ball: its depth times its bend, and its squared bend, summed up."""

    depth: np.ndarray
    height: np.ndarray
    cap: np.ndarray
    position: np.ndarray
    untouched: np.ndarray
    free: np.ndarray

    @property
    def depth_floor(self) -> float:
        """Standard deviation of a small depth."""
        return float(np.sqrt(np.mean(self.untouched**2)))

    @property
    def relative(self) -> float:
        """RMS error of the heights of the caps, relative to them, beyond that of a small depth."""
        return float(np.sqrt(max(np.sum(self.height**2 - self.depth_floor**2), 0.0) / np.sum(self.cap**2)))


class BallFit:
    """Fits the slope of a ball to the colours of presses.

    Parameters
    ----------
    presses : list of Press
        The presses.
    radius : float
        Radius of the ball in px of the working image.

    Raises
    ------
    BadCalibration
        If there are too few presses.

    Attributes
    ----------
    presses, circles : list
        Those of the fit.
    left_out : list of str
        Presses that are not in it, and why.

    Notes
    -----
    A pixel at distance r from the deepest point of a ball of radius R has a slope of r / sqrt(R^2 - r^2) towards it. The circles of the
    search are only a start: the centre of each is moved to where the slopes that the other presses predict point, and the fit is repeated.
    """

    def __init__(self, presses: list[Press], radius: float):
        if len(presses) < PHOTOMETRIC.min_presses:
            raise BadCalibration(f'{len(presses)} presses of a ball were found, {PHOTOMETRIC.min_presses} are needed; press it at twenty '
                                 'positions all over the gel, and lift it in between')
        found = float(np.median([press.circle.radius for press in presses]))
        if found > PHOTOMETRIC.max_circle * radius:
            raise BadCalibration(f'the presses make circles of {found / radius:.1f} times the radius of the ball; check the radius of the '
                                 'ball in m, and gel.scale for the resolution of these images')
        self.presses, self.radius, self.left_out = list(presses), radius, []
        shape = presses[0].hidden.shape
        self._position = image_positions(shape)
        self._y, self._x = np.mgrid[:shape[0], :shape[1]].astype(np.float32)
        self._rng = np.random.default_rng(0)
        self.circles = [press.circle._replace(radius=min(PHOTOMETRIC.inner * press.circle.radius, PHOTOMETRIC.steepest * radius))
                        for press in presses]
        self._add_up()
        for _ in range(2):
            self.circles = [self._centred(k) for k in range(len(self.presses))]
            self._add_up()
            self._leave_out()

    def _add_up(self) -> None:
        """Equations of each press with the present circles, and of all."""
        self._sums = [self._equations(k) for k in range(len(self.presses))]
        self._total = sum(self._sums[1:], self._sums[0])

    def _leave_out(self) -> None:
        """Leave out presses beyond the border of the image, and those whose slopes differ more than usual from what the others predict:
        their circle is not on a ball."""
        rows, columns = self._x.shape
        for k in reversed(range(len(self.presses))):
            if not (0 <= self.circles[k].x <= columns - 1 and 0 <= self.circles[k].y <= rows - 1):
                self._drop(k, 'the ball is beyond the border of the image')
        while True:
            error = np.log([self._misfit(k) for k in range(len(self.presses))])
            middle = np.median(error)
            spread = max(float(robust_sigma(error - middle)), PHOTOMETRIC.usual_spread)
            worst = int(np.argmax(error))
            if error[worst] - middle < PHOTOMETRIC.unlike * spread:
                return
            self._drop(worst, 'its slopes differ from those that the other presses predict')

    def _drop(self, k: int, reason: str) -> None:
        """Leave out a press. Raises BadCalibration where too few remain."""
        if len(self.presses) == PHOTOMETRIC.min_presses:
            raise BadCalibration(f'{len(self.presses)} presses of a ball were found that agree with each other, and '
                                 f'{PHOTOMETRIC.min_presses} are needed; press it at twenty positions all over the gel, and lift it in '
                                 'between')
        self.left_out.append(f'{self.presses[k].name}: {reason}')
        self._total = self._total - self._sums[k]
        for kept in (self.presses, self.circles, self._sums):
            del kept[k]

    def _misfit(self, k: int) -> float:
        """Error of the slopes of a press by the fit without it, relative to these slopes."""
        seen, slope = self._on_ball(k)
        return float(np.linalg.norm(seen @ self._without(k) - slope) / np.linalg.norm(slope))

    @property
    def covered(self) -> float:
        """Share of the image between the presses."""
        hull = cv2.convexHull(np.float32([circle[:2] for circle in self.circles]))
        return float(cv2.contourArea(hull) / self._x.size)

    def steepest(self) -> list[float]:
        """Slope at the edge of each circle."""
        return [circle.radius / np.sqrt(self.radius**2 - circle.radius**2) for circle in self.circles]

    def _offsets(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distances (H, W) along x, along y and in all from the centre of a press."""
        x, y = self._x - self.circles[k].x, self._y - self.circles[k].y
        return x, y, np.hypot(x, y)

    def _outside(self, k: int, distance: np.ndarray) -> np.ndarray:
        return (distance > max(PHOTOMETRIC.outside * self.presses[k].circle.radius, 1.5 * self.radius)) & ~self.presses[k].hidden

    def _equations(self, k: int) -> NormalEquations:
        """Of the pixels of one press on the ball, and of as many outside."""
        press, (seen, slope) = self.presses[k], self._on_ball(k)
        flat = self._outside(k, self._offsets(k)[2])
        flat &= self._rng.random(flat.shape) < PHOTOMETRIC.flat_pixels / max(flat.sum(), 1)
        return NormalEquations.of(seen, slope) + NormalEquations.of(features(press.change[flat], self._position[flat]),
                                                                    np.zeros((np.count_nonzero(flat), 2)))

    def _on_ball(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Features and true slopes of the pixels of a press within its circle."""
        press, (x, y, distance) = self.presses[k], self._offsets(k)
        inside = (distance < self.circles[k].radius) & ~press.hidden
        below = np.sqrt(self.radius**2 - distance[inside]**2)
        return features(press.change[inside], self._position[inside]), np.stack([-x[inside], -y[inside]], axis=1) / below[:, None]

    def _without(self, k: int) -> np.ndarray:
        """Coefficients of the fit without one press."""
        return (self._total - self._sums[k]).solve()

    def _centred(self, k: int) -> Circle:
        """The circle of a press, moved to where the slopes of the fit without it point."""
        press, circle = self.presses[k], self.circles[k]
        inside = (self._offsets(k)[2] < circle.radius) & ~press.hidden
        slope = features(press.change[inside], self._position[inside]) @ self._without(k)
        sine = slope / np.sqrt(1 + (slope**2).sum(axis=1, keepdims=True))
        x, y = np.mean(self._x[inside] + self.radius * sine[:, 0]), np.mean(self._y[inside] + self.radius * sine[:, 1])
        return circle._replace(x=float(x), y=float(y))

    def model(self, backgrounds: list[np.ndarray]) -> DepthModel:
        """The model of all presses; backgrounds: working images of the untouched gel."""
        errors = self.errors
        model = self._model(self._total.solve(), backgrounds)
        width = self._x.shape[1]
        # The centre of a circle is no more certain than that of a contact: half of the variance of their distance is of the one.
        position = max(float(np.sqrt(np.mean(errors.position**2) / 2)), 0.01)
        along, squares = errors.free.sum(axis=0)
        return replace(model, depth_sigma=max(errors.depth_floor, 0.01) / width, slope_error=max(errors.relative, 1e-3),
                       position_sigma=position / width, skirt=float(np.sqrt(along / squares)) / width, steepest=float(max(self.steepest())))

    def _model(self, coefficients: np.ndarray, backgrounds: list[np.ndarray]) -> DepthModel:
        """A model without errors."""
        rows, columns = self._x.shape
        size = 32, max(round(rows * 32 / columns), 1)  # px
        small = cv2.resize(np.mean(backgrounds, axis=0, dtype=np.float32), size, interpolation=cv2.INTER_AREA)
        return DepthModel(coefficients, self._noise, small.astype(float), 1.0, 1.0, 1.0, 1.0)

    @cached_property
    def _noise(self) -> np.ndarray:
        """(3, 3) covariance of averaged changes where the skin is untouched."""
        flat = [averaged(press.change * ~press.hidden[..., None])[self._outside(k, self._offsets(k)[2])][::7]
                for k, press in enumerate(self.presses)]
        noise = np.concatenate(flat).astype(float)
        return noise.T @ noise / max(len(noise), 1) + 1e-12 * np.eye(3)

    @cached_property
    def errors(self) -> Errors:
        """At each press of the fit without it."""
        return Errors(*map(np.array, zip(*(self._error(k) for k in range(len(self.presses))))))

    def _error(self, k: int) -> tuple:
        press, circle = self.presses[k], self.circles[k]
        model = self._model(self._without(k), [press.image])
        depth, slope, changed = Reconstruction(model, press.hidden.shape).process(press.change, press.hidden)
        distance = self._offsets(k)[2]
        ball = np.sqrt(np.maximum(self.radius**2 - distance**2, 1.0))
        inside, edge = distance < circle.radius, np.abs(distance - circle.radius) < 1.0
        cap = float(self.radius - ball[edge].mean())
        found = float(depth[distance < max(0.1 * circle.radius, 1.0)].mean() - depth[edge].mean())
        _, middle = deeper_half(depth, distance < press.circle.radius)
        flat, curved = self._outside(k, distance), bend(slope)
        free = changed & (depth > 0) & (curved > 0) & (distance > circle.radius) & (distance < PHOTOMETRIC.outside * press.circle.radius)
        return (float((depth - ball)[inside].std()), found - cap, cap, middle - (circle.x, circle.y),
                float(np.sqrt(np.mean(depth[flat]**2))) if flat.any() else 0.0,
                np.array([curved[free] @ depth[free], curved[free] @ curved[free]]))


def draw_circles(path: Path, fit: BallFit) -> None:
    """Write a picture of the presses with their circles: white as found, black the part that is used."""
    side = int(3 * max(press.circle.radius for press in fit.presses)) | 1
    tiles = []
    for press, used in zip(fit.presses, fit.circles):
        picture = press.image.astype(np.uint8)
        for circle, colour in ((press.circle, (255, 255, 255)), (used, (0, 0, 0))):
            cv2.circle(picture, (round(8 * circle.x), round(8 * circle.y)), round(8 * circle.radius), colour, 1, cv2.LINE_AA, 3)
        tiles.append(cv2.getRectSubPix(picture, (side, side), (press.circle.x, press.circle.y)))
    across = int(np.ceil(np.sqrt(len(tiles))))
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % across)
    rows = [np.hstack(tiles[k:k + across]) for k in range(0, len(tiles), across)]
    cv2.imwrite(str(path), np.vstack(rows))
