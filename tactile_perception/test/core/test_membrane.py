# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The membrane's kernels against its energy, worked out triangle by triangle, and against the same steps with dense matrices."""
import numpy as np
import pytest
from hole_reference import filled_holes
from tactile_perception import _core

ROWS, COLUMNS, STIFFNESS, SHARE, PRESSURE = 9, 8, 90.0, 0.8, 2000.0
SIZE, GRID = ROWS * COLUMNS, {'rows': ROWS, 'columns': COLUMNS}
ORIGIN = np.array([0.0, 0.0, -0.04])
ROW, COLUMN = np.divmod(np.arange(SIZE), COLUMNS)
INNER = (ROW > 0) & (ROW < ROWS - 1) & (COLUMN > 0) & (COLUMN < COLUMNS - 1)


def rest_places(seed=0, uneven=30e-6):
    x, y = (COLUMN - 3.5) * 1.3e-3, (ROW - 4) * 1.2e-3
    even = np.stack([x, y, -(x**2 + y**2) / 0.04], axis=1)
    return even + np.random.default_rng(seed).normal(size=even.shape) * uneven


def rays_to(places):
    away = places - ORIGIN
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def triangles():
    """Corners (T, 3): each cell is cut along both diagonals."""
    a = (np.arange(ROWS - 1)[:, None] * COLUMNS + np.arange(COLUMNS - 1)).ravel()
    b, c, d = a + 1, a + COLUMNS, a + COLUMNS + 1
    return np.stack([[a, b, c], [b, d, c], [a, b, d], [a, d, c]]).transpose(2, 0, 1).reshape(-1, 3)


def energy(rest, places):
    """G/2 (tr C + a (A0/A)^2) A0 of all triangles, each of which counts half."""
    total = 0.0
    for corners in triangles():
        before, now = np.diff(rest[corners], axis=0), np.diff(places[corners], axis=0)
        shape, metric = before @ before.T, now @ now.T
        area0, area = np.sqrt(np.linalg.det(shape)) / 2, np.sqrt(np.linalg.det(metric)) / 2
        total += STIFFNESS / 4 * (np.trace(np.linalg.solve(shape, metric)) + SHARE * (area0 / area)**2) * area0
    return total


def slope_of(function, places, step=1e-8):
    """Central differences of a function (scalar or (K,)) by each coordinate of places."""
    found = []
    for k in np.ndindex(*places.shape):
        moved = np.zeros_like(places)
        moved[k] = step
        found.append((function(places + moved) - function(places - moved)) / (2 * step))
    return np.array(found).reshape(*places.shape, *np.shape(found[0]))


@pytest.fixture(scope='module')
def pad():
    rest = rest_places()
    of = _core.membrane_at_rest(rest, stiffness=STIFFNESS, area_share=SHARE, **GRID)
    force, share = _core.membrane_forces(rest, of, **GRID)
    return rest, of, share + force / PRESSURE


def test_the_force_is_the_slope_of_the_energy(pad):
    rest, of, _ = pad
    places = rest + np.random.default_rng(1).normal(size=rest.shape) * 0.1e-3
    force, _ = _core.membrane_forces(places, of, **GRID)
    expected = -slope_of(lambda x: energy(rest, x), places)
    np.testing.assert_allclose(force, expected, atol=1e-5 * np.abs(expected).max())


def test_the_shares_of_a_plane_add_up_to_its_area():
    flat = rest_places(uneven=0.0) * [1, 1, 0]
    of = _core.membrane_at_rest(flat, stiffness=STIFFNESS, area_share=SHARE, **GRID)
    share = _core.membrane_forces(flat, of, **GRID)[1]
    assert share.sum(axis=0) == pytest.approx([0, 0, 8 * 7 * 1.3e-3 * 1.2e-3], abs=1e-15)
    np.testing.assert_allclose(share[INNER, 2], 1.3e-3 * 1.2e-3)


def normal_load(pad, places, pressure, normal=None):
    """Load along the normals (those held, where given) times the area, over pressure and area at places."""
    _, of, residual = pad
    force, share = _core.membrane_forces(places, of, **GRID)
    normal = share / np.linalg.norm(share, axis=1, keepdims=True) if normal is None else normal
    return ((force + pressure * (share - residual)) * normal).sum(axis=1), normal, np.linalg.norm(share, axis=1)


