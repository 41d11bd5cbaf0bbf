# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the whole benchmark: the measurements of each part's own benchmark in one form."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from tactile_bringup.installed import share
from tactile_bringup.simulate.bags import write_taxel_scene
from tactile_perception.tools.calibrate import taxel as calibrate_taxels
from tactile_perception.tools.convert.command import convert, open_recording

import dots
import pipeline
import psd
import sources
import taxel_turns
import touch
import touch_sources
import tracking

NOISE = 2.0  # grey levels
_TOUCHPAD_RECORDINGS = ('tp_rect_drag', 'tp_ring_press', 'tp_disc_twist', 'tp_two_spheres', 'tp_disc_impact', 'tp_rect_release',
                        'tp_disc_press_glare')
SIZES = {'320 x 240': (320, 240), '640 x 480': (640, 480), '960 x 720': (960, 720)}
VGA = '640 x 480'


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
    errors: by name, less is better, NaN: not told."""

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
        self._names = ('plain', 'all at once') if plan.quick else dots.NAMES
        self._frames = 2 if plan.quick else 4

    def measure(self, number: int) -> list[Row]:
        """A row for each method and size; other dots in each round."""
        rows = []
        for size, pixels in self._sizes.items():
            names = self._names if size == VGA else self._names[:1]
            found = dots.run([number], self._frames, (NOISE,), names, pixels)
            for method, scenes in found.items():
                cells = [by[NOISE] for by in scenes.values()]
                sums = {key: sum(cell[key] for cell in cells) for key in ('error2', 'matched', 'true', 'false')}
                lost = 1e3 * (sums['true'] - sums['matched'] + sums['false']) / sums['true']
                place = (sums['error2'] / sums['matched'])**0.5 if sums['matched'] else np.nan
                rows.append(Row('dots', 'printed dots', method, size, float(np.median([cell['ms'] for cell in cells])),
                                {'place': _of_pitch(place, pixels), 'missed or false': lost}))
        return rows


class Numbers:
    """From an image to numbered dots."""

    errors = {'place': '1/1000 pitch', 'none or wrong': 'per 1000'}

    def __init__(self, plan: Plan):
        self._scenes, self._turns = (2, 2) if plan.quick else (len(tracking.NAMES), 4)

    def measure(self, number: int) -> list[Row]:
        """A row for each way: means over scenes of where its dots had numbers."""
        by_way: dict[str, list[dict]] = {}
        for row in tracking.measure(self._scenes, self._turns):
            by_way.setdefault(row['way'], []).append(row)
        return [self._row(*way.partition(', 320 x 240'), rows) for way, rows in by_way.items()]

    @staticmethod
    def _row(way: str, small: str, _: str, rows: list[dict]) -> Row:
        size = small.removeprefix(', ') or VGA
        errors = {'place': _of_pitch(float(np.median([row['error_px'] for row in rows])), SIZES[size]),
                  'none or wrong': float(np.mean([row['none_per_1000'] + row['wrong_per_1000'] for row in rows]))}
        return Row('numbers', 'printed dots', way, size, float(np.median([row['ms'] for row in rows])), errors)


class Touchpad:
    """From an image to the contact region, of two sizes."""

    errors = {'region overlap': '1 - IoU', 'contact dots': '1 - F1', 'slipping dots': '1 - F1', 'depth': 'mm'}

    def __init__(self, plan: Plan):
        names = _TOUCHPAD_RECORDINGS if plan.recorded else tuple(
            f'scene:{name}' for name in ('rectangle_drag', 'ring_press', 'disc_twist'))
        rate = 5.0 if plan.quick else 10.0
        sizes = [VGA] if plan.recorded else ['320 x 240', VGA]
        self._sources = {(size, name): sources.open_source(name, rate, size=SIZES[size]) for size in sizes for name in names}

    def measure(self, number: int) -> list[Row]:
        """A row for each method and size: means over sources."""
        found: dict[tuple, list[dict]] = {}
        for (size, _), source in self._sources.items():
            for method, score in pipeline.run(source).items():
                found.setdefault((size, method), []).append(score.row())
        columns = {'IoU': 'region overlap', 'contact F1': 'contact dots', 'slip F1': 'slipping dots'}
        rows = []
        for (size, method), scores in found.items():
            mean = {key: pipeline.known_mean([score[key] for score in scores]) for key in (*columns, 'depth mm', 'total ms')}
            errors = {name: 1 - mean[key] for key, name in columns.items()} | {'depth': mean['depth mm']}
            rows.append(Row('touchpad', 'touchpad', method, size, mean['total ms'], errors))
        return rows


class Markers:
    """From an image, or two, to touches on sheets and domes, calibrated by presses at other places."""

    errors = {'place': 'mm', 'depth': 'mm', 'force': '%', 'missed, split or false': 'per 1000'}

    def __init__(self, plan: Plan):
        names = list(touch_sources.RECORDINGS if plan.recorded else touch_sources.MARKER_SENSORS)[:1 if plan.quick else 3]
        opened = [touch_sources.open_source(name, plan.bags) for name in names]
        self._ready = [(source, touch.calibrate_all(source)) for source in opened]
        self._most = 60 if plan.quick else 0

    def measure(self, number: int) -> list[Row]:
        """A row for each sensor and method."""
        rows = []
        for source, ready in self._ready:
            for method, score in touch.run(source, ready, self._most).items():
                row = score.row()
                wrong = 1e3 * (row['missed'] + row['split'] + row['false'] + row['refused']) / max(len(score.found), 1)
                rows.append(Row('sheets and dome', source.type, method, '', row['total ms'],
                                {'place': row['place mm'], 'depth': row['depth mm'], 'force': row['force %'],
                                 'missed, split or false': wrong}))
        return rows


class Finger:
    """From four voltages to the normal; a frame is a batch of five samples."""

    errors = {'normal': 'degrees', 'false samples': '%'}

    def __init__(self, plan: Plan):
        self._specimens = ['recorded'] if plan.recorded else ['sim:0'] if plan.quick else ['sim:0', 'sim:1']

    def measure(self, number: int) -> list[Row]:
        """A row for each method: means over specimens, out to 60 degrees."""
        found = [psd.run(specimen) for specimen in self._specimens]
        rows = []
        for method in found[0]['accuracy']:
            off = [row['error'] for one in found for row in one['accuracy'][method] if row['theta'] < psd.FARTHEST]
            false = [one['contacts'][f'{method}, light']['false samples (%)'] for one in found]
            ms = [1e-3 * one['speed'][f'{method}, 5'] for one in found]
            rows.append(Row('finger', 'psd_finger', method, '', float(np.mean(ms)),
                            {'normal': float(np.nanmean(off)), 'false samples': float(np.mean(false))}))
        return rows


class Taxels:
    """From pressures to region, slip and force."""

    errors = {'slip states': '1 - F1', 'region overlap': '1 - IoU', 'slip velocity': 'mm/s', 'force': '%'}
    _RECORDED = ('tac_static_ring', 'tac_incipient_rect', 'tac_rotate_rect', 'tac_grip_hold')
    _RATE = 50.0

    def __init__(self, plan: Plan):
        folder = plan.bags / 'taxel_array'
        folder.mkdir(parents=True, exist_ok=True)
        self._bags, self._parameters, self._calibration = (self._recorded if plan.recorded else self._simulated)(folder, plan.quick)

    def _simulated(self, folder: Path, quick: bool) -> tuple[list[Path], Path, Path]:
        names = ('drag', 'grip') if quick else ('demo', 'drag', 'turn', 'grip', 'ring')
        for name in names:
            if not (folder / name).exists():
                write_taxel_scene(folder / name, name, self._RATE)
        return [folder / name for name in names], Path(share('params', 'taxel_array_sim.yaml')), Path(
            share('calibration', 'taxel_array_sim.yaml'))

    def _recorded(self, folder: Path, _quick: bool) -> tuple[list[Path], Path, Path]:
        for name in ('tac_cal_zero', 'tac_cal_flat', *self._RECORDED):
            recording = open_recording(touch_sources.recording_folder(name))
            if not (folder / name).exists():
                convert(recording, folder / name, 'taxel_array')
        parameters, calibration = folder / 'parameters.yaml', folder / 'calibration.yaml'
        parameters.write_text(yaml.safe_dump({'/**': {'ros__parameters': recording.parameters()}}))
        calibrate_taxels.calibrate_taxels([folder / 'tac_cal_zero', folder / 'tac_cal_flat'], parameters, calibration)
        return [folder / name for name in self._RECORDED], parameters, calibration

    def measure(self, number: int) -> list[Row]:
        """A row for each method: all scenes together."""
        return [Row('taxels', 'taxel_array', method, '', 1e3 * float(np.median(turns.seconds)), turns.row())
                for method, turns in taxel_turns.run(self._bags, self._parameters, self._calibration).items()]


PARTS = {'dots': Dots, 'numbers': Numbers, 'touchpad': Touchpad, 'sheets and dome': Markers, 'finger': Finger, 'taxels': Taxels}
