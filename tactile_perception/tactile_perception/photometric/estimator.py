# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Image in; contact region, contacts and surface of a photometric gel out."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import cv2
import numpy as np

from .._core.common import ContactTracker
from ..common.dots import DotTracks
from ..common.estimates import AT_EDGE, NONE, ContactEstimate, ContactRegionEstimate, SlipEstimate
from ..common.surface import Moments, axes
from ..common.surface_points import NON_CONTACT, STICKING, SurfacePoints
from ..core.errors import BadFrame
from .constants import PHOTOMETRIC
from .force import ForceLaw
from .markers import dot_states
from .model import DepthModel, Reconstruction, deeper_half
from .observation import Background, relative_change, to_working_size


@dataclass(frozen=True)
class PhotometricResult:
    """region, contacts, wrench, slip: the estimates, slip None where it is not known; points: function that makes the SurfacePoints; depth:
    (H, W) m, and touching: (H, W) bool, of the working image, a pixel of which shows pixel m."""

    region: ContactRegionEstimate
    contacts: list[ContactEstimate]
    wrench: np.ndarray
    points: partial
    depth: np.ndarray
    touching: np.ndarray
    pixel: float
    slip: SlipEstimate | None = None

    def with_dots(self, tracks: DotTracks, slip: SlipEstimate | None, width: int) -> tuple[PhotometricResult, DotTracks]:
        """The result whose region has printed dots in place of surface points, and the dots with their positions on the skin.

        Parameters
        ----------
        tracks : DotTracks
            Dots of the image.
        slip : SlipEstimate or None
            Slip by these; None where it is not known.
        width : int
            Width of the image in px.
        """
        rows, columns = self.depth.shape
        uv = (tracks.uv + 0.5) * (columns / width) - 0.5
        column, row = np.rint(uv).astype(int).clip(0, (columns - 1, rows - 1)).T
        xyz = np.column_stack([(uv - (np.array([columns, rows]) - 1) / 2) * self.pixel, -self.depth[row, column]])
        state = dot_states(uv, self.touching, slip.slipping_fraction if slip and slip.state != NONE else 0.0)
        region = replace(self.region, dot_id=tracks.id, dot_state=state)
        return replace(self, region=region, slip=slip), replace(tracks, xyz=xyz)


class _Patch(NamedTuple):
    """A connected part of the skin that is in contact. label: in the image of labels; mask: (H, W) bool; moments: of it; normal: (3,)
    unit, mean, towards the object."""

    label: int
    mask: np.ndarray
    moments: Moments
    normal: np.ndarray


