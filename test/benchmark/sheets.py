# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Marker sheets of several specimens, each calibrated by straight presses of one tip: errors in presses, drags, of two tips and of cameras
that run free.

    python3 test/benchmark/sheets.py [--sensor areal_single] [--specimens 3] [--seed 0] [--rows press drag_1.0]

Specimens differ in stiffness, prestretch, thickness, print, cameras' poses, friction of the calibration and its tip; tips are 0.6 to 2
times as large. Images are rendered, and processed as recordings are; the simulation shares nothing with the estimator.
"""
from __future__ import annotations

import argparse
import shutil
import tempfile
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from judged import Case, Judged, calibrated, judge

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_opened
from tactile_driver.simulation.optics.rendering import Renderer
from tactile_driver.simulation.scene.specimen import Act, Script, Shutters, Specimen, act, drag, one_after_the_other, one_of_two, press
from tactile_driver.simulation.sensors import areal_dual, areal_single
from tactile_driver.simulation.sensors.marker_sheet import markers
from tactile_driver.simulation.sensors.scenes import AREAL_DUAL_SCENES, SCENES, open_dual_scene, open_scene
from tactile_driver.simulation.skin.surfaces import Rubber, Sheet
from tactile_driver.simulation.skin.tools import TOOLS, Tool, sphere

RATE, SLOW = 30.0, 3.0  # Hz: of scenes, of calibrations
MIN_DEPTH = 0.3e-3          # m: shallower touches are not judged
APART = 2.9             # radii of the larger tip: nearer pairs are not judged
TIPS = 0.6, 2.0         # radii over the calibrated one


@dataclass(frozen=True)
class Kind:
    """A sensor: module; stiffness of thickness one, N/m; bending, N m; nodes; print; radius, m, of a usual tip; positions and depths, m, of
    the calibration; distance, m, within which scenes stay from the centre; range of depths, m; length of drags, m."""

    module: object
    tension: float
    bending: float
    nodes: int
    printed: tuple
    radius: float
    positions: tuple
    depths: tuple
    within: tuple
    deep: tuple
    drag_length: float


KINDS = {
    'areal_single': Kind(areal_single, 48.0, 1.5e-4, 65, (9, 13, (0.0045, 0.0045), 0.0012), 0.006, (0.018, 0.011),
                         (0.003, 0.006, 0.009, 0.012), (0.017, 0.011), (0.003, 0.010), 0.016),
    'areal_dual': Kind(areal_dual, 70.0, 3.5e-4, 97, (11, 14, (0.0094, 0.0082), 0.0021), 0.008, (0.042, 0.026),
                       (0.001, 0.003, 0.005), (0.045, 0.028), (0.0015, 0.0045), 0.040)}


class AnySheet:
    """A specimen by its seed. radius: m, of the tip that calibrates it; friction: of its calibration."""

    def __init__(self, kind: str, seed: int):
        self.name, self.kind, self.seed = kind, KINDS[kind], seed
        rng = np.random.default_rng([seed, 31])
        self.radius, self.friction = self.kind.radius * float(np.exp(rng.uniform(-0.25, 0.25))), rng.uniform(0.3, 0.7)
        self._thick, self._stiff, self._stretch = np.exp(rng.uniform(-0.35, 0.35)), np.exp(rng.uniform(-0.4, 0.4)), rng.uniform(1.2, 1.45)

    def build(self, _seed: int = 0, _width: int = 0) -> Specimen:
        """The sensor that ships, with another sheet and print and moved cameras."""
        kind, rng, usual = self.kind, np.random.default_rng([self.seed, 32]), getattr(self.kind.module, self.name)(self.seed)
        lamps = kind.module._LAMPS
        half, tension = kind.module.SHEET.half, kind.tension * self._thick * self._stiff
        rubber = Rubber(tension, self._stretch, kind.bending * self._stiff * self._thick**3)
        sheet = Sheet(2 * half[0], 2 * half[1], rubber, kind.nodes)
        cameras = tuple(replace(one, translation=one.translation + rng.normal(0, (5e-4, 5e-4, 1e-3))) for one in usual.cameras)
        renderers = tuple(Renderer(sheet, camera, lamps, old.imaging, 2 * self.seed + side)
                          for side, (camera, old) in enumerate(zip(cameras, usual.renderers)))
        return replace(usual, skin=sheet, pattern=markers(sheet, *kind.printed, rng), cameras=cameras, renderers=renderers)

    def calibration(self) -> Script:
        """Straight presses at nine positions, as few as a small calibration has."""
        ball, (x, y) = _ball(self.radius), self.kind.positions
        positions = [(a, b) for b in (-y, 0.0, y) for a in (-x, 0.0, x)]
        acts = one_after_the_other([partial(_stairs, ball, self.kind.depths, *position) for position in positions], pause=0.3)
        return Script(self.build, acts, self.friction)

    def scene(self, row: str, seed: int) -> tuple[Script, Shutters | None]:
        """The script of a row of the table, and when the right camera exposes; seed: of positions, depths, drags and tips."""
        what, _, number = row.partition('_')
        rng = np.random.default_rng([self.seed, seed, *row.encode()])
        number = float(number or self.friction)
        if what == 'shutter':
            return Script(self.build, self._fast(rng), self.friction), Shutters(1e-3 * number, jitter=2e-4)
        return Script(self.build, getattr(self, f'_{what}')(rng), number), None

    def _tip(self, rng: np.random.Generator) -> float:
        """A radius, m; every second one is the calibrated one."""
        return self.radius * (float(np.exp(rng.uniform(*np.log(TIPS)))) if rng.random() < 0.5 else 1.0)

    def _place(self, rng: np.random.Generator) -> list[float]:
        return list(rng.uniform(-1, 1, 2) * self.kind.within)

    def _press(self, rng: np.random.Generator) -> tuple[Act, ...]:
        return one_after_the_other([partial(press, _ball(self._tip(rng)), *self._place(rng), *np.sort(rng.uniform(*self.kind.deep, 2)))
                                    for _ in range(6)], pause=0.3)

    def _drag(self, rng: np.random.Generator) -> tuple[Act, ...]:
        acts = []
        while len(acts) < 5:
            start, angle = np.array(self._place(rng)), rng.uniform(0, 2 * np.pi)
            path = self.kind.drag_length * rng.uniform(0.5, 1.5) * np.array([np.cos(angle), np.sin(angle)])
            if (np.abs(start + path) < self.kind.within).all():
                speed = rng.uniform(0.01, 0.1)  # m/s
                acts.append(partial(drag, _ball(self._tip(rng)), start, rng.uniform(*self.kind.deep), path,
                                    duration=max(float(np.hypot(*path)) / speed, 0.2)))
        return one_after_the_other(acts, pause=0.3)

    def _two(self, rng: np.random.Generator) -> tuple[Act, ...]:
        acts = []
        for _ in range(4):
            radii = [self.radius * float(np.exp(rng.uniform(np.log(TIPS[0]), np.log(1.6)))) for _ in range(2)]
            apart, yaw, depth = max(radii) * rng.uniform(3.2, 4.5), rng.uniform(0, np.pi), self.kind.deep[0] + rng.uniform(0, 0.002)
            acts.append(partial(one_of_two, _pair(radii, apart), (*rng.uniform(-0.003, 0.003, 2), yaw), depth, rng.uniform(-0.001, 0.001),
                                rng.uniform(0.0, 0.005)))
        return one_after_the_other(acts, pause=0.3)

    def _fast(self, rng: np.random.Generator) -> tuple[Act, ...]:
        deepest = self.kind.depths[-1]
        acts = [partial(press, _ball(self._tip(rng)), *self._place(rng), depth, move=depth / speed)
                for speed in (0.065, 0.1) for depth in rng.uniform(0.6 * deepest, deepest, 4)]
        return one_after_the_other(acts, pause=0.2)


def _ball(radius: float) -> str:
    """Name of a ball of radius, m."""
    name = f'ball_{1e6 * radius:.0f}um'
    TOOLS[name] = Tool(name, (partial(sphere, radius=radius),), tip_radius=radius)
    return name


def _stairs(tool: str, depths: tuple, x: float, y: float, *, start: float) -> Act:
    """A tool that is pressed in at x, y, m, stops at each of the depths, m, and is lifted at once."""
    stops = [({'t': (2 * k + 1) / SLOW, 'press': depth}, {'t': (2 * k + 2) / SLOW}) for k, depth in enumerate(depths)]
    return act(tool, start, *[key for stop in stops for key in stop], {'t': 2 * len(depths) / SLOW + 0.03, 'press': 0.0}, x=x, y=y)


def _pair(radii: list[float], apart: float) -> str:
    """Name of two balls of radii, m, whose lowest points are apart, m."""
    name = f'balls_{1e6 * radii[0]:.0f}_{1e6 * radii[1]:.0f}um_{1e6 * apart:.0f}um'
    positions = tuple((x, 0.0, radius) for x, radius in zip((-apart / 2, apart / 2), radii))
    TOOLS[name] = Tool(name, tuple(partial(sphere, radius=radius) for radius in radii), positions, min(radii), central=True)
    return name


def write(sheet: AnySheet, folder: Path, name: str, script: Script, rate: float, shutters: Shutters | None = None) -> Case:
    """The bag of a script, which becomes a scene of the sheet's sensor."""
    name = f'{sheet.name}_{name}'
    SCENES[name] = script
    if sheet.name == 'areal_dual':
        AREAL_DUAL_SCENES[name] = script
        scene = open_dual_scene(name, rate, sheet.seed, shutters)
    else:
        scene = open_scene(name, rate, sheet.seed)
    write_opened(folder / name, scene)
    return Case(folder / name, Path(share('params', f'{sheet.name}_sim.yaml')))


