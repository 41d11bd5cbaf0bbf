# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxel arrays: contact shape, pose, slip, wrench and time, by the pad model and by the published method, on recordings with ground truth.

python test/benchmark/taxel.py FOLDER, the folder with simulated/tac_* and dsa_slip/weights (TACTILE_RECORDINGS). The response is fitted
to tac_cal_zero and tac_cal_flat. Shape and pose exclude frames with a load under a tenth of the scene's largest.
"""
from __future__ import annotations

import json
import sys
import time
from collections import defaultdict
from pathlib import Path

import cv2
import numpy as np

from tactile_perception.evaluation.scores import macro_f1
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.estimator import TAXEL_METHODS, TaxelEstimator, TaxelResult, TaxelSettings
from tactile_perception.taxel.response import Response, fit_gains
from tactile_perception.taxel.wrench import GraspedObject, transform_wrench
from tactile_perception.taxel.calibration import Loads, calibrated_response, find_loop

CALIBRATION = ('tac_cal_zero', 'tac_cal_flat')
STATES = ('none', 'incipient', 'gross')
_FINE = 4  # subdivisions of a taxel for the comparison of regions
_LIGHT = 0.1
_STEP_S = 0.06  # s over which the true velocity is averaged, as in the estimate


def read(folder: Path) -> tuple[dict, dict, dict]:
    """meta, input and truth of a recording."""
    return (json.loads((folder / 'meta.json').read_text()), dict(np.load(folder / 'input.npz')), dict(np.load(folder / 'truth.npz')))


def calibrate(folder: Path, array: TaxelArray) -> Response:
    """The response by the even loads of the calibration recordings."""
    zero = read(folder / CALIBRATION[0])[1]['frames'].mean(axis=0, dtype=float)
    known = read(folder / CALIBRATION[1])[1]
    loaded = np.arange(np.flatnonzero(known['applied_kPa'])[0], len(known['t']))  # and what is left after the loads
    changes = (known['frames'][loaded] - zero).astype(np.float32)
    forces = 1e3 * known['applied_kPa'][loaded] * array.taxel_area * array.rows * array.columns
    loads = Loads(changes, forces, zero, [], [''] * len(loaded), known['t'][loaded], np.zeros(len(loaded), int), np.arange(len(loaded)))
    gain = fit_gains(changes)
    return calibrated_response(loads, array, gain, *find_loop(loads, array, gain))


def sensor(meta: dict) -> tuple[TaxelArray, SoftPad]:
    """Array and pad of a recording, by what its meta.json says."""
    return (TaxelArray(meta['rows'], meta['cols'], meta['pitch_m'], 2.0**meta['bits'] - 1),
            SoftPad(meta['pad_thickness_m'], meta['pad_E_Pa'], meta['pad_G_Pa'], meta['mu_nominal']))


def mask_of(result: TaxelResult, array: TaxelArray) -> np.ndarray:
    """(rows, columns) bool: taxels at least half of which lie in a region."""
    mask = np.zeros((array.rows * _FINE, array.columns * _FINE), np.uint8)
    middle = 0.5 * np.array([array.columns, array.rows])
    loops = [np.round((loop[:, :2] / array.pitch + middle) * _FINE * 16).astype(np.int32)
             for loop in result.region.outlines + result.region.holes]
    if loops:
        cv2.fillPoly(mask, loops, 1, shift=4)
    return cv2.resize(mask.astype(np.float32), (array.columns, array.rows), interpolation=cv2.INTER_AREA) >= 0.5


def grasped(meta: dict, known: dict, k: int, result: TaxelResult | None, truth_angle: float) -> GraspedObject:
    """What is known of the object in frame k: depth by the fingers' gap, weight by the gripper's attitude, centre of mass by its pose."""
    about = meta['gripper']
    depth = max(0.5e-3 * (about['object_width_mm'] - float(known['finger_gap_mm'][k])), 0.0)
    sensor_in_s = np.array(about['T_S_P'])[:3, :3]
    weight = about['object_weight_N'] * sensor_in_s.T @ (known['R_G_S'][k].T @ np.array(about['gravity_dir_G'], float))
    mass = np.full(3, np.nan)
    if result is not None and np.isfinite(result.region.orientation):
        angle = result.region.orientation  # half a turn is open: the object is known to lie as in the truth
        angle += np.pi * np.round((truth_angle - angle) / np.pi)
        cosine, sine = np.cos(angle), np.sin(angle)
        x, y = 1e-3 * np.array(about['com_in_object_mm'], float)
        mass = result.region.centroid + [cosine * x - sine * y, sine * x + cosine * y, 0]
    return GraspedObject(depth, weight, mass)


def play(folder: Path, method: str, response: Response) -> tuple[list[TaxelResult], list[float]]:
    """Results of all frames, and s of computing for each."""
    meta, known, truth = read(folder)
    array, pad = sensor(meta)
    estimator = TaxelEstimator(array, pad, TaxelSettings(method, response=response))
    results, seconds = [], []
    for k, values in enumerate(known['frames']):
        if 'gripper' in meta:
            estimator.grasped = grasped(meta, known, k, results[-1] if results else None, float(truth['pose'][k, 2]))
        begin = time.thread_time()
        results.append(estimator.process(values, 1 + float(known['t'][k])))
        seconds.append(time.thread_time() - begin)
    return results, seconds


def shape_errors(results: list[TaxelResult], meta: dict, truth: dict) -> dict[str, np.ndarray]:
    """Errors of area (relative), centroid (mm), orientation (deg), and region overlap, by frame."""
    array, _ = sensor(meta)
    errors = defaultdict(list)
    heavy = truth['Fn_N'] > _LIGHT * truth['Fn_N'].max()
    for k in np.flatnonzero(truth['contact'] & heavy):
        region = results[k].region
        errors['area'].append(abs(region.area / truth['area_m2'][k] - 1))
        found, true = mask_of(results[k], array), truth['mask'][k]
        errors['overlap'].append((found & true).sum() / max((found | true).sum(), 1))
        errors['centroid'].append(np.hypot(*(1e3 * region.centroid[:2] - truth['centroid_mm'][k])))
        if truth['orientation_valid'][k] and truth['anisotropy'][k] > 0.05:
            off = region.orientation - truth['orientation_rad'][k]
            errors['orientation'].append(np.degrees(abs((off + np.pi / 2) % np.pi - np.pi / 2)))
    return {name: np.array(values) for name, values in errors.items()}


def motion_errors(results: list[TaxelResult], known: dict, truth: dict) -> dict[str, np.ndarray]:
    """Relative errors of the velocity of a translation, of the rate of a turn, and of its centre (mm), while all slips."""
    errors = defaultdict(list)
    half = max(round(_STEP_S / np.median(np.diff(known['t']))), 1)
    for k in range(half, len(results)):
        if truth['slip_state'][k] < 2 or results[k].slip.state < 2:
            continue
        step = (truth['pose'][k] - truth['pose'][k - half]) / (known['t'][k] - known['t'][k - half]) * [1e-3, 1e-3, 1]
        velocity = results[k].slip
        if np.hypot(*step[:2]) > 3e-4:
            place = 1e-3 * truth['pose'][k, :2]
            at = velocity.linear[:2] + np.nan_to_num(velocity.angular[2]) * np.array([-place[1], place[0]])
            errors['velocity'].append(np.hypot(*(at - step[:2])) / np.hypot(*step[:2]))
        if abs(step[2]) > 0.1:
            errors['turn'].append(abs(velocity.angular[2] / step[2] - 1))
            centre = 1e-3 * truth['pose'][k, :2] + np.array([-step[1], step[0]]) / step[2]
            errors['centre'].append(1e3 * np.hypot(*(velocity.rotation_center[:2] - centre)))
    return {name: np.array(values) for name, values in errors.items()}


def wrench_errors(results: list[TaxelResult], meta: dict, known: dict, truth: dict) -> dict[str, np.ndarray]:
    """Relative errors of the wrench at the gripper's sensor; moments over the scene's largest."""
    frame = np.array(meta['gripper']['T_S_P'])
    judged = np.flatnonzero(known['gripping_free'])
    found = np.array([transform_wrench(results[k].wrench, frame[:3, :3], frame[:3, 3]) for k in judged])
    true = truth['wrench_S_on_finger'][judged] * np.repeat([1.0, 1e-3], 3)
    parts = {'force': slice(0, 3), 'moment': slice(3, 6)}
    return {name: np.linalg.norm(found[:, part] - true[:, part], axis=1) / np.linalg.norm(true[:, part], axis=1)
            for name, part in parts.items()}


def benchmark(folder: Path, method: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Errors by name and scene, and the confusion of slip states over all scenes."""
    scenes = sorted(path for path in folder.glob('tac_*') if path.name not in CALIBRATION)
    array, _ = sensor(read(folder / CALIBRATION[0])[0])
    response, errors, confusion = calibrate(folder, array), {}, np.zeros((3, 3), int)
    for scene in scenes:
        meta, known, truth = read(scene)
        results, seconds = play(scene, method, response)
        found = shape_errors(results, meta, truth) | motion_errors(results, known, truth)
        if 'gripper' in meta:
            found |= wrench_errors(results, meta, known, truth)
        else:
            heavy = truth['Fn_N'] > _LIGHT * truth['Fn_N'].max()
            found['force by pressure'] = np.array([abs(-results[k].wrench[2] / truth['Fn_N'][k] - 1) for k in np.flatnonzero(heavy)])
        found['ms'] = 1e3 * np.array(seconds)
        errors |= {f'{scene.name}: {name}': values for name, values in found.items()}
        states = np.array([result.slip.state for result in results])
        touched = truth['contact']
        np.add.at(confusion, (truth['slip_state'][touched], states[touched]), 1)
    return errors, confusion


def report(folder: Path) -> str:
    """Both methods side by side: means (time: median)."""
    found = {method: benchmark(folder, method) for method in TAXEL_METHODS}
    lines = [f'{"":46s}' + ''.join(f'{method:>12s}' for method in found)]
    for name in next(iter(found.values()))[0]:
        values = [errors[name] if name in errors else np.zeros(0) for errors, _ in found.values()]
        middle = np.median if name.endswith('ms') else np.nanmean
        lines.append(f'{name:46s}' + ''.join(f'{middle(v) if np.isfinite(v).any() else np.nan:12.3f}' for v in values))
    for method, (_, confusion) in found.items():
        quiet = 1 - confusion[0, 0] / max(confusion[0].sum(), 1)
        lines.append(f'slip, {method}: macro F1 {macro_f1(confusion):.3f}, {quiet:.1%} of quiet frames called slip; '
                     f'true by found {"/".join(STATES)}: {confusion.tolist()}')
    return '\n'.join(lines)


if __name__ == '__main__':
    print(report(Path(sys.argv[1]) / 'simulated'))
