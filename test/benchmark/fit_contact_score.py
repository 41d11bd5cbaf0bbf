# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fits the weights by which the touchpad estimates how far each dot is from a contact's border; writes them as .npz.

    python test/benchmark/fit_contact_score.py [--scenes 560] [--seed 7000] [--out out/border_network.npz]

The scenes are random: tools, sizes, positions, depths, motions, frictions, specimens, noise, glare. A small network (two hidden layers of
rectified linear units, Adam, Huber loss) learns each dot's signed distance from the true outline, cut at a pitch, from what the estimator
knows of its surroundings; see tactile_perception/src/touchpad/contact.cpp. It takes 20 minutes.
"""
from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from judged import touchpad_parameters

from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.optics.light import Lighting
from tactile_driver.simulation.optics.rendering import Imaging
from tactile_driver.simulation.scene.scene import Scene
from tactile_driver.simulation.scene.specimen import act, one_after_the_other
from tactile_driver.simulation.sensors.touchpad import PAD, touchpad
from tactile_driver.simulation.skin.tools import Motion, Tool, block, disc, ring, sphere
from tactile_perception.common.progress import progress
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.touchpad.membrane import Membrane
from tactile_perception.touchpad.parameters import TOUCHPAD_PARAMETERS
from tactile_perception.touchpad.positions import DotPositions, RestPositions
from tactile_perception.touchpad.sensor import Touchpad

RATE, UNTOUCHED = 10.0, 0.4  # frames/s; s
NEIGHBOURS, SIDE, FED = 2, 5, 51  # dots, of what is fed around each; numbers fed
HIDDEN = 48, 16
EPOCHS, BATCH, FASTEST, DECAY, HUBER = 40, 512, 4e-3, 1e-4, 0.5
OUTWARDS = 0.05  # pitches, added to what is learnt: regions drawn a little too large overlap more than those drawn too small
UNLOADED = NEAR = 0.3  # load from which a dot and those beside it are judged, as in the kernel
LIGHTEST, HEAVIEST, STEEPEST, SPREADS = -1.0, 4.0, 0.5, (0.02, 0.06)  # limits of what is fed, as in the kernel
HEIGHT_SCALE, SPREAD_SCALE = 4.0, 20.0  # as in the kernel
EFFECTS, SHARES = 8, (0.7, 0.5, 0.25)  # after how many scenes of each kind the effects come again; weights of the first in the fit
KINDS = 'block', 'disc', 'ring', 'ball', 'edge', 'balls', 'light', 'tilted'


def edge(p: np.ndarray, half_length: float = 0.0110, half_angle: float = 0.85, rounding: float = 0.0010) -> np.ndarray:
    """Edge of a prism along x. half_length: m; half_angle: rad, between flank and z; rounding: radius of the ridge, m."""
    # The axis of the rounded ridge is at z = rounding; the flank starts where it is tangent to the ridge.
    across, up = np.abs(p[..., 1]), p[..., 2] - rounding
    along_flank = across * np.sin(half_angle) + up * np.cos(half_angle)
    off_flank = across * np.cos(half_angle) - up * np.sin(half_angle)
    wedge = np.where(along_flank > 0, off_flank, np.hypot(across, up)) - rounding
    ends = np.abs(p[..., 0]) - half_length
    return np.minimum(np.maximum(wedge, ends), 0) + np.hypot(np.maximum(wedge, 0), np.maximum(ends, 0))


def random_tool(kind: str, rng: np.random.Generator) -> Tool:
    """A tool of that kind and of a random size."""
    u = rng.uniform
    if kind == 'block':
        return Tool(kind, (partial(block, half_x=u(0.004, 0.008), half_y=u(0.003, 0.006), rounding=u(2e-4, 8e-4)),))
    if kind == 'ring':
        inner = u(0.003, 0.0055)
        return Tool(kind, (partial(ring, inner=inner, outer=inner + u(0.002, 0.0035), rounding=u(3e-4, 7e-4)),))
    if kind == 'edge':
        return Tool(kind, (partial(edge, half_angle=u(0.6, 1.0), rounding=u(5e-4, 15e-4), half_length=u(0.006, 0.012)),))
    if kind == 'balls':
        radius = u(0.003, 0.0055)
        return Tool(kind, (partial(sphere, radius=radius),) * 2,
                    ((-u(0.0055, 0.007), u(-0.001, 0.001), 0.0), (u(0.0055, 0.007), 0.0, u(0, 5e-4))), radius)
    if kind == 'ball' or kind == 'light' and u() < 0.6:
        radius = u(0.003, 0.012)
        return Tool(kind, (partial(sphere, radius=radius),), tip_radius=radius)
    return Tool(kind, (partial(disc, radius=u(0.0035, 0.0075), rounding=u(2e-4, 8e-4)),))


def random_imaging(number: int, rng: np.random.Generator) -> tuple[Lighting, Imaging]:
    """Light and camera of a scene."""
    u, kind = rng.uniform, effect(number)
    lighting, imaging = Lighting(), replace(Imaging(), blur=0.8 + u(-0.15, 0.15), read_noise=u(0.6, 1.2))
    if kind > 2:
        return lighting, imaging
    lighting = replace(lighting, gloss=u(300, 900), gloss_width=0.01, sheen=u(0.05, 0.2), sheen_width=u(0.04, 0.05))
    imaging = replace(imaging, drift=u(0, 0.03))
    if kind == 1:
        lighting = replace(lighting, sheen_water=0.0)
    return lighting, replace(imaging, read_noise=u(2.0, 4.0), shot_noise=u(0.05, 0.1)) if kind == 2 else imaging


def effect(number: int) -> int:
    """What disturbs the images of a scene: 0 glare through the water, 1 white glare, 2 high noise and glare; others nothing."""
    return number // len(KINDS) % EFFECTS


def share(number: int) -> float:
    """Weight of a scene in the fit."""
    return SHARES[effect(number)] if effect(number) < len(SHARES) else 1.0


def random_scene(number: int, seed: int, rate: float = RATE) -> Scene:
    """A tool, turned at random, is pressed in, moved and lifted, seen at rate Hz."""
    rng, kind = np.random.default_rng([seed, number]), KINDS[number % len(KINDS)]
    u = rng.uniform
    specimen = touchpad(seed + number, 640, *random_imaging(number, rng))
    far = 0.001 if kind == 'balls' else 0.003
    x, y, depth = u(-far, far), u(-far, far), u(0.0006, 0.0014) if kind == 'light' else u(0.0020, 0.0038)
    turn = {'pitch': u(-0.12, 0.12), 'roll': u(-0.12, 0.12)} if kind == 'tilted' else {}
    yaw = u(-np.pi, np.pi) if kind != 'balls' else 0.0
    move = {'x': x + u(-0.003, 0.003), 'y': y + u(-0.003, 0.003), 'yaw': yaw + u(-0.6, 0.6), **turn}
    (_, keys), = one_after_the_other([lambda start: act(kind, start, {'t': 0.6, 'press': depth}, {'t': 1.5, **move},
                                                        {'t': 1.9, 'press': 0.0}, x=x, y=y)], untouched=UNTOUCHED)
    keys = [replace(key, yaw=yaw) for key in keys[:3]] + keys[3:]
    motion = Motion(random_tool(kind, rng), keys, specimen.skin)
    return Scene(specimen, [motion], motion.times[-1] + 0.15, rate, u(0.2, 0.6))


def signed_distance(loops: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    """(K,) m, distances of points (K, 2) from the outlines loops (M, >= 2), seen along z; positive where an odd number encloses."""
    each = np.array([[cv2.pointPolygonTest(loop[:, :2].astype(np.float32), point, True) for point in points.tolist()] for loop in loops])
    return np.abs(each).min(axis=0) * np.where((each > 0).sum(axis=0) % 2, 1, -1)


def heights(positions: np.ndarray, normals: np.ndarray, pitch: float) -> np.ndarray:
    """(rows, columns): how far the four dots next to each stand out of its tangent plane, pitches, cut and scaled; 0 at the border."""
    rise, inner = np.zeros(positions.shape[:2]), np.s_[1:-1, 1:-1]
    off = positions[:-2, 1:-1] + positions[2:, 1:-1] + positions[1:-1, :-2] + positions[1:-1, 2:] - 4 * positions[inner]
    rise[inner] = (off * normals[inner]).sum(axis=2) / pitch
    return HEIGHT_SCALE * np.clip(np.nan_to_num(rise), -STEEPEST, STEEPEST)


def windows(values: np.ndarray) -> np.ndarray:
    """(K, 25): values (rows, columns) within two dots of each dot, 0 outside."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, NEIGHBOURS), (SIDE, SIDE)).reshape(-1, SIDE * SIDE)