def dense_slopes(pad, places, rays, pressure):
    """(K, K): derivatives of the loads by the ranges, by differences."""
    _, normal, area = normal_load(pad, places, pressure)
    found = np.zeros((SIZE, SIZE))
    for k in range(SIZE):
        moved = np.zeros_like(places)
        moved[k] = 1e-8 * rays[k]
        found[:, k] = (normal_load(pad, places + moved, pressure, normal)[0] - normal_load(pad, places - moved, pressure, normal)[0]) / 2e-8
    return np.where(INNER[:, None], found / (pressure * area)[:, None], 0.0)


def test_slopes_are_those_of_the_loads(pad):
    rest, of, residual = pad
    places = rest + np.random.default_rng(2).normal(size=rest.shape) * 0.1e-3
    rays = rays_to(places)
    slopes = _core.membrane_slopes(places, rays, of, residual, pressure=3000.0, **GRID)
    expected = dense_slopes(pad, places, rays, 3000.0)
    for k in np.flatnonzero(INNER):
        near = [k + i * COLUMNS + j for i in (-1, 0, 1) for j in (-1, 0, 1)]
        np.testing.assert_allclose(slopes[k], expected[k, near], atol=1e-5 * np.abs(expected).max())
    assert not slopes[~INNER].any()


def test_loads_are_what_the_object_must_carry(pad):
    rest, of, residual = pad
    dented = rest - np.outer(0.4e-3 * np.exp(-((ROW - 4.0)**2 + (COLUMN - 3.5)**2) / 2), [0, 0, 1])
    places, _, normal, force, load = _core.membrane_loads(np.arange(SIZE), dented, rest, of, residual, ORIGIN, rest_pressure=PRESSURE,
                                                          settled=0.25, **GRID)
    np.testing.assert_allclose(places, dented, atol=1e-15)
    held = np.hypot(ROW - 4, COLUMN - 3.5) < 1
    assert load[held].min() > 1 and np.abs(load[~INNER]).max() == 0
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1)
    elastic, share = _core.membrane_forces(dented, of, **GRID)
    pressures = np.linalg.lstsq((share - residual)[INNER].reshape(-1, 1), -(force + elastic)[INNER].ravel(), rcond=None)[0]
    np.testing.assert_allclose(force[INNER], -(elastic + pressures * (share - residual))[INNER], atol=1e-9)
    np.testing.assert_allclose(load[INNER], -(force * share).sum(axis=1)[INNER] / (pressures * (share**2).sum(axis=1)[INNER]), rtol=1e-9)


def log_ratio(load, misfit, variance):
    below, above, narrow = 0.4**2 + variance, 1.0 + variance, misfit**2 + variance
    wide, mean_width = np.where(load < 1.1, below, above), (np.sqrt(below) + np.sqrt(above)) / 2
    return (load**2 / narrow - (load - 1.1)**2 / wide + np.log(narrow / mean_width**2)) / 2


def expected_load(load, touched, misfit):
    free, held = (1 - touched) / misfit**2, touched / np.where(load < 1.1, 0.4, 1.0)**2
    return free + held, (free + held) * load - held * 1.1


