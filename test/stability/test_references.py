# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rounding errors of estimators against closed forms and references computed with fifty digits (mpmath)."""
import functools

import numpy as np
import pytest

mp = pytest.importorskip('mpmath', reason='pip install mpmath')

from hard_geometry import CAMERA, CAP, MATRIX, SIGMA, _moved, _side, cloud  # noqa: E402
from tactile_perception.common.surface import DotSurface, axes, region_outlines  # noqa: E402
from tactile_perception.common.rigid_motion import fit_rigid  # noqa: E402
from tactile_perception.common.geometry import Cap, quaternion, rotation_matrix, rotation_vector  # noqa: E402
from tactile_perception.common.estimates import planar_twist  # noqa: E402
from tactile_perception.markers.published.gaussian_peak import gaussian  # noqa: E402
from tactile_perception.markers.touches.touch import TouchEstimate  # noqa: E402
from tactile_perception.markers.touches.tracker import ACCELERATION, TouchTracker  # noqa: E402
from tactile_perception.markers.view.marker_field import CameraView  # noqa: E402
from tactile_perception._core.finger import SphereFilter, centroid_covariance  # noqa: E402
from tactile_perception.finger.map import MIX, EquidistantMap, angles, direction, error_angle, exp_map, log_map, position  # noqa: E402
from tactile_perception.taxel.wrench import transform_wrench  # noqa: E402
from tactile_perception.touchpad.optics.absorption import WaterModel  # noqa: E402
from tactile_perception.touchpad.optics.colour import RingColours  # noqa: E402
from tactile_perception.touchpad.optics.light_path import LightPath  # noqa: E402

mp.mp.dps = 50
AXIS = np.array([2.0, -1.0, 2.0]) / 3
ANGLES = (0.0, 1e-12, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-5, np.pi - 1e-9, np.pi)


def plain(matrix):
    """A matrix of mpmath as an array."""
    return np.array(matrix.tolist(), float)


def exact(values):
    """An array as a matrix of mpmath."""
    return mp.matrix(np.atleast_2d(values).tolist())


def _exact_rotation(vector):
    x, y, z = map(mp.mpf, vector.tolist())
    angle = mp.sqrt(x * x + y * y + z * z)
    cross = mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, half = (mp.sin(angle) / angle, mp.sin(angle / 2) / (angle / 2)) if angle else (mp.mpf(1), mp.mpf(1))
    return mp.eye(3) + sine * cross + half**2 / 2 * cross * cross


def rotations():
    return np.array([rotation_matrix(angle * AXIS) for angle in ANGLES]), np.array([plain(_exact_rotation(a * AXIS)) for a in ANGLES]), 1


def rotation_vectors():
    """But for the sign of half a turn."""
    found = [rotation_vector(plain(_exact_rotation(angle * AXIS))) for angle in ANGLES]
    return np.array([vector if vector @ AXIS >= 0 else -vector for vector in found]), np.outer(ANGLES, AXIS), 1


def quaternions():
    turns = [angle * axis for angle in ANGLES for axis in (AXIS, *np.eye(3), np.array([0.6, -0.8, 0]))]
    found = np.array([quaternion(rotation_matrix(turn)) for turn in turns])
    true = np.array([[*(np.sinc(np.linalg.norm(t) / 2 / np.pi) / 2 * t), np.cos(np.linalg.norm(t) / 2)] for t in turns])
    return found * np.sign(np.sum(found * true, axis=1, keepdims=True)), true, 1


@functools.cache
def _exact_rigid():
    points = _moved()
    p, q = exact(points['p']), exact(points['q'])
    middle = [mp.matrix([mp.fsum(m[:, k]) / m.rows for k in range(3)]) for m in (p, q)]
    for m, centre in zip((p, q), middle):
        for k in range(m.rows):
            for axis in range(3):
                m[k, axis] -= centre[axis]
    u, _, v = mp.svd_r(q.T * p)
    turn = u * mp.diag([1, 1, mp.det(u * v)]) * v
    return plain(turn), plain(middle[1] - turn * middle[0]).ravel(), points


def rigid_turn():
    turn, _, points = _exact_rigid()
    return fit_rigid(points['p'], points['q']).rotation, turn, 1


