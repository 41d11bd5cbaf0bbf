# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the benchmark: what each sensor is judged on, by which methods, and which of the errors are its figures."""
from __future__ import annotations

import contextlib
import io
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import dots
import numpy as np
from judged import Case, Counts, Judged, calibrated, judge, recorded, simulated, touchpad_scene
from printed_dots import NAMES

from tactile_bringup import share
from tactile_bringup.papers.bench import mean
from tactile_bringup.papers.sheets import fit_published
from tactile_perception.common.geometry import error_angle
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.evaluation.evaluation import Instant
from tactile_perception.press.tools import PressReader, fit_markers

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
#: The rest of its chain; SORT, which numbers a dome's circles, needs 20 frames/s, which these scenes do not have.
PAPERS_CHAIN = {'paper': {'numbering': 'paper', 'stitching': 'middle'}, 'paper_cushion': {}}
TAXEL_RECORDINGS = ('static_ring', 'incipient_rect', 'rotate_rect', 'grip_hold')
FARTHEST = np.radians(61.0)  # from the finger's pole

Row = tuple[str, str, str, float, dict[str, float]]  # source, method, size of the images ('' without), ms a frame, errors by name


@dataclass(frozen=True)
class Measure:
    """A figure of accuracy. unit: '' of a score from 0 to 1; is_higher_better: of scores; unnoticed: change of the figure that is none,
    whatever the spread of the rounds; reported: sensor type -> what its paper reports, on its own sensor."""

    unit: str
    unnoticed: float
    is_higher_better: bool = False
    reported: Mapping[str, str] = field(default_factory=dict)


def score(unnoticed: float = 2e-3) -> Measure:
    """A measure from 0 to 1, of which higher is better."""
    return Measure('', unnoticed, True)


@dataclass(frozen=True)
class Part:
    """prepare(quick, from_recordings, bags): makes what is measured on, in the folder bags, whose bags are taken if they are there, and
    returns a function of the round's number that yields a Row a method."""

    measures: Mapping[str, Measure]
    prepare: Callable[[bool, bool, Path], Callable[[int], Iterator[Row]]]


@dataclass(frozen=True)
class Subject:
    """A sensor on groups of bags; a figure is the mean over the groups that know it. methods: name -> (calibration in place of the bags'
    own, changes of the parameters); figures: of a judged group; counts: makes what says which instants are judged; unknown: method ->
    figures that it does not estimate."""

    source: str
    groups: list[list[Case]]
    methods: Mapping[str, tuple[Path | None, Mapping]]
    figures: Callable[[Judged], dict[str, float]]
    size: str = ''
    counts: Counts = lambda _estimated, _true: True
    unknown: Mapping[str, str] = field(default_factory=dict)

    def measure(self, _number: int) -> Iterator[Row]:
        """A Row for each method."""
        for method, (calibration, changes) in self.methods.items():
            found = [judge(group, calibration, changes, self.counts) for group in self.groups]
            each = [self.figures(judged) for judged in found]
            errors = {name: np.nan if name == self.unknown.get(method) else mean([one[name] for one in each]) for name in each[0]}
            yield self.source, method, self.size, mean([np.median(judged.ms) for judged in found]), errors


def all_of(subjects: list[Subject]) -> Callable[[int], Iterator[Row]]:
    return lambda number: (row for subject in subjects for row in subject.measure(number))


def own_folder(bags: Path, sensor: str) -> Path:
    (bags / sensor).mkdir(parents=True, exist_ok=True)
    return bags / sensor


def printed(quick: bool, _from_recordings: bool, _bags: Path) -> Callable[[int], Iterator[Row]]:
    """Detection alone: images of 23 x 23 dots, of three sizes; other dots in each round."""
    def measure(number: int) -> Iterator[Row]:
        for size in list(SIZES)[:2 if quick else 3]:
            names = (('plain', 'all at once') if quick else NAMES)[:None if size == VGA else 1]
            for method, (sums, ms) in dots.find(number, 2 if quick else 4, names, SIZES[size]).items():
                position = (sums['error2'] / sums['matched'])**0.5 if sums['matched'] else np.nan
                lost = 1e3 * (sums['true'] - sums['matched'] + sums['false']) / sums['true']
                # the pitch is 18 px in 640 x 480
                yield 'printed dots', method, size, ms, {'position': 1e3 * position / (18 * SIZES[size][0] / 640), 'missed or false': lost}
    return measure