def reference(pad, rays, measured, weight, ranges, response):
    """Steps from nothing, with dense matrices and differences: ranges, probabilities, pressure."""
    pressure, touched, anchor, last = PRESSURE, np.zeros(SIZE), ranges.copy(), 1.0
    variance = np.full(SIZE, 1e3)
    variance[INNER] = 1 / np.maximum(response.T @ weight[INNER], 1e-3)
    for number, misfit in enumerate((1.0, .7, .4, .25, .15, .2)):
        places = ORIGIN + ranges[:, None] * rays
        total, normal, area = normal_load(pad, places, pressure)
        load = np.where(INNER, total / (pressure * area), 0.0)
        if number:
            gain = log_ratio(load + variance * expected_load(load, touched, last)[1], misfit, variance)
            wide = np.pad(touched.reshape(ROWS, COLUMNS), 1)
            beside = (wide[2:, 1:-1] + wide[:-2, 1:-1] + wide[1:-1, 2:] + wide[1:-1, :-2]).ravel() / 4
            touched = np.where(INNER, 1 / (1 + np.exp(-np.clip(gain + 4 * (2 * beside - 1), -30, 30))), 0.0)
        last = misfit
        w, pull = (part * INNER for part in expected_load(load, touched, misfit))
        slopes = np.column_stack([dense_slopes(pad, places, rays, pressure),
                                  np.where(INNER, ((_core.membrane_forces(places, pad[1], **GRID)[1] - pad[2]) * normal).sum(axis=1)
                                           / (pressure * area), 0.0)])
        off = ranges - measured
        trust = weight / (1 + off**2 * weight / 16) if number else weight
        matrix = slopes.T @ (w[:, None] * slopes) + np.diag(np.append(trust + 1e6, 0.0))
        gradient = slopes.T @ pull + np.append(trust * off + 1e6 * (ranges - anchor), 0.0)
        step = np.linalg.solve(matrix, gradient)
        change = np.clip(-step[-1], -400, 400)
        moved = np.linalg.solve(matrix[:-1, :-1], gradient[:-1] + matrix[:-1, -1] * change)
        ranges, pressure = ranges - np.clip(moved, -4e-4, 4e-4), pressure + change
    return ranges, touched, pressure


FOUND = ('places', 'ranges', 'touched', 'pressure', 'seen', 'weight', 'rays', 'displaced', 'moved', 'lifted')


def solved(pad, rays, measured, sigma, response, **changes):
    """All results by name, of dots that are all seen."""
    start = {'places': pad[0], 'touched': np.zeros(SIZE), 'id': np.arange(SIZE), 'scale': 1.0, 'fresh': True} | changes
    numbers = {name: start.pop(name) for name in ('scale', 'fresh')}
    return dict(zip(FOUND, _core.solve_membrane(rays, measured, sigma, rest=pad[0], triangles=pad[1], residual=pad[2], response=response,
                                                origin=ORIGIN, pressure=PRESSURE, **start, **numbers, **GRID)))


def test_a_press_from_nothing_is_solved_as_with_dense_matrices(pad):
    rest, rng = pad[0], np.random.default_rng(3)
    rays, start = rays_to(rest), np.linalg.norm(rest - ORIGIN, axis=1)
    pressed = start - 0.5e-3 * np.exp(-((ROW - 4.0)**2 + (COLUMN - 3.5)**2) / 4) + rng.normal(size=SIZE) * 5e-6
    sigma, response = np.full(SIZE, 20e-6), (rng.random((INNER.sum(),) * 2) * 1e-9).astype(np.float32)
    sigma[10] = np.nan
    found = solved(pad, rays, pressed, sigma, response)
    expected = reference(pad, rays, pressed, found['weight'], np.where(found['weight'] > 0, pressed, start), response.astype(float))
    np.testing.assert_allclose(found['ranges'], expected[0], atol=1e-8)
    np.testing.assert_allclose(found['places'], ORIGIN + found['ranges'][:, None] * rays)
    assert found['pressure'] == pytest.approx(expected[2], rel=1e-4)
    np.testing.assert_allclose(found['touched'], expected[1], atol=1e-3)
    assert found['touched'].max() > 0.99


def whole(rays, ranges, sigma, id, rest, places, scale):
    """The frame of all dots, one dot at a time: rays, weight, displaced, seen."""
    seen = np.isin(np.arange(SIZE), id)
    last = rays_to(places)
    turned = np.zeros((SIZE, 3))
    turned[id] = rays - last[id]
    around = filled_holes(turned, seen, **GRID)
    every = (last + around) / np.linalg.norm(last + around, axis=1, keepdims=True)
    weight, displaced = np.zeros(SIZE), np.zeros(SIZE)
    for i, k in enumerate(id):
        if np.isfinite(ranges[i]) and sigma[i] > 0:
            weight[k], displaced[k] = 1 / sigma[i]**2, scale * (ranges[i] - np.linalg.norm(rest[k] - ORIGIN))
    return every, weight, displaced, seen


