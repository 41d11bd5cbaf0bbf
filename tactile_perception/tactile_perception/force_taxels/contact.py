# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts, contact region and wrench from the forces of taxels."""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from ..common.contact_tracker import ContactTracker
from ..common.estimates import ContactEstimate, ContactRegionEstimate
from ..common.surface import Moments
from ..common.surface_points import NON_CONTACT, STICKING
from .taxels import Taxels

_CARRIED = 0.1  # part of a taxel's force that the elastomer carries to the next one: less shows no contact there
_SPREAD = 1 / 12  # variance of a position within a taxel, in squared pitches: an even distribution
_MAX_JUMP = 1.5  # pitches over which a contact may move between frames, from border to border
_CORNERS = 0.5 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


@dataclass(frozen=True)
class Forces:
    """Forces of one frame: components (N, 3) along two tangents and inwards, and their variances (N, 3) of noise and offset; both in N, or
    in the unit of the device where its calibration is unknown; touched: (N,) bool; probability: (N,) that a taxel is touched."""

    components: np.ndarray
    variance: np.ndarray
    touched: np.ndarray
    probability: np.ndarray


def touched_taxels(taxels: Taxels, press: np.ndarray, probability: np.ndarray) -> np.ndarray:
    """Which taxels (N,) bear the object: more likely than not, and more than what the elastomer carries over from a neighbour."""
    carried = _CARRIED * press[taxels.neighbours].max(axis=1)
    return (probability > 0.5) & (press > carried)


class ContactFinder:
    """Connected taxels that press are a contact."""

    def __init__(self, taxels: Taxels):
        self._taxels, self._tracker = taxels, ContactTracker()

    def reset(self) -> None:
        """All contacts end."""
        self._tracker.reset()

    def find(self, forces: Forces, is_calibrated: bool, stamp_s: float) -> tuple[list[ContactEstimate], ContactRegionEstimate]:
        """Contacts and the region of all of them; dots of the region are the taxels."""
        taxels, touched = self._taxels, forces.touched
        state = np.where(touched, STICKING, NON_CONTACT).astype(np.uint8)
        region = ContactRegionEstimate(np.arange(len(touched)), state)
        region.dot_confidence = np.where(touched, forces.probability, 1 - forces.probability)
        if not touched.any():
            self._tracker.assign(np.zeros(len(touched), int), [], _MAX_JUMP * taxels.pitch, stamp_s)
            return [], region
        labels = taxels.groups(touched)
        found, moments = [], []
        for label in np.unique(labels[touched]):
            members = np.flatnonzero(labels == label)
            found.append(self._contact(members, forces, is_calibrated))
            moments.append((label, self._moments(members)))
            region.outlines.append(self._outline(members, found[-1].normal))
        order = sorted(range(len(found)), key=lambda k: -moments[k][1].area)
        tracked = self._tracker.assign(labels, [moments[k] for k in order], _MAX_JUMP * taxels.pitch, stamp_s)
        contacts = [replace(found[k], id=one.number) for k, one in zip(order, tracked)]
        self._summarise(region, np.flatnonzero(touched), forces.components[:, 2])
        return contacts, region

    def _contact(self, members: np.ndarray, forces: Forces, is_calibrated: bool) -> ContactEstimate:
        """The contact of some taxels, without its number. It is at the centre of pressure."""
        taxels, press = self._taxels, forces.components[members, 2]
        total = press.sum()
        share = press / total
        positions = taxels.positions[members]
        position, normal = share @ positions, share @ taxels.normals[members]
        normal = normal / np.sqrt(normal @ normal)
        away = positions - position
        along = np.eye(3) - normal[:, None] * normal
        spread = _SPREAD * taxels.pitch**2
        covariance = (away.T * (forces.variance[members, 2] / total**2)) @ away + (spread * (share @ share)) * along
        vector = taxels.axes[members].transpose(0, 2, 1) @ forces.components[members, :, None]
        force = -float(vector[:, :, 0].sum(axis=0) @ normal) if is_calibrated else np.nan
        mine = np.zeros(len(taxels.positions), bool)
        mine[members] = True
        return ContactEstimate(0, position, normal, np.nan, force, covariance, 0, mine)

    def _moments(self, members: np.ndarray) -> Moments:
        """Integrals over the cells of taxels."""
        cell, positions = self._taxels.pitch**2, self._taxels.positions[members]
        x, y = positions[:, 0], positions[:, 1]
        return Moments(len(members) * cell, cell * self._taxels.normals[members].sum(axis=0), cell * positions.sum(axis=0),
                       cell * np.array([x @ x, x @ y, y @ y]))

    def _outline(self, members: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Convex outline (M, 3), m, of the cells of taxels, seen along a normal."""
        taxels = self._taxels
        corners = taxels.positions[members][:, None] + taxels.pitch * (_CORNERS @ taxels.axes[members, :2])
        corners = corners.reshape(-1, 3)
        first = taxels.axes[members[0], 0]
        first = first - (first @ normal) * normal
        first /= np.sqrt(first @ first)
        x, y, z = normal
        a, b, c = first
        second = np.array([y * c - z * b, z * a - x * c, x * b - y * a])
        flat = np.column_stack([corners @ first, corners @ second]).astype(np.float32)
        return corners[cv2.convexHull(flat, returnPoints=False)[:, 0]]

    def _summarise(self, region: ContactRegionEstimate, members: np.ndarray, press: np.ndarray) -> None:
        """Area, centroid, normal and axes of all contacts together."""
        taxels = self._taxels
        share = press[members] / press[members].sum()
        region.area = len(members) * taxels.pitch**2
        region.centroid = taxels.positions[members].mean(axis=0)
        normal = share @ taxels.normals[members]
        region.normal = normal / np.sqrt(normal @ normal)
        away = taxels.positions[members, :2] - region.centroid[:2]
        (a, b), (_, c) = away.T @ away / len(members) + np.eye(2) * (taxels.pitch**2 * _SPREAD)
        middle, half = 0.5 * (a + c), float(np.hypot(0.5 * (a - c), b))
        region.major_axis, region.minor_axis = 4 * float(np.sqrt(middle + half)), 4 * float(np.sqrt(max(middle - half, 0.0)))
        # One cell more along one axis than along the other is no direction.
        if region.major_axis - region.minor_axis > taxels.pitch:
            region.orientation = 0.5 * float(np.arctan2(2 * b, a - c))


def total_wrench(taxels: Taxels, forces: Forces, alive: np.ndarray, error: float) -> tuple[np.ndarray, np.ndarray]:
    """Wrench (6,) at the origin, and its covariance (6, 6).

    forces: in N; error: relative standard deviation of the force of a taxel, by the calibration. A dead taxel counts as the mean of its
    neighbours, with as large an error.
    """
    bears = forces.touched | taxels.beside(forces.touched) & alive
    components = np.where(bears[:, None], forces.components, 0.0)
    squares = np.einsum('ij,ij->i', components, components)
    # A force that is too small to be seen on the other taxels is within their noise.
    variance = forces.variance + (error**2 * squares)[:, None]
    components, dead = taxels.filled(components, alive)
    variance[dead] = (components[dead]**2).sum(axis=1, keepdims=True)
    wrench = components.ravel() @ taxels.effect
    covariance = (taxels.effect.T * variance.ravel()) @ taxels.effect
    # The force is somewhere within the taxel's cell.
    covariance[3:, 3:] += np.eye(3) * (_SPREAD * taxels.pitch**2 * float(squares.sum()))
    return wrench, covariance
