# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Robust fit of a rigid motion by stacked equations in NumPy: what the compiled one measures itself against.

A motion is a twist (6,): translation of the centre (m a frame) and w = 2 tan(angle / 2) times the axis. Cayley's form is exact and linear:
after - before = v + w x ((before + after) / 2 - centre).
"""
import numpy as np

PRIOR = np.array([1, 1, 1, 5e-3, 5e-3, 5e-3])  # square roots of the prior's weights
TURNS = np.array([0, 0, 0, 1, 1, 1])


class DotMotions:
    """Motions of N dots in contact between two frames: before, after (N, 3) m, normals (N, 3), seen from origin (3,), m.

    across, along: standard deviation of a motion across the ray and along the normal, m.
    """

    def __init__(self, before, after, normals, origin, across, along):
        self.centre, self.across, self.along = after.mean(axis=0), across, along
        rays = (before + after) / 2 - origin
        rays /= lengths(rays)[:, None]
        offset, moved = (before + after) / 2 - self.centre, after - before
        turns = np.stack([np.cross(axis, offset) for axis in np.eye(3)], axis=2)
        rows = np.concatenate([np.tile(np.eye(3), (len(before), 1, 1)), turns], axis=2)
        free = np.eye(3) - rays[:, :, None] * rays[:, None]
        self.rows, self.values = free @ rows, (free @ moved[:, :, None])[:, :, 0]
        self.normal_rows, self.normal_values = (normals[:, None] @ rows)[:, 0], (normals * moved).sum(axis=1)
        self.moved_across = self.values

    def residuals(self, twist):
        """(N, 3) m: each dot's motion across its ray less that of the twist (6,)."""
        return self.values - self.rows @ twist

    def normal_residuals(self, twist):
        """(N,) m: the same along the normals."""
        return self.normal_values - self.normal_rows @ twist

    def constrained_to_normals(self, twist):
        """twist (6,) with the components that move the surface along its normals fitted to the dots, the others kept."""
        return self.fit_robust(twist, np.zeros_like(self.values), 1.0, 1.0, 1e-3, np.zeros(len(self.values)))

    def least_squares(self, carried, touching, expected, hold, turn):
        """Twist (6,) with weights carried (N,) across the rays, touching (N,) along the normals, hold for the expected one, turn for no
        turn."""
        share = self.across / self.along
        lines = [np.repeat(np.sqrt(carried), 3)[:, None] * self.rows.reshape(-1, 6), share * np.sqrt(touching)[:, None] * self.normal_rows,
                 np.diag(np.sqrt(hold) * PRIOR), np.diag(np.sqrt(1e-4 + turn * TURNS) * PRIOR)]
        right = [np.repeat(np.sqrt(carried), 3) * self.values.ravel(), share * np.sqrt(touching) * self.normal_values,
                 np.sqrt(hold) * PRIOR * expected, np.zeros(6)]
        scaled = np.concatenate(lines) / PRIOR
        return np.linalg.lstsq(scaled, np.concatenate(right), rcond=None)[0] / PRIOR

    def fit_robust(self, start, drag, coarse, fine, hold, weights):
        """Twist (6,) by reweighting, the scale reduced from coarse to fine, m; a dot that leads along its drag (N, 3) keeps its weight."""
        fresh, turn = start is None, 0.1 * np.mean(weights)
        twist = self.least_squares(weights, np.ones(len(weights)), np.zeros(6), 0, turn) if fresh else start
        for bound in np.geomspace(coarse, fine, 4):
            left, off = self.residuals(twist), self.normal_residuals(twist) / (3 * self.along)
            size = lengths(left)
            leads = (left * drag).sum(axis=1) > 0.3 * lengths(drag) * size
            square = (size / bound)**2 * np.where(leads, 0.04, 1)
            expected, held = (np.zeros(6), 0) if fresh else (start, hold)
            twist = self.least_squares(weights / (1 + square)**2, 1 / (1 + off**2), expected, held, turn)
        return twist


def across_rays(before, after, origin):
    """Motions (N, 3) m from before to after (N, 3) m across the rays from origin (3,), and these unit rays (N, 3)."""
    rays = (before + after) / 2 - origin
    rays /= lengths(rays)[:, None]
    moved = after - before
    return moved - np.einsum('ij,ij->i', moved, rays)[:, None] * rays, rays


def lengths(vectors):
    """Lengths (N,) of vectors (N, C)."""
    return np.sqrt(np.einsum('ij,ij->i', vectors, vectors))


def twist_about(twist, centre, to):
    """The twist (6,) about the point to (3,) instead of centre (3,)."""
    return np.concatenate([twist[:3] + np.cross(twist[3:], to - centre), twist[3:]])
