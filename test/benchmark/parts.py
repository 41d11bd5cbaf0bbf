# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the benchmark: what each sensor is judged on, by which methods, and which of the errors are its figures."""
from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tactile_bringup.installed import share
from tactile_bringup.papers.sheets import fit_published
from tactile_perception.evaluation.evaluation import Instant
from tactile_perception.press.tools import calibrate_markers

import dots
from judged import Case, Judged, calibrated, judge, parameter_file, recorded, simulated, touchpad_scene
from printed_dots import NAMES

SIZES = {'320 x 240': (320, 240), '640 x 480': (640, 480), '960 x 720': (960, 720)}
VGA = '640 x 480'
#: Contact method -> changes of the parameters.
TOUCHPAD_METHODS = {'membrane': {}, 'paper': {'contact': 'paper'},
                    "paper's dots and contact": {'contact': 'paper', 'detection': 'paper', 'numbering': 'paper'}}
TOUCHPAD_RECORDINGS = ('tp_rect_drag', 'tp_ring_press', 'tp_disc_twist', 'tp_two_spheres', 'tp_disc_impact', 'tp_rect_release',
                       'tp_disc_press_glare')
SHEETS = {'areal_single': 'as', 'areal_dual': 'ad', 'air_cushion': 'ac'}  # sensor -> prefix of its recordings
SHALLOWEST = {'areal_single': 0.3e-3, 'areal_dual': 1e-3, 'air_cushion': 8e-3}  # m: shallower presses are not judged
PAPERS_MARKERS = {'paper': 'paper_areal', 'paper_cushion': 'paper_cushion'}  # contact method: marker detection of the same paper
TAXEL_RECORDINGS = ('static_ring', 'incipient_rect', 'rotate_rect', 'grip_hold')
FARTHEST = np.radians(61.0)  # from the finger's pole


@dataclass(frozen=True)
class Plan:
    """quick: less of all; recorded: recordings of another simulation (TACTILE_RECORDINGS) in place of the simulated sensors that ship;
    bags: folder for bags, those that are there are taken."""

    quick: bool
    recorded: bool
    bags: Path


@dataclass(frozen=True)
class Row:
    """What one method did in one round. part: name in PARTS; source: what it was judged on; size: of images, '' without; ms: of a frame;
    errors: by name, less is better, NaN: not estimated."""

    part: str
    source: str
    method: str
    size: str
    ms: float
    errors: dict[str, float]


def _of_pitch(pixels: float, size: tuple[int, int]) -> float:
    """Thousandths of the dots' pitch, which is 18 px in 640 x 480."""
    return 1e3 * pixels / (18 * size[0] / 640)


class Dots:
    """Detection alone: images of 23 x 23 dots, of three sizes."""

    errors = {'place': '1/1000 pitch', 'missed or false': 'per 1000'}

    def __init__(self, plan: Plan):
        self._sizes = {name: SIZES[name] for name in list(SIZES)[:2 if plan.quick else 3]}
        self._names = ('plain', 'all at once') if plan.quick else NAMES
        self._frames = 2 if plan.quick else 4

    def measure(self, number: int) -> list[Row]:
        """A row for each method and size; other dots in each round."""
        rows = []
        for size, pixels in self._sizes.items():
            names = self._names if size == VGA else self._names[:1]
            for method, (sums, ms) in dots.find(number, self._frames, names, pixels).items():
                place = (sums['error2'] / sums['matched'])**0.5 if sums['matched'] else np.nan
                lost = 1e3 * (sums['true'] - sums['matched'] + sums['false']) / sums['true']
                rows.append(Row('dots', 'printed dots', method, size, ms, {'place': _of_pitch(place, pixels), 'missed or false': lost}))
        return rows


class Touchpad:
    """From an image to the contact region, of two sizes."""

    errors = {'region overlap': '1 - IoU', 'contact dots': '1 - F1', 'slipping dots': '1 - F1', 'depth': 'mm'}

    def __init__(self, plan: Plan):
        folder = plan.bags / 'touchpad'
        folder.mkdir(parents=True, exist_ok=True)
        if plan.recorded:
            self._cases = {VGA: [recorded(folder, name, 'touchpad') for name in TOUCHPAD_RECORDINGS]}
        else:
            rate, names = 5.0 if plan.quick else 10.0, ('rectangle_drag', 'ring_press', 'disc_twist')
            self._cases = {size: [touchpad_scene(folder, name, rate, SIZES[size]) for name in names] for size in ('320 x 240', VGA)}

    def measure(self, number: int) -> list[Row]:
        """A row for each method and size: means over scenes."""
        rows = []
        for size, cases in self._cases.items():
            for method, changes in TOUCHPAD_METHODS.items():
                found = [judge([case], changes=changes) for case in cases]
                each = [touchpad_errors(judged) for judged in found]
                ms = float(np.mean([np.median(judged.ms) for judged in found]))
                errors = {name: known_mean([one[name] for one in each]) for name in self.errors}
                if method != 'membrane':
                    errors['depth'] = np.nan  # ours: the paper estimates none
                rows.append(Row('touchpad', 'touchpad', method, size, ms, errors))
        return rows