def rigid_shift():
    _, shift, points = _exact_rigid()
    return fit_rigid(points['p'], points['q']).translation, shift, 1e-3


def rigid_far_away():
    """The same, a kilometre off: what is left of 1e-16 of a kilometre is 1e-10 m of 4 mm."""
    turn, _, points = _exact_rigid()
    return fit_rigid(points['p'] + 1e3, points['q'] + 1e3).rotation, turn, 1


def rigid_covariance():
    """Inverse of the normal equations of a small turn about the origin, then a shift."""
    turn, shift, points = _exact_rigid()
    carried = points['p'] @ turn.T + shift
    rows = np.concatenate([np.block([-_cross(c), np.eye(3)]) for c in carried])
    normal = exact(rows).T * exact(rows) / mp.mpf(SIGMA)**2
    fit = fit_rigid(points['p'], points['q'], np.full(40, SIGMA**-2))
    true = plain(normal**-1)
    scale = np.sqrt(np.outer(np.diag(true), np.diag(true)))
    return fit.covariance / scale, true / scale, 1


def _cross(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def twist():
    """Least squares over shift and turn."""
    rng = np.random.default_rng(5)
    place, velocity = cloud(20)[:, :2], rng.normal(0, 1e-3, (20, 2)) + [2e-3, 1e-3]
    rows, right = mp.matrix(40, 3), mp.matrix(40, 1)
    for k, ((x, y), (vx, vy)) in enumerate(zip(place, velocity)):
        rows[2 * k, 0], rows[2 * k, 2], right[2 * k] = 1, -mp.mpf(y), mp.mpf(vx)
        rows[2 * k + 1, 1], rows[2 * k + 1, 2], right[2 * k + 1] = 1, mp.mpf(x), mp.mpf(vy)
    linear, turn, _ = planar_twist(place, velocity)
    return np.array([*linear, turn]), plain(mp.lu_solve(rows, right)).ravel(), 1e-3


def ellipse_of_dots():
    """Area, axes and direction of an ellipse of 12 by 7 mm drawn by dots 1 mm apart: what the grid leaves of it."""
    row, column = np.mgrid[:23, :23]
    x, y = (column - 11) * 1e-3, (row - 11) * 1e-3
    along, across = x * np.cos(0.5) + y * np.sin(0.5), y * np.cos(0.5) - x * np.sin(0.5)
    radius = np.hypot(along / 6e-3, across / 3.5e-3)
    score = np.clip(0.5 + (1 - radius) * 4.2, 0, 1)
    surface = DotSurface(np.stack([x, y, 0 * x], axis=-1))
    (outline, *_), (found, *_), _ = region_outlines(score, surface)
    major, minor, angle = axes(found, outline.loops, 1e-3)
    return np.array([found.area / (np.pi * 21e-6), major / 12e-3, minor / 7e-3, angle / 0.5]), np.ones(4), 1


THETAS = np.array([0.0, 1e-15, 1e-9, 1e-4, 0.7, np.pi / 2 - 1e-9, np.pi / 2, 3.0, np.pi - 1e-9])
PHIS = np.array([np.pi, -np.pi + 1e-12, 0.0, 1.0])


def sphere_to_plane_and_back():
    """From the pole over the rim to the other pole, azimuth pi among them; angles at the poles are not told."""
    phi, theta = (part.ravel() for part in np.meshgrid(PHIS, THETAS))
    true = np.array([[float(mp.cos(p) * mp.sin(t)), float(mp.sin(p) * mp.sin(t)), float(mp.cos(t))] for p, t in zip(phi, theta)])
    return exp_map(log_map(direction(phi, theta))), true, 1


def polar_angles():
    return angles(direction(1.0 + 0 * THETAS, THETAS))[1], THETAS, 1


def error_angles():
    """Between directions a little apart, at the pole and at the rim, down to 1e-9 rad: relative to the angle."""
    apart = np.array([1e-9, 1e-7, 1e-4, 0.5])
    found = [error_angle(direction(np.full(4, 2.0), at + 0 * apart), direction(np.full(4, 2.0), at + apart)) / apart
             for at in (0.0, np.pi / 2)]
    return np.array(found), np.ones((2, 4)), 1


def paper_map():
    """Eqs 3, 4 and 7 on half widths."""
    found, place = EquidistantMap(np.array([0.03, -0.02]), 1.4), np.array([[0.03, -0.02], [0.03 + 1e-12, -0.02], [0.6, 0.3], [-0.7, 0.7]])
    true = []
    for x, y in place - found.offset:
        radius = mp.sqrt(mp.mpf(x)**2 + mp.mpf(y)**2)
        theta, way = mp.mpf(1.4) * radius, (mp.mpf(x) / radius, mp.mpf(y) / radius) if radius else (0, 0)
        true.append([float(mp.sin(theta) * way[0]), float(mp.sin(theta) * way[1]), float(mp.cos(theta))])
    return found.normals(place), np.array(true), 1


def place_covariance():
    """First-order spread of x = (X / T, Y / T) by derivatives worked out by mpmath."""
    noise = np.array([[4, 1, 0.5, 0], [1, 5, -0.3, 0], [0.5, -0.3, 6, 0], [0, 0, 0, 1.0]]) * 1e-6
    sums = np.array([0.3, -0.2, 1.1])
    slope = plain(mp.matrix([[mp.diff(lambda *s: s[k] / s[2], tuple(sums), tuple(int(n == j) for n in range(3))) for j in range(3)]
                             for k in (0, 1)]))
    true = slope @ noise[:3, :3] @ slope.T
    found = centroid_covariance(sums[:2] / sums[2], sums[2], noise, 0.0)
    return found / true, np.ones((2, 2)), 1


def detector_place():
    """Voltages of a spot at a place of an ideal detector (eq 1)."""
    place = np.array([[0, 0], [0.9, -0.4], [-1, 1], [1e-12, 0]])
    x, y = place.T
    volts = np.column_stack([1 - x - y, 1 + x - y, 1 + x + y, 1 - x + y]) / 4
    return position(volts @ MIX), place, 1


def gaussian_peak():
    """Centre and height of an exact Gaussian over five markers, 1e-4 deep or 1e6."""
    x, centre = np.arange(-2, 3) * 4.5e-3 + 0.02, 0.0213
    found = [gaussian(x, top * np.exp(-(x - centre)**2 / (2 * 6e-3**2))) for top in (1e-4, 3e-3, 1e6)]
    return np.array([[c / centre, height / top] for (c, height), top in zip(found, (1e-4, 3e-3, 1e6))]), np.ones((3, 2)), 1


def gaussian_least_squares():
    """The parabola through noisy logarithms by mpmath (eqs 9 to 13)."""
    x = np.arange(-2, 3) * 4.5e-3
    y = 3e-3 * np.exp(-(x - 1e-3)**2 / (2 * 7e-3**2)) * np.array([1.03, 0.98, 1.01, 0.97, 1.02])
    rows = mp.matrix([[1, mp.mpf(v), mp.mpf(v)**2] for v in x.tolist()])
    d = mp.lu_solve(rows, mp.matrix([mp.log(v) for v in y.tolist()]))
    true = np.array([float(-d[1] / (2 * d[2])), float(mp.exp(d[0] - d[1]**2 / (4 * d[2])))])
    return np.array(gaussian(x, y)) / true, np.ones(2), 1


def beer_lambert():
    """Ratios that water of a known length leaves, back to the length."""
    lengths = np.array([0.0, 1e-6, 0.01, 0.03, 0.3])
    constants, absorptions = np.array([0.2, 0.1]), np.array([41.0, 30.0])
    path = LightPath(-0.011, -0.040, 0.014, 0.3, (0.0, 0.0, -0.040))
    model = WaterModel(path, constants, absorptions, np.array([[4e-4, 1e-4], [1e-4, 3e-4]]), 8.0)
    ratios = [[float(constants[k] - absorptions[k] * mp.mpf(length)) for k in (0, 1)] for length in lengths]
    found, _ = model.path_lengths(RingColours(np.array(ratios), np.zeros(5), np.full(5, 16), np.zeros(5)))
    return found, lengths, 1


def light_path():
    """Eight lamps, one by one: mean slant by irradiance, and the length there and back."""
    path = LightPath(-0.011, -0.040, 0.014, 0.3, (0.0, 0.0, -0.040))
    places = np.array([[0, 0, 0.013], [6e-3, -4e-3, 0.009], [0.0154, 0.0, 1e-6]])
    normals = (places - [0, 0, CAP.centre_z]) / CAP.curvature_radius
    true = []
    for place, normal in zip(places, normals):
        weights, slants = [], []
        for k in range(8):
            lamp = [mp.mpf('0.014') * mp.cos(2 * mp.pi * k / 8), mp.mpf('0.014') * mp.sin(2 * mp.pi * k / 8), mp.mpf('-0.040')]
            way = [mp.mpf(p) - v for p, v in zip(place.tolist(), lamp)]
            distance = mp.sqrt(mp.fsum(v * v for v in way))
            facing = mp.fsum(v * mp.mpf(n) for v, n in zip(way, normal.tolist())) / distance
            weights.append((max(facing, 0) + mp.mpf('0.3') + mp.mpf('1e-6')) / distance**2)
            slants.append(distance / way[2])
        slant = mp.fdot(weights, slants) / mp.fsum(weights)
        away = [mp.mpf(place[0]), mp.mpf(place[1]), mp.mpf(place[2]) + mp.mpf('0.040')]
        up = away[2] / mp.sqrt(mp.fsum(v * v for v in away))
        true.append(float((mp.mpf(place[2]) + mp.mpf('0.011')) * (1 / up + slant)))
    return path.lengths(places, normals)[0] / true, np.ones(3), 1


def homography():
    """Plane to image without distortion, back by mpmath's inverse."""
    side = _side()
    flat_uv = np.array([[100.0, 80], [320, 240], [600, 400]])
    side = type(side)(side.size, MATRIX, np.zeros(5), side.homography, side.eye)
    back = exact(side.homography)**-1
    true = []
    for u, v in flat_uv.tolist():
        seen = back * mp.matrix([(mp.mpf(u) - 320) / 600, (mp.mpf(v) - 240) / 605, 1])
        true.append([float(seen[0] / seen[2]), float(seen[1] / seen[2])])
    return side.place(flat_uv), np.array(true), 1e-2


def pixel_area():
    """The plane's area under a pixel, with distortion: by central differences of the view itself, good to 1e-6."""
    view, uv, h = CameraView(CAMERA, 0.0), np.array([[100.0, 80], [320, 240], [600, 400]]), 0.02
    look = [(view.back_project(uv + step)[0] - view.back_project(uv - step)[0]) / (2 * h) for step in ([h, 0], [0, h])]
    return view.back_project(uv)[0][:, 2] / np.abs(look[0][:, 0] * look[1][:, 1] - look[0][:, 1] * look[1][:, 0]), np.ones(3), 1


def grazing_rays():
    """Where rays meet the far side of a sphere, to where they just touch it."""
    cap, height = Cap(), np.array([0.0, 0.01, 0.0199, 0.02 - 1e-9])
    origin, rays = np.array([-0.05, 0, cap.centre_z]), np.tile([1.0, 0, 0], (4, 1))
    found = [cap.ranges(origin + [0, 0, h], rays[:1])[0] for h in height]
    return np.array(found), np.array([float(mp.mpf('0.05') + mp.sqrt(mp.mpf('0.02')**2 - mp.mpf(h)**2)) for h in height.tolist()]), 0.05


def touch_filter():
    """Ten steps of a Kalman filter of place and velocity, each axis by itself, worked out by mpmath."""
    tracker, sigma, step = TouchTracker(), 1e-4, 0.01
    seen = 1e-3 * np.cumsum(np.random.default_rng(2).uniform(0, 0.2, 10))
    for k, x in enumerate(seen):
        found, = tracker.process([TouchEstimate(np.array([x, 0, -1e-3]), 1e-3, sigma**2 * np.eye(3), sigma)], step * k)
    noise, push = mp.mpf(sigma)**2 + mp.mpf(1e-5)**2, mp.mpf(ACCELERATION)**2
    state, spread = mp.matrix([mp.mpf(seen[0]), 0]), mp.diag([noise, mp.mpf(0.3)**2])
    for k, x in enumerate(seen.tolist()[1:], 1):
        t = mp.mpf(step * k) - mp.mpf(step * (k - 1))
        move, gain = mp.matrix([[1, t], [0, 1]]), mp.matrix([t * t / 2, t])
        state, spread = move * state, move * spread * move.T + push * gain * gain.T
        follow = spread[:, 0] / (spread[0, 0] + noise)
        state, spread = state + follow * (mp.mpf(x) - state[0]), spread - follow * spread[0, :]
    return np.array([found.estimate.position[0] / float(state[0]), found.estimate.covariance[0, 0] / float(spread[0, 0])]), np.ones(2), 1


def sphere_filter():
    """Along a great circle over the pole it is a Kalman filter of angle and speed: ten steps of it."""
    smooth, sigma, step = SphereFilter(20.0), 1e-3, 5e-3
    seen = -0.01 + 0.4 * step * np.arange(10)
    for theta in seen:
        normal = direction(0.0, theta)
        across = np.outer(direction(0.0, theta + np.pi / 2), direction(0.0, theta + np.pi / 2)) + np.diag([0, 1.0, 0])
        found, spread = smooth.update(normal, sigma**2 * across, step)
    noise = mp.mpf(sigma)**2
    state, cov = mp.matrix([mp.mpf(seen[0]), 0]), mp.diag([noise, 100])
    move, gain = mp.matrix([[1, step], [0, 1]]), mp.matrix([mp.mpf(step)**2 / 2, step])
    for theta in seen.tolist()[1:]:
        state, cov = move * state, move * cov * move.T + 400 * gain * gain.T
        follow = cov[:, 0] / (cov[0, 0] + noise + mp.mpf(1e-12))
        state, cov = state + follow * (mp.mpf(theta) - state[0]), cov - follow * cov[0, :]
    along = direction(0.0, float(state[0]) + np.pi / 2)
    return np.array([np.arctan2(found[0], found[2]) / float(state[0]), along @ spread @ along / float(cov[0, 0])]), np.ones(2), 1


def wrench_elsewhere():
    """The moment about another point, in whole numbers."""
    found = transform_wrench(np.array([1.0, 2, 3, 4, 5, 6]), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), np.array([7.0, 8, 9]))
    return found, np.array([-2, 1, 3, -5 + 8 * 3 - 9 * 1, 4 + 9 * -2 - 7 * 3, 6 + 7 * 1 - 8 * -2]), 1