def test_a_frame_with_gaps_is_that_of_all_dots(pad):
    rng = np.random.default_rng(5)
    places, id = pad[0] + rng.normal(size=(SIZE, 3)) * 1e-5, rng.permutation(SIZE)[:50]
    rays = rays_to(pad[0] + [2e-4, 0, 0])[id]
    ranges, sigma = np.linalg.norm(pad[0] - ORIGIN, axis=1)[id] + rng.normal(size=50) * 1e-5, np.full(50, 20e-6)
    ranges[3], sigma[7], sigma[9] = np.nan, np.nan, np.inf
    found = solved(pad, rays, ranges, sigma, np.full((INNER.sum(),) * 2, 1e-12, np.float32), id=id, places=places, scale=0.9, fresh=False)
    expected = whole(rays, ranges, sigma, id, pad[0], places, 0.9)
    np.testing.assert_allclose(found['rays'], expected[0], atol=1e-12)
    np.testing.assert_allclose(found['weight'], expected[1])
    np.testing.assert_allclose(found['displaced'], expected[2], atol=1e-15)
    assert (found['seen'] == expected[3]).all()


def test_the_response_is_the_change_of_the_solution(pad):
    rest = pad[0]
    rays, start = rays_to(rest), np.linalg.norm(rest - ORIGIN, axis=1)
    sigma, response = np.full(SIZE, 20e-6), np.full((INNER.sum(),) * 2, 1e-12, np.float32)
    change = 5e-6 * np.cos(ROW)
    before, after = (solved(pad, rays, start + factor * change, sigma, response, fresh=False) for factor in (1.0, 1.2))
    np.testing.assert_allclose(after['ranges'] - before['ranges'], 0.2 * before['moved'], atol=2e-8)
    assert after['pressure'] - before['pressure'] == pytest.approx(0.2 * before['lifted'], abs=0.05 * abs(before['lifted']) + 1e-3)


def test_the_leaning_on_a_scale_is_that_of_the_forces_along_the_surface(pad):
    rest, of, residual = pad
    rng = np.random.default_rng(6)
    places, rays, touched = rest + rng.normal(size=rest.shape) * 2e-5, rays_to(rest), np.where(ROW > 5, 0.2, 0.0)
    moved, pressure, lifted, step, spread, scale = rng.normal(size=SIZE) * 1e-4, 2100.0, 50.0, 0.01, 0.2, 1.1

    def along(places, pressure):
        force, share = _core.membrane_forces(places, of, **GRID)
        left = force + pressure * (share - residual)
        normal = share / np.linalg.norm(share, axis=1, keepdims=True)
        return (left - (left * normal).sum(axis=1, keepdims=True) * normal) / (pressure * np.linalg.norm(share, axis=1, keepdims=True))

    here = along(places, pressure)
    slope = (along(places + step / scale * moved[:, None] * rays, pressure + step / scale * lifted) - here) / step
    wide = np.pad(touched.reshape(ROWS, COLUMNS), 1)
    loaded = sum(wide[i:i + ROWS, j:j + COLUMNS] for i in range(3) for j in range(3)).ravel()
    weight = (INNER & (loaded < 0.3))[:, None] / (1 + (here**2).sum(axis=1, keepdims=True) / (2 * spread)**2)**2
    found = _core.scale_leaning(places, rays, touched, moved, of, residual, pressure=pressure, lifted=lifted, step=step, spread=spread,
                                scale=scale, **GRID)
    assert found == pytest.approx([(weight * slope**2).sum(), (weight * slope * here).sum()], rel=1e-9)
    assert 0 < weight.any(axis=1).sum() < INNER.sum()


def test_a_range_that_goes_alone_is_left_out_and_an_edge_is_not(pad):
    rest = pad[0]
    rays, start = rays_to(rest), np.linalg.norm(rest - ORIGIN, axis=1)
    sigma, response = np.full(SIZE, 20e-6), np.full((INNER.sum(),) * 2, 1e-9, np.float32)
    spoiled, edge = start.copy(), start.copy()
    spoiled[COLUMNS * 4 + 3] += 0.4e-3
    edge[ROW == 4] -= 0.4e-3
    assert np.flatnonzero(solved(pad, rays, spoiled, sigma, response)['weight'] == 0).tolist() == [COLUMNS * 4 + 3]
    assert (solved(pad, rays, edge, sigma, response)['weight'] > 0).all()
