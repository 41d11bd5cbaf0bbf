# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the papers areal_sensor_contact_position (tables 1 to 4) and air_cushion_contact (tables I and II)."""
from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.calibration.files.format import read_calibration, write_calibration
from tactile_perception.press.calibration import REST
from tactile_perception.press.tools import calibrate_markers

from .bench import Bench, Row, Table, mean, shipped

RATE = 2.0        # Hz: each stop of the stage is one frame
PLATE_RATE = 8.0  # Hz: from stop to stop markers move by little, so that their numbers can be followed
WAY_RATE = 20.0   # Hz: SORT follows the dome's circles all the way, by what they overlap from frame to frame
STANDS = 1e-5     # m, by which the tip of a stage that stands moves
PX_PER_MM = 10.0  # of the paper with two cameras: "assuming that the coordinate value per 1 mm was 10"
_OURS = {'touch': 'model'}
_PAPER = {'touch': 'paper', 'detection': 'paper_areal'}
_CUSHION = {'touch': 'paper_cushion', 'detection': 'paper_cushion', 'numbering': 'sort', 'rows': 0, 'columns': 0}

Press = tuple[np.ndarray, float, np.ndarray, float]


def presses(bench: Bench, bag: Path, params: Path, calibration: Path) -> list[Press]:
    """(true place (3,) m, true depth m, estimated place, estimated depth) of each press; NaN where none was reported."""
    found = []
    for _, estimated, true in bench.instants(bag, params, calibration):
        if true.contacts:
            tip, stated = true.contacts[0], (estimated.contacts or [None])[0]
            found.append((tip.position, tip.depth, *((np.full(3, np.nan), np.nan) if stated is None else (stated.position, stated.depth))))
    return found


def _place_and_depth(found: list[Press]) -> tuple[float, float, float]:
    """Mean errors of x and y together, as the paper takes the mean of its tables, and of depth, mm; the share of presses that are reported,
    %."""
    off = np.abs([1e3 * (stated - true)[:2] for true, _, stated, _ in found]).reshape(-1, 2)
    stated = 100.0 * float(np.isfinite(off[:, 0]).mean()) if len(off) else np.nan
    return mean(off.ravel()), mean([1e3 * abs(stated - true) for _, true, _, stated in found]), stated


def _calibrated(bench: Bench, sensor: str) -> tuple[Path, Path]:
    """Parameter file and calibration file of the published method of a sheet."""
    params, output = bench.params(sensor, _PAPER), bench.folder / f'{sensor}_paper.yaml'
    fit_published(sensor, [bench.bag(sensor, f'{sensor}_markers', RATE)], params, output, _PAPER['touch'],
                  bench.bag(sensor, f'{sensor}_plate', PLATE_RATE, 80))
    return params, output


def fit_published(sensor: str, bags: list[Path], params: Path, output: Path, method: str, plate: Path | None = None) -> None:
    """Write a calibration file, output, that holds a published method as the paper has it; arguments as of calibrate_markers, whose errors
    it raises."""
    calibrate_markers(bags, params, output, only=method, plate=plate)
    # The guard against a start under a touch is ours: Otsu's markers wander by 0.2 px, for which it refuses frames.
    file = read_calibration(output, sensor)
    file.fitted.pop(REST, None)
    write_calibration(output, file)


def _errors(reported: tuple[str, str], methods: Iterator) -> list[Row]:
    """The rows of a table of presses; reported: by the paper, of place and depth; methods: figures of both."""
    names = 'x and y, mean error', 'depth, mean error', 'presses reported'
    return [Row(*row) for row in zip(names, ('mm', 'mm', '%'), (*reported, ''), *methods)]


def one_camera(bench: Bench) -> Iterator[Table]:
    """Table 1: three places, each pressed three times."""
    sensor = 'areal_single'
    methods = _calibrated(bench, sensor), (bench.params(sensor, _OURS), shipped(sensor))
    bag = bench.bag(sensor, 'areal_single_table_1', RATE)
    yield Table('One camera: table 1', _errors(('1.675', '0.84'), (_place_and_depth(presses(bench, bag, *how)) for how in methods)),
                'Three places and depths (10, 7, 13 mm), three times each.')