class PhotometricEstimator:
    """Estimates the shape of a gel from its colours, frame by frame.

    Parameters
    ----------
    model : DepthModel
        Calibrated model.
    scale : float
        Length in m on the gel that one pixel of the image shows.
    force : ForceLaw, optional
        Force of a contact; None: forces are NaN.
    """

    def __init__(self, model: DepthModel, scale: float, force: ForceLaw | None = None):
        self._model, self._scale, self._force = model, scale, force
        self._tracker = ContactTracker()
        self.set_reference()

    def set_reference(self) -> None:
        """Take the images of the next second for the untouched gel. All contacts end."""
        self._background: Background | None = None
        self._mean, self._count, self._start_s = None, 0, None
        self._tracker.reset()

    @property
    def warning(self) -> str:
        """What is wrong with the untouched gel; '' for nothing."""
        if self._background is None:
            return ''
        size = self._model.background.shape[1::-1]
        now = cv2.resize(self._background.image, size, interpolation=cv2.INTER_AREA)
        change = relative_change(now, self._model.background)
        overall, part = float(np.sqrt(np.mean(change**2, axis=(0, 1))).max()), np.abs(change).max(axis=2)
        limit = PHOTOMETRIC.significant_sigmas * self._model.slope_error
        if overall > limit:
            return (f'the untouched gel differs by {overall:.0%} from that of the calibration: the light changed, the gel was exchanged or '
                    'is dirty, or something touched it when the reference was taken; call set_reference, or calibrate again')
        if part.max() > limit + overall:
            row, column = np.unravel_index(np.argmax(part), part.shape)
            return (f'the untouched gel differs by {part.max():.0%} from that of the calibration at {(column + 0.5) / size[0]:.0%} of the '
                    f'width and {(row + 0.5) / size[1]:.0%} of the height of the image: something touched it there when the reference was '
                    'taken, or it is dirty; lift it and call set_reference, or clean it')
        return ''

    def process(self, image: np.ndarray, stamp_s: float) -> PhotometricResult:
        """Contact in one image.

        Parameters
        ----------
        image : ndarray of uint8, shape (H, W, 3)
            BGR.
        stamp_s : float
            Its stamp in s.

        Raises
        ------
        BadFrame
            If the image is grey, has not the size of those before it, or shows another field than those of the calibration.
        """
        if image.ndim != 3:
            raise BadFrame('the image is grey; the shape of the gel comes from its colours: publish colour images')
        if self._mean is None:
            self._check_field(image)
        working = to_working_size(image)
        self._observe(working, stamp_s)
        pixel = self._scale * image.shape[1] / working.shape[1]  # m
        background = self._background
        depth, slope, _ = self._reconstruction.process(background.change(working), background.hidden(working))
        touching = self._reconstruction.touching(depth, slope)
        depth *= np.float32(pixel)
        patches, labels = self._patches(touching, depth, pixel)
        region = self._region(patches, depth, pixel)
        tracked = self._tracker.assign(labels, [(patch.label, patch.moments) for patch in patches],
                                       PHOTOMETRIC.max_jump * PHOTOMETRIC.width_px * pixel, stamp_s)
        contacts = [replace(self._contact(patch, depth, slope, pixel), id=one.number) for patch, one in zip(patches, tracked)]
        points = partial(self._points, depth, slope, region.dot_state, pixel)
        return PhotometricResult(region, contacts, self._wrench(patches, contacts), points, depth, touching, pixel)

    def _observe(self, working: np.ndarray, stamp_s: float) -> None:
        """Average the untouched gel. Raises BadFrame for another size."""
        if self._mean is not None and working.shape != self._mean.shape:
            raise BadFrame(f'the image is another size than the untouched gel ({working.shape[1]} x {working.shape[0]} working px); '
                           'call set_reference after a change of the camera')
        self._start_s = stamp_s if self._start_s is None else self._start_s
        if self._background is not None and stamp_s - self._start_s >= PHOTOMETRIC.untouched_s:
            return
        self._count += 1
        self._mean = working.copy() if self._mean is None else self._mean + (working - self._mean) / self._count
        self._background = Background(self._mean)
        if self._count == 1:
            self._reconstruction = Reconstruction(self._model, self._background.shape)

    def _check_field(self, image: np.ndarray) -> None:
        """Raises BadFrame for an image that shows another field than those of the calibration."""
        rows, columns = self._model.background.shape[:2]
        field, known = self._scale * image.shape[1], self._model.field
        stretched = image.shape[0] * columns / image.shape[1] / rows
        if known and abs(field / known - 1) > PHOTOMETRIC.field_tolerance or abs(stretched - 1) > PHOTOMETRIC.field_tolerance:
            raise BadFrame(f'the image of {image.shape[1]} x {image.shape[0]} px shows {1e3 * field:.1f} mm of the gel by gel.scale, and '
                           f'those of the calibration show {1e3 * known:.1f} mm or have another ratio of width to height; set the camera '
                           'to the resolution of the calibration, or gel.scale to the length that a pixel shows now')

    def _patches(self, touching: np.ndarray, depth: np.ndarray, pixel: float) -> tuple[list[_Patch], np.ndarray]:
        """The parts of the skin that are in contact, largest first, and their labels (H, W)."""
        count, labels, sizes, _ = cv2.connectedComponentsWithStats(touching.astype(np.uint8))
        found = []
        for label in sorted(range(1, count), key=lambda one: -sizes[one, cv2.CC_STAT_AREA]):
            mask = labels == label
            if sizes[label, cv2.CC_STAT_AREA] < PHOTOMETRIC.min_pixels or (found and is_on_flank(depth, mask)):
                labels[mask] = 0
                continue
            left, top, columns, rows = sizes[label, :4]
            box = slice(max(top - 1, 0), top + rows + 1), slice(max(left - 1, 0), left + columns + 1)
            tilt = np.gradient(depth[box] / pixel)
            found.append(_Patch(label, mask, self._moments(mask, depth, pixel), _mean_normal(*(part[mask[box]] for part in tilt))))
        return found, labels

    def _moments(self, mask: np.ndarray, depth: np.ndarray, pixel: float) -> Moments:
        """Integrals over the pixels of a mask."""
        x, y, z = self._position(mask, depth, pixel)
        area = pixel**2
        return Moments(len(x) * area, np.array([0.0, 0.0, len(x) * area]), area * np.array([x.sum(), y.sum(), z.sum()]),
                       area * np.array([x @ x, x @ y, y @ y]))

    @staticmethod
    def _position(mask: np.ndarray, depth: np.ndarray, pixel: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """x, y, z in m, sensor frame, of the pixels of a mask."""
        row, column = np.nonzero(mask)
        middle = (np.array(mask.shape) - 1) / 2
        return (column - middle[1]) * pixel, (row - middle[0]) * pixel, -depth[mask].astype(float)

    def _region(self, patches: list[_Patch], depth: np.ndarray, pixel: float) -> ContactRegionEstimate:
        """The region of all patches, whose dots are the surface points."""
        state = np.zeros(depth.shape, np.uint8)
        for patch in patches:
            state[patch.mask] = STICKING
        every = slice(PHOTOMETRIC.point_step // 2, None, PHOTOMETRIC.point_step)
        nodes = state[every, every].ravel()
        region = ContactRegionEstimate(np.arange(nodes.size), np.where(nodes, STICKING, NON_CONTACT).astype(np.uint8))
        if not patches:
            return region
        total = sum((patch.moments for patch in patches[1:]), patches[0].moments)
        for patch in patches:
            outlines, holes = self._outlines(patch.mask, depth, pixel)
            region.outlines += outlines
            region.holes += holes
        region.area, region.centroid = total.area, total.centroid
        weights = [patch.moments.area for patch in patches]
        region.normal = np.average([patch.normal for patch in patches], axis=0, weights=weights)
        region.normal /= np.linalg.norm(region.normal)
        region.major_axis, region.minor_axis, region.orientation = axes(total, [*region.outlines, *region.holes], pixel)
        return region

    def _wrench(self, patches: list[_Patch], contacts: list[ContactEstimate]) -> np.ndarray:
        """(6,) N and N m: the pressing force, and its torque about the axes in the surface; NaN for what shear contributes."""
        if self._force is None:
            return np.full(6, np.nan)
        if not patches:
            return np.zeros(6)
        torque = sum(one.force * np.array([-patch.moments.centroid[1], patch.moments.centroid[0]]) for patch, one in zip(patches, contacts))
        return np.array([np.nan, np.nan, -sum(one.force for one in contacts), *torque, np.nan])

    def _outlines(self, mask: np.ndarray, depth: np.ndarray, pixel: float) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Outlines and holes of a mask, (M, 3) m each."""
        lines, family = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
        found, middle = ([], []), (np.array(mask.shape[::-1]) - 1) / 2
        for line, kin in zip(lines, family[0]):
            if len(line) > 2:
                column, row = line[:, 0].T
                xy = (line[:, 0] - middle) * pixel
                found[int(kin[3] >= 0)].append(np.column_stack([xy, -depth[row, column]]))
        return found

    def _contact(self, patch: _Patch, depth: np.ndarray, slope: np.ndarray, pixel: float) -> ContactEstimate:
        """The contact of a patch, without its number. It is at the centre of its deeper half."""
        deepest, centre = deeper_half(depth, patch.mask)
        position = np.append((centre - (np.array(depth.shape[::-1]) - 1) / 2) * pixel, -deepest)
        model, width = self._model, depth.shape[1] * pixel
        steep = PHOTOMETRIC.steep_error * pixel * self._reconstruction.uncertain_depth(slope, patch.mask)
        covariance = np.diag([(model.position_sigma * width)**2] * 2 + [
            (model.depth_sigma * width)**2 + (model.slope_error * deepest)**2 + steep**2])
        is_at_edge = patch.mask[[0, -1]].any() or patch.mask[:, [0, -1]].any()
        force = self._force.force(float(depth[patch.mask].sum()) * pixel**2, patch.moments.area) if self._force else np.nan
        return ContactEstimate(0, position, patch.normal, deepest, force, covariance, AT_EDGE if is_at_edge else 0, np.zeros(0, bool))

    def _points(self, depth: np.ndarray, slope: np.ndarray, state: np.ndarray, pixel: float) -> SurfacePoints:
        """The surface as a grid of points."""
        every = slice(PHOTOMETRIC.point_step // 2, None, PHOTOMETRIC.point_step)
        z = -depth[every, every].astype(float)
        nodes = np.zeros(depth.shape, bool)
        nodes[every, every] = True
        xyz = np.stack(self._position(nodes, depth, pixel), axis=-1).reshape(*z.shape, 3)
        normal = np.dstack([slope[every, every], np.ones(z.shape)])
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        displacement = np.zeros(xyz.shape)
        displacement[..., 2] = z
        unknown = np.full(xyz.shape, np.nan)
        return SurfacePoints(z.shape, *(part.reshape(-1, 3) for part in (xyz, normal, displacement, unknown)), np.full(z.size, np.nan),
                             state)


def _mean_normal(down: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(3,) unit, towards the object, of a surface whose depth changes so along y and along x: of the plane through its border in the mean,
    as the integral of slopes is."""
    normal = np.array([right.mean(), down.mean(), 1.0])
    return normal / np.linalg.norm(normal)


def is_on_flank(depth: np.ndarray, mask: np.ndarray) -> bool:
    """Whether the skin around a part of it is deeper than that itself: it is on the flank of another dent, and no dent of its own."""
    # px, side of the square whose dilation of a part of the skin shows what is around it
    around = cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return bool(depth[around & ~mask].max(initial=-np.inf) > depth[mask].max())