def surroundings(load: np.ndarray, rise: np.ndarray) -> np.ndarray:
    """(K, FED): load and rise (both (rows, columns)) within two dots of each dot, and the median load of all dots, without sign."""
    near = [windows(np.clip(np.nan_to_num(load), LIGHTEST, HEAVIEST)), windows(rise)]
    spread = np.clip(np.median(np.abs(np.nan_to_num(load))), *SPREADS)
    return np.concatenate([*near, np.full((load.size, 1), SPREAD_SCALE * spread)], axis=1)


def symmetries() -> np.ndarray:
    """(8, FED): orders of what surroundings gives, as the grid's eight symmetries have it."""
    square = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    turned = [np.rot90(square if turn < 4 else square.T, turn % 4).ravel() for turn in range(8)]
    return np.array([np.concatenate([kind * SIDE * SIDE + order for kind in range(2)] + [[FED - 1]]) for order in turned])


def examples(scene: Scene, whole: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Surroundings (N, FED) and signed distances (N,), pitches, of the dots near the contacts that are found in a scene; and their weights
    (N,), which sum up to whole in each frame."""
    values = {**defaults(TOUCHPAD_PARAMETERS), **touchpad_parameters(scene)}
    sensor = Touchpad.from_parameters(values)
    camera = sensor.camera(scene.camera.matrix, scene.camera.distortion)
    tracker, positions = make_tracker(values), DotPositions(sensor, camera)
    rest, membrane = RestPositions(sensor.cap, camera, PAD.rows, PAD.columns), None
    fed, reported, weight = [np.zeros((0, FED), np.float32)], [np.zeros(0, np.float32)], [np.zeros(0, np.float32)]
    for number in range(scene.frames):
        frame = scene.render(number / RATE)
        tracks = tracker.process(frame.image, 1 + number / RATE)
        tracks.xyz = positions.locate(frame.image, tracks)
        if rest.update(tracks):
            membrane = Membrane(rest.xyz, PAD.rows, PAD.columns, camera.centre, sensor.material)
        known = np.isfinite(tracks.xyz).all(axis=1) & np.isfinite(rest.xyz[tracks.id]).all(axis=1)
        loads = membrane.core.loads(tracks.id[known], tracks.xyz[known])
        pitch = float(np.median(np.linalg.norm(np.diff(membrane.core.rest.reshape(PAD.rows, PAD.columns, 3), axis=1), axis=2)))
        if np.abs(loads.load).max() < UNLOADED:
            continue
        near = np.flatnonzero(cv2.dilate((loads.load > NEAR).reshape(PAD.rows, PAD.columns).astype(np.uint8), np.ones((3, 3), np.uint8)))
        loops = frame.truth.outlines + frame.truth.holes
        if len(near):
            rise = heights(loads.xyz.reshape(PAD.rows, PAD.columns, 3), loads.normal.reshape(PAD.rows, PAD.columns, 3), pitch)
            fed.append(surroundings(loads.load.reshape(PAD.rows, PAD.columns), rise)[near].astype(np.float32))
            distance = signed_distance(loops, frame.truth.dot_xyz[near, :2]) / pitch if loops else np.full(len(near), -1.0)
            reported.append(np.clip(distance, -1, 1).astype(np.float32))
            weight.append(np.full(len(near), whole / len(near), np.float32))
    return np.concatenate(fed), np.concatenate(reported), np.concatenate(weight)


def fit(fed: np.ndarray, reported: np.ndarray, weight: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:
    """Weights (in, out) of each layer and after them its biases (out,): Adam, with a rate that falls as a cosine. Each batch has all
    symmetries. fed: (N, FED); reported: (N,) pitches; weight: (N,)."""
    weight = weight / weight.mean()
    sizes, orders = [fed.shape[1], *HIDDEN, 1], symmetries()
    weights = [rng.normal(0, np.sqrt(2 / a), (a, b)).astype(np.float32) for a, b in zip(sizes, sizes[1:])]
    known = weights + [np.zeros(size, np.float32) for size in sizes[1:]]
    mean, square = ([np.zeros_like(part) for part in known] for _ in range(2))
    step = 0
    for epoch in range(EPOCHS):
        rate = FASTEST * 0.5 * (1 + np.cos(np.pi * epoch / EPOCHS)) + 1e-5
        order = rng.permutation(len(reported))
        for start in range(0, len(reported), BATCH):
            some = order[start:start + BATCH]
            step += 1
            turned = np.concatenate([fed[part][:, turn] for part, turn in zip(np.array_split(some, len(orders)), orders)])
            for j, slope in enumerate(_slopes(known, turned, reported[some], weight[some])):
                mean[j] += 0.1 * (slope - mean[j])
                square[j] += 0.001 * (slope**2 - square[j])
                change = mean[j] / (1 - 0.9**step) / (np.sqrt(square[j] / (1 - 0.999**step)) + 1e-8)
                known[j] -= np.float32(rate) * change.astype(np.float32)
    known[-1] = known[-1] + np.float32(OUTWARDS)
    return [part for pair in zip(known[:len(weights)], known[len(weights):]) for part in pair]


def _slopes(known: list[np.ndarray], fed: np.ndarray, reported: np.ndarray, weight: np.ndarray) -> list[np.ndarray]:
    """Derivatives of the weighted mean Huber loss by weights and biases (back-propagation)."""
    layers = len(known) // 2
    outputs = [fed]
    for k in range(layers):
        output = outputs[-1] @ known[k] + known[layers + k]
        outputs.append(np.maximum(output, 0) if k + 1 < layers else output)
    back = (weight * np.clip(outputs[-1][:, 0] - reported, -HUBER, HUBER))[:, None] * 2 / len(reported)
    weights, biases = [], []
    for k in reversed(range(layers)):
        weights.insert(0, outputs[k].T @ back + DECAY * known[k])
        biases.insert(0, back.sum(axis=0))
        back = (back @ known[k].T) * (outputs[k] > 0)
    return weights + biases


def write(layers: list[np.ndarray], path: Path) -> None:
    """Write weights and biases, rounded to 1e-4, under the names of _core.touchpad.BorderNetwork."""
    names = 'weights_1', 'biases_1', 'weights_2', 'biases_2', 'weights_3', 'bias_3'
    rounded = dict(zip(names, (np.round(part, 4).astype(np.float32) for part in layers)))
    rounded['weights_3'], rounded['bias_3'] = rounded['weights_3'][:, 0], rounded['bias_3'][0]
    np.savez(path, **rounded)


def main() -> None:
    """Simulate, fit, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--scenes', type=int, default=560)
    parser.add_argument('--seed', type=int, default=7000)
    parser.add_argument('--out', type=Path, default=Path('out/border_network.npz'))
    given = parser.parse_args()
    cv2.setNumThreads(1)
    found = [examples(random_scene(number, given.seed), share(number)) for number in progress(range(given.scenes), 'scenes')]
    fed, reported, weight = (np.concatenate(part) for part in zip(*found))
    print(f'{len(reported)} dots in {given.scenes} scenes')
    given.out.parent.mkdir(parents=True, exist_ok=True)
    write(fit(fed, reported, weight, np.random.default_rng(given.seed)), given.out)


if __name__ == '__main__':
    main()