def surface_of_parabola():
    """Between dots on a paraboloid, by cubic convolution: exact."""
    row, column = np.mgrid[:9, :9].astype(float)
    height = 0.013 - 20 * ((row - 4)**2 + 0.5 * (column - 4)**2) * 1e-6
    surface = DotSurface(np.stack([column * 1e-3, row * 1e-3, height], axis=-1))
    places = np.random.default_rng(0).uniform(1.2, 6.8, (40, 2))
    true = 0.013 - 20 * ((places[:, 0] - 4)**2 + 0.5 * (places[:, 1] - 4)**2) * 1e-6
    return surface.points(places)[:, 2], true, 1e-3


# Largest error relative to each reference's scale. Rounding enters the range of a grazing ray by its square root; 1e-7 allows for single
# precision inside.
ALLOWED = {
    rotations: 1e-15, rotation_vectors: 1e-14, quaternions: 1e-14, rigid_turn: 1e-14, rigid_shift: 1e-13, rigid_far_away: 1e-9,
    rigid_covariance: 1e-12, twist: 1e-12, ellipse_of_dots: 0.02, sphere_to_plane_and_back: 1e-15,
    polar_angles: 1e-15, error_angles: 2e-7, paper_map: 1e-15, place_covariance: 1e-12, detector_place: 1e-15, gaussian_peak: 1e-12,
    gaussian_least_squares: 1e-12, beer_lambert: 1e-15, light_path: 1e-13, homography: 1e-13, pixel_area: 1e-5, grazing_rays: 1e-8,
    touch_filter: 1e-12, sphere_filter: 1e-6, wrench_elsewhere: 1e-15, surface_of_parabola: 1e-14,
}


@pytest.mark.parametrize('reference', ALLOWED, ids=lambda reference: reference.__name__)
def test_against_a_reference_of_many_digits(record, reference):
    found, true, scale = reference()
    error = float(np.abs(np.asarray(found) - true).max()) / scale
    record.note(reference.__name__.replace('_', ' '), 'reference', f'within {ALLOWED[reference]:g}', 'told', error, f'of {scale:g}')
    assert error <= ALLOWED[reference]