def touchpad_errors(judged: Judged) -> dict[str, float]:
    """The figures of a touchpad on one bag."""
    f1 = judged.dots_f1()
    return {'region overlap': 1 - judged.mean('region_overlap'), 'contact dots': 1 - f1['contact'], 'slipping dots': 1 - f1['slipping'],
            'depth': judged.medians().get('depth', np.nan)}


def known_mean(values: list[float]) -> float:
    """Mean of those that are known; NaN of none."""
    known = np.array(values)[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


class Sheets:
    """From an image, or two, to presses on sheets and domes, calibrated by presses at other places."""

    errors = {'place': 'mm', 'depth': 'mm', 'force': '%', 'missed, split or false': 'per 1000'}

    def __init__(self, plan: Plan):
        self._sensors = [sheet(name, plan.bags, plan.recorded) for name in list(SHEETS)[:1 if plan.quick else 3]]

    def measure(self, number: int) -> list[Row]:
        """A row for each sensor and method."""
        return [Row('sheets and dome', sensor, method, '', float(np.median(judged.ms)), sheet_errors(judged))
                for sensor, (cases, methods) in self._sensors for method, judged in judge_sheet(sensor, cases, methods).items()]


def sheet(sensor: str, bags: Path, from_recordings: bool) -> tuple[str, tuple[list[Case], dict]]:
    """(sensor, (cases to judge on, method -> (calibration, changes of the parameters))). The published method of sheets needs a plate,
    which the recordings lack."""
    folder = bags / sensor
    folder.mkdir(parents=True, exist_ok=True)
    if from_recordings:
        presses, *tests = (recorded(folder, f'{SHEETS[sensor]}_{part}', sensor) for part in ('calib_small', 'test'))
    else:
        presses, *tests = (simulated(folder, f'{sensor}_{scene}', rate, sensor) for scene, rate in
                           (('calibration', 3.0), ('test', 4.0), ('two', 4.0)))
    paper, of_paper, plate = 'paper_cushion' if sensor == 'air_cushion' else 'paper', None, None
    if sensor == 'air_cushion':
        of_paper = presses if from_recordings else simulated(folder, 'air_cushion_zones_calibration', 4.0, sensor)
    elif not from_recordings:
        of_paper, plate = (simulated(folder, f'{sensor}_{scene}', rate, sensor) for scene, rate in (('markers', 2.0), ('plate', 8.0)))
    with contextlib.redirect_stderr(io.StringIO()):
        calibrate_markers([presses.bag], presses.params, model := folder / 'model.yaml', only='model')
        methods = {'model': (model, {'touch': 'model'})}
        if of_paper:
            changes = {'touch': paper, 'detection': PAPERS_MARKERS[paper]}
            params, file = parameter_file(folder / 'paper.yaml', of_paper.params, changes), folder / 'paper_calibration.yaml'
            fit_published(sensor, [of_paper.bag], params, file, paper, plate and plate.bag)
            methods[paper] = (file, changes)
    return sensor, (tests, methods)


def judge_sheet(sensor: str, cases: list[Case], methods: dict) -> dict[str, Judged]:
    """Presses by one tip, and untouched frames, by each method."""
    def counts(_estimated: Instant, true: Instant) -> bool:
        return not true.contacts or (len(true.contacts) == 1 and true.contacts[0].depth >= SHALLOWEST[sensor])
    return {method: judge(cases, calibration, changes, counts) for method, (calibration, changes) in methods.items()}


def sheet_errors(judged: Judged) -> dict[str, float]:
    """The figures of a sheet or a dome."""
    frames = judged.evaluation.summary()['frames']
    wrong = frames['missed'] + frames['too_many'] + frames['false'] + judged.refused
    return {'place': judged.mean('place', 1e3), 'depth': judged.mean('depth', 1e3),
            'force': judged.medians().get('force_relative', np.nan), 'missed, split or false': 1e3 * wrong / max(frames['judged'], 1)}


class Finger:
    """From four voltages to the normal; a frame is a message of ten samples."""

    errors = {'normal': 'degrees', 'false samples': '%'}

    def __init__(self, plan: Plan):
        folder = plan.bags / 'psd_finger'
        folder.mkdir(parents=True, exist_ok=True)
        if plan.recorded:
            self._specimens = [[recorded(folder, f'psd_{name}', 'psd_finger') for name in ('cal_dense', 'grid25', 'nocontact_drift')]]
        else:
            self._specimens = [[simulated(folder, name, 1000.0, 'psd_finger', seed) for name in ('calibration', 'grid', 'light')]
                               for seed in range(1 if plan.quick else 2)]
        self._files = [calibrated(presses, 'psd_finger', folder / f'calibration_{k}.yaml')
                       for k, (presses, *_) in enumerate(self._specimens)]

    def measure(self, number: int) -> list[Row]:
        """A row for each method: means over specimens, out to 60 degrees."""
        rows = []
        for method in ('map', 'paper'):
            normals, ms, false = [], [], []
            for (_, grid, light), file in zip(self._specimens, self._files):
                touches = Touches()
                ms.append(np.median(judge([grid], file, {'method': method}, touches.take).ms))
                normals.append(float(np.mean(touches.errors())))
                judged = judge([light], file, {'method': method})
                false.append(100 * judged.evaluation.touches.frames['false'] / judged.instants)
            rows.append(Row('finger', 'psd_finger', method, '', float(np.mean(ms)),
                            {'normal': float(np.mean(normals)), 'false samples': float(np.mean(false))}))
        return rows


class Touches:
    """Normals of each touch within reach of the map, estimated and true."""

    def __init__(self):
        self._normals: dict[int, list] = {}

    def take(self, estimated: Instant, true: Instant) -> bool:
        """Take an instant; whether it is judged."""
        if in_reach(estimated, true) and len(true.contacts) == len(estimated.contacts or []) == 1:
            self._normals.setdefault(true.contacts[0].id, []).append((estimated.contacts[0].normal, true.contacts[0].normal))
        return in_reach(estimated, true)

    def errors(self) -> list[float]:
        """Error of the mean normal of the middle half of each touch, degrees."""
        errors = []
        for pairs in self._normals.values():
            mean, true = np.nanmean(pairs[len(pairs) // 4:len(pairs) - len(pairs) // 4], axis=0)
            errors.append(float(np.degrees(np.arctan2(np.linalg.norm(np.cross(mean, true)), mean @ true))))
        return errors


def in_reach(_estimated: Instant, true: Instant) -> bool:
    """Whether a finger is judged: untouched, or touched where the map reaches."""
    return not true.contacts or np.arccos(np.clip(true.contacts[0].normal[2], -1, 1)) < FARTHEST


class Taxels:
    """From pressures to region, slip and force."""

    errors = {'slip states': '1 - F1', 'region overlap': '1 - IoU', 'slip velocity': 'mm/s', 'force': '%'}

    def __init__(self, plan: Plan):
        folder = plan.bags / 'taxel_array'
        folder.mkdir(parents=True, exist_ok=True)
        if plan.recorded:
            names = ('cal_zero', 'cal_flat', *TAXEL_RECORDINGS)
            zero, flat, *self._cases = (recorded(folder, f'tac_{name}', 'taxel_array') for name in names)
            self._calibration = calibrated(flat, 'taxel_array', folder / 'calibration.yaml', [zero.bag])
        else:
            names = ('drag', 'grip') if plan.quick else ('demo', 'drag', 'turn', 'grip', 'ring')
            self._cases = [simulated(folder, name, 50.0, 'taxel_array') for name in names]
            self._calibration = Path(share('calibration', 'taxel_array_sim.yaml'))

    def measure(self, number: int) -> list[Row]:
        """A row for each method: all scenes together."""
        found = {method: judge(self._cases, self._calibration, {'method': method}) for method in ('mechanics', 'paper')}
        ours = {'mechanics': {}, 'paper': {'force': np.nan}}  # by calibrated pressure, which the paper has not
        return [Row('taxels', 'taxel_array', method, '', float(np.median(judged.ms)), taxel_errors(judged) | ours[method])
                for method, judged in found.items()]


def taxel_errors(judged: Judged) -> dict[str, float]:
    """The figures of a taxel array."""
    middle = judged.medians()
    return {'slip states': 1 - judged.evaluation.summary()['slip_states']['macro_f1'],
            'region overlap': 1 - middle.get('region_overlap', np.nan), 'slip velocity': middle.get('slip_velocity', np.nan),
            'force': middle.get('force_relative', np.nan)}


PARTS = {'dots': Dots, 'touchpad': Touchpad, 'sheets and dome': Sheets, 'finger': Finger, 'taxels': Taxels}