def counts(apart: float, _estimated, true) -> bool:
    """Whether an instant is judged: untouched, or touched deep enough by tips that are far enough apart, m."""
    tips = true.contacts or []
    if tips and min(tip.depth for tip in tips) < MIN_DEPTH:
        return False
    return len(tips) < 2 or np.hypot(*(tips[0].position - tips[1].position)[:2]) >= apart


def line(name: str, judged: Judged) -> str:
    """A line of the table."""
    errors, summary = judged.evaluation.errors(), judged.evaluation.summary()
    spreads = [1e3 * np.abs(errors[quantity][np.isfinite(errors[quantity][:, 3]), 3]) for quantity in ('position', 'depth')]
    frames, middle = summary['frames'], judged.medians()
    whole = 1 - (frames['missed'] + frames['too_few'] + frames['too_many']) / max(frames['touched'], 1)
    return (f'| {name} | ' + ' | '.join(f'{part.mean():.3f} / {np.percentile(part, 95):.3f}' for part in spreads)
            + f' | {summary["covariance"].get("mean", np.nan):.2f} | {middle.get("force_relative", np.nan):.1f} '
            f'| {middle.get("moment_relative", np.nan):.1f} | {100 * whole:.0f} | {frames["false"]} |')


ROWS = {'areal_single': ('press', *(f'drag_{friction}' for friction in (0.2, 0.35, 0.6, 1.0)), 'two_0.2', 'two_1.0')}
ROWS['areal_dual'] = (*ROWS['areal_single'], *(f'shutter_{ms}' for ms in (-16.0, -11.5, -5.0, 0.0, 5.0, 11.5, 16.0)))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--sensor', choices=list(KINDS), default='areal_single')
    parser.add_argument('--specimens', type=int, default=3)
    parser.add_argument('--seed', type=int, default=0, help='of the scenes, and the first specimen')
    parser.add_argument('--rows', nargs='+', default=None)
    wanted = parser.parse_args()
    print('| specimen, row | position, mm, mean / 95 % | depth | squared | force, % | moment, % | reported, % | beside |')
    print('|---' * 8 + '|')
    for number in range(wanted.seed, wanted.seed + wanted.specimens):
        sheet = AnySheet(wanted.sensor, number)
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            calibration = calibrated(write(sheet, folder, 'small', sheet.calibration(), SLOW), wanted.sensor, folder / 'calibration.yaml')
            for row in wanted.rows or ROWS[wanted.sensor]:
                script, shutters = sheet.scene(row, wanted.seed)
                case = write(sheet, folder, row, script, RATE, shutters)
                judged = judge([case], calibration, counts=partial(counts, APART * 1.6 * sheet.radius))
                print(line(f'{number}, {row}', judged), flush=True)
                shutil.rmtree(case.bag)


if __name__ == '__main__':
    main()