def touchpad(quick: bool, from_recordings: bool, bags: Path) -> Callable[[int], Iterator[Row]]:
    """From an image to the contact region, of two sizes."""
    folder = own_folder(bags, 'touchpad')
    if from_recordings:
        cases = {VGA: [recorded(folder, name, 'touchpad') for name in TOUCHPAD_RECORDINGS]}
    else:
        names, sizes = (('rectangle_drag',), (VGA,)) if quick else (('rectangle_drag', 'ring_press', 'disc_twist'), ('320 x 240', VGA))
        cases = {size: [touchpad_scene(folder, name, 5.0 if quick else 10.0, SIZES[size]) for name in names] for size in sizes}
    methods = {name: (None, changes) for name, changes in TOUCHPAD_METHODS.items()}
    ours = dict.fromkeys(set(methods) - {'membrane'}, 'depth')  # the paper estimates none
    return all_of([Subject('touchpad', [[case] for case in some], methods, touchpad_figures, size, unknown=ours)
                   for size, some in cases.items()])


def touchpad_figures(judged: Judged) -> dict[str, float]:
    f1 = judged.dots_f1()
    return {'region IoU': judged.mean('region_overlap'), 'contact F1': f1['contact'], 'slipping F1': f1['slipping'],
            'depth': judged.medians().get('depth', np.nan)}


def sheets(quick: bool, from_recordings: bool, bags: Path) -> Callable[[int], Iterator[Row]]:
    """From an image, or two, to presses on sheets and domes by one tip, calibrated by presses at other positions."""
    return all_of([sheet(sensor, own_folder(bags, sensor), from_recordings) for sensor in list(SHEETS)[:1 if quick else 3]])


def sheet(sensor: str, folder: Path, from_recordings: bool) -> Subject:
    """The published method of sheets needs a plate, which the recordings lack."""
    if from_recordings:
        presses, *tests = (recorded(folder, f'{SHEETS[sensor]}_{part}', sensor) for part in ('calib_small', 'test'))
    else:
        presses, *tests = (simulated(folder, f'{sensor}_{scene}', sensor, rate) for scene, rate in
                           (('calibration', 3.0), ('test', 4.0), ('two', 4.0)))
    paper, of_paper, plate = 'paper_cushion' if sensor == 'air_cushion' else 'paper', None, None
    if sensor == 'air_cushion':
        of_paper = presses if from_recordings else simulated(folder, 'air_cushion_zones_calibration', sensor, 4.0)
    elif not from_recordings:
        of_paper, plate = (simulated(folder, f'{sensor}_{scene}', sensor, rate) for scene, rate in (('markers', 2.0), ('plate', 8.0)))
    with contextlib.redirect_stderr(io.StringIO()):
        fit_markers(PressReader(presses.params), [presses.bag], model := folder / 'model.yaml', only='model')
        methods = {'model': (model, {'touch': 'model'})}
        if of_paper:
            changes = {'touch': paper, 'detection': PAPERS_MARKERS[paper], **PAPERS_CHAIN[paper]}
            params, file = write_parameters(folder / 'paper.yaml', changes, of_paper.params), folder / 'paper_calibration.yaml'
            fit_published(sensor, [of_paper.bag], params, file, paper, plate and plate.bag)
            methods[paper] = (file, changes)
    return Subject(sensor, [tests], methods, sheet_figures, counts=partial(deep_enough, SHALLOWEST[sensor]))


def deep_enough(least: float, _estimated: Instant, true: Instant) -> bool:
    return not true.contacts or (len(true.contacts) == 1 and true.contacts[0].depth >= least)


def sheet_figures(judged: Judged) -> dict[str, float]:
    frames = judged.evaluation.summary()['frames']  # miscounted: a contact is missed, split, or false
    wrong = frames['missed'] + frames['too_many'] + frames['false'] + judged.refused
    return {'position': judged.mean('position', 1e3), 'depth': judged.mean('depth', 1e3),
            'force': judged.medians().get('force', np.nan), 'miscounted': 1e3 * wrong / max(frames['judged'], 1)}