def two_cameras(bench: Bench) -> Iterator[Table]:
    """Tables 2 and 3: nine places at 1, 2, 3 mm; table 4: paths of known length."""
    sensor = 'areal_dual'
    methods = _calibrated(bench, sensor), (bench.params(sensor, _OURS), shipped(sensor))
    bag = bench.bag(sensor, 'areal_dual_table_2', RATE)
    yield Table('Two cameras: tables 2 and 3', _errors(('0.63', '0.06'), (_place_and_depth(presses(bench, bag, *how)) for how in methods)),
                f'Nine places at 1, 2 and 3 mm. The paper reports 6.3 px, at {PX_PER_MM:g} px a mm.')
    bag = bench.bag(sensor, 'areal_dual_table_4', RATE)
    (ratio, spread) = zip(*(_ways(presses(bench, bag, *how)) for how in methods))
    yield Table('Two cameras: table 4', [Row('way reported over true way, mean', '', '1.03', *ratio, ideal=1.0),
                                         Row('its standard deviation', '', '0.053', *spread)],
                f'Four paths, by x and y. The paper reports 10.28 px a mm, standard deviation 0.53, at {PX_PER_MM:g} px a mm.')


PATHS = ((0, 1), (2, 3), (4, 5), (6, 7), (7, 8))  # numbers of the presses between which the ways of table 4 lie


def _ways(found: list[Press]) -> tuple[float, float]:
    ratios = [(found[b][2] - found[a][2])[:2] / (found[b][0] - found[a][0])[:2] for a, b in PATHS if b < len(found)]
    known = np.abs(np.array(ratios).ravel())
    return mean(known), float(np.nanstd(known)) if np.isfinite(known).any() else np.nan


def zones(bench: Bench) -> Iterator[Table]:
    """Ten zones, of a regular and a random print, by the tip of the calibration."""
    sensor = 'air_cushion'
    params = bench.params(sensor, _CUSHION)
    # No calibration file of the random print ships, nor has the paper numbers of it.
    for name, print_, reported in (('air_cushion', 'regular', ('4.84', '4.04', '0.08')), ('air_cushion_random', 'random', ('',) * 3)):
        output = bench.folder / f'{name}_paper.yaml'
        fit_published(sensor, [bench.bag(sensor, f'{name}_zones_calibration', WAY_RATE, 180)], params, output, _CUSHION['touch'])
        bag, camera = bench.bag(sensor, f'{name}_zones', WAY_RATE, 90), open_scene(f'{name}_zones', WAY_RATE, bench.seed).camera
        papers, ours = _pixels(bench, bag, params, output, camera), [np.nan] * 4
        if print_ == 'regular':
            ours = _pixels(bench, bag, bench.params(sensor, _OURS), shipped(sensor), camera)
        rows = [Row(*row) for row in zip(('x, mean error', 'y, mean error', 'depth, mean error', 'presses reported'),
                                         ('px', 'px', 'mm', '%'),
                                         (*reported, ''), papers, ours)]
        yield Table(f'Dome: table I, {print_} print', rows,
                    'Ten zones at 12, 20 and 28 mm; calibrated there on the way to 8, 16, 24 and 32 mm, by the same tip.')


def _pixels(bench: Bench, bag: Path, params: Path, calibration: Path, camera) -> list[float]:
    """Mean errors of x and y in the image, px, and of depth, mm, of presses at which the stage stands; those reported, %."""
    found = [now for before, now in pairwise(presses(bench, bag, params, calibration)) if abs(now[1] - before[1]) < STANDS]
    true, stated = (camera.project(np.array([press[k] for press in found]).reshape(-1, 3)) for k in (0, 2))
    x, y = np.abs(stated - true).T
    return [mean(x), mean(y), *_place_and_depth(found)[1:]]
