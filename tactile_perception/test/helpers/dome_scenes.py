# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fields of an inflated dome, dented by a ball as an idealised balloon would be: a cap of the ball, from its rim a logarithmic slope that
fades towards the rim of the dome, the skin drawn a little towards the tip. Nothing of it is the estimator's."""

import numpy as np

from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.press.field import MarkerField
from tactile_perception.press.presses import Presses

DOME = MARKER_SENSORS['air_cushion']
RADIUS = (DOME.rim_radius**2 + DOME.height**2) / (2 * DOME.height)
CENTRE = np.array([0.0, 0.0, DOME.height - RADIUS])
EYE = np.array([0.001, -0.0005, -0.045])
BALL, FAR = 0.025, 0.11
PX, NOISE = 2000.0, 1.5e-5
SIX_POSITIONS = [(0.0, 0.0), (0.03, 0.0), (0.0, 0.045), (-0.03, 0.03), (-0.03, -0.045), (0.045, -0.03)]  # m, of presses


def markers():
    """(289, 3) m on the dome, NaN where the grid has none."""
    flat = DOME.grid() * 0.9
    arc = np.hypot(*flat.T)
    angle = arc / RADIUS
    xyz = np.column_stack([flat * np.sinc(angle / np.pi)[:, None], RADIUS * np.cos(angle)]) + CENTRE
    xyz[arc > 0.118] = np.nan
    return xyz


def dented(points, position, depth, ball=BALL):
    """Return points (K, 3), m, under a ball pressed straight down at position (2,), m, to depth, m."""
    height = np.sqrt((RADIUS + ball)**2 - position @ position)
    normal = np.array([*position, height]) / (RADIUS + ball)
    from_centre = points - CENTRE
    arc = RADIUS * np.arccos(np.clip(from_centre @ normal / RADIUS, -1, 1))
    rim = np.sqrt(depth * ball * 0.28)
    lower = np.where(arc < rim, 0.5 * (1 - (arc / rim)**2) + np.log(FAR / rim), np.log(FAR / np.clip(arc, rim, FAR)))
    lower = depth * lower / (0.5 + np.log(FAR / rim))
    towards = normal - (from_centre @ normal)[:, None] * from_centre / RADIUS**2
    drawn = 0.05 * depth * (arc / 0.03) * np.exp(-arc / 0.03)
    size = np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-9)
    down = np.array([0.0, 0.0, 1.0]) * 0.8 + 0.2 * normal
    return points - lower[:, None] * down / down[2] + drawn[:, None] * towards / size


def seen(points):
    """(K, 2) m in the plane through the dome's top."""
    return EYE[:2] + (points[:, :2] - EYE[:2]) * ((DOME.plane_z - EYE[2]) / (points[:, 2] - EYE[2]))[:, None]


def dome_field(touches=(), noise=NOISE, seed=0):
    """Return the MarkerField under touches [(position, depth)] or [(position, depth, ball)]."""
    rest = markers()
    now = rest.copy()
    for position, *how in touches:
        now = now + dented(rest, np.asarray(position, float), *how) - rest
    rng = np.random.default_rng([seed, *(int(1e7 * abs(v)) for position, *how in touches for v in (*position, how[0]))])
    shift = seen(now) - seen(rest) + rng.normal(0, noise, (len(rest), 2))
    plain = np.full(len(rest), np.nan)
    return MarkerField(seen(rest), shift, plain, np.tile(EYE, (len(rest), 1)), seen(rest) * PX, shift * PX, plain.copy())


def first_touch(position, ball=BALL):
    """Return the height, m, of the ball's lowest point when it just touches over position."""
    return np.sqrt((RADIUS + ball)**2 - position @ position) - ball + CENTRE[2]


def dome_presses(positions, depths=(0.012, 0.025, 0.038), ball=BALL, still=3, seed=0):
    """Return presses at positions, after some untouched frames."""
    pressed = [(np.asarray(position, float), depth) for position in positions for depth in depths]
    fields = [dome_field(seed=seed + 100 + k) for k in range(still)]
    fields += [dome_field([(position, depth, ball)], seed=seed) for position, depth in pressed]
    position = np.array([[np.nan] * 3] * still + [[*position, first_touch(position, ball) - depth] for position, depth in pressed])
    return Presses(tuple(fields), position, np.array([0.0] * still + [depth for _, depth in pressed]))