def finger(quick: bool, from_recordings: bool, bags: Path) -> Callable[[int], Iterator[Row]]:
    """From four voltages to the normal, out to 60 degrees; a frame is a message of ten samples."""
    folder, groups = own_folder(bags, 'psd_finger'), []
    for seed in range(1 if quick or from_recordings else 2):
        presses, *tests = (recorded(folder, f'psd_{name}', 'psd_finger') for name in ('cal_dense', 'grid25', 'nocontact_drift')) \
            if from_recordings else (simulated(folder, name, 'psd_finger', seed=seed) for name in ('calibration', 'grid', 'light'))
        file = calibrated(presses, 'psd_finger', folder / f'calibration_{seed}.yaml')
        groups += [[replace(case, calibration=file)] for case in tests]
    return all_of([Subject('psd_finger', groups, {method: (None, {'method': method}) for method in ('map', 'paper')}, finger_figures,
                           counts=in_reach)])


def in_reach(_estimated: Instant, true: Instant) -> bool:
    """Whether a finger is judged: untouched, or touched where the map reaches."""
    return not true.contacts or np.arccos(np.clip(true.contacts[0].normal[2], -1, 1)) < FARTHEST


def finger_figures(judged: Judged) -> dict[str, float]:
    """The error of the mean normal of the middle half of each touch; false contacts of a bag in which nothing touches."""
    touches = defaultdict(list)
    for estimated, true in judged.single:
        touches[true.id].append((estimated.normal, true.normal))
    middles = [np.nanmean(pairs[len(pairs) // 4:len(pairs) - len(pairs) // 4], axis=0) for pairs in touches.values()]
    frames = judged.evaluation.summary()['frames']
    return {'normal': mean([np.degrees(error_angle(*middle)) for middle in middles]),
            'false samples': np.nan if frames['touched'] else 100 * frames['false'] / judged.instants}


def taxels(quick: bool, from_recordings: bool, bags: Path) -> Callable[[int], Iterator[Row]]:
    """From pressures to region, slip and force."""
    folder, sensor = own_folder(bags, 'taxel_array'), 'taxel_array'
    if from_recordings:
        zero, flat, *cases = (recorded(folder, f'tac_{name}', sensor) for name in ('cal_zero', 'cal_flat', *TAXEL_RECORDINGS))
        calibration = calibrated(flat, sensor, folder / 'calibration.yaml', [zero.bag])
    else:
        names = ('drag',) if quick else ('demo', 'drag', 'turn', 'grip', 'ring')
        cases = [simulated(folder, name, sensor, 50.0) for name in names]
        calibration = Path(share('calibration', 'taxel_array_sim.yaml'))
    methods = {method: (calibration, {'method': method}) for method in ('mechanics', 'paper')}
    return all_of([Subject(sensor, [cases], methods, taxel_figures, unknown={'paper': 'force'})])  # by calibrated pressure


def taxel_figures(judged: Judged) -> dict[str, float]:
    medians = judged.medians()
    return {'slip state F1': judged.evaluation.summary()['slip_states']['macro_f1'],
            'region IoU': medians.get('region_overlap', np.nan), 'slip velocity': medians.get('slip_velocity', np.nan),
            'force': medians.get('force', np.nan)}


PARTS = {
    'dots': Part({'position': Measure('1/1000 pitch', 0.02), 'missed or false': Measure('per 1000', 0.5)}, printed),
    'touchpad': Part({'region IoU': score(), 'contact F1': score(), 'slipping F1': score(), 'depth': Measure('mm', 2e-3)}, touchpad),
    # Tables 1 and 2 of the sheets' paper, table I of the dome's.
    'sheets and dome': Part({'position': Measure('mm', 2e-3, reported={'areal_single': '2.64 mm', 'areal_dual': '0.93 mm',
                                                                       'air_cushion': '4.84 px in x, 4.04 px in y'}),
                             'depth': Measure('mm', 2e-3, reported={'areal_single': '0.84 mm', 'areal_dual': '0.06 mm',
                                                                    'air_cushion': '0.08 mm'}),
                             'force': Measure('N', 2e-3), 'miscounted': Measure('per 1000', 0.5)}, sheets),
    'finger': Part({'normal': Measure('degrees', 0.01, reported={'psd_finger': '6 degrees at most'}),
                    'false samples': Measure('%', 0.1)}, finger),
    'taxels': Part({'slip state F1': score(), 'region IoU': score(), 'slip velocity': Measure('mm/s', 0.02), 'force': Measure('N', 2e-3)},
                   taxels)}
