# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated marker sheet with two cameras and its scenes: 133 x 91 mm, 14 x 11 green discs, about two columns in both views."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..optics.camera import CameraDesign
from ..optics.light import Lamps
from ..optics.rendering import Imaging, Renderer
from ..scene.specimen import TIMING, Script, Shutters, Specimen, by_the_step, drag, one_after_the_other, one_of_two, press, session
from ..skin.surfaces import Rubber, Sheet
from .marker_sheet import INK, SHEET_COLOUR, drags, grid, markers, on_markers, presses, scattered, stage_presses


@dataclass(frozen=True)
class ArealDual:
    """A sheet with two cameras, as made: lengths in m."""

    half: tuple[float, ...] = (0.0665, 0.0455)  # of the sides
    deepest: float = 0.005  # press
    size: tuple[float, ...] = (480, 640)  # px, of an image
    distortion: tuple[float, ...] = (-0.04, 0.005, 2e-4, 3e-4, 0.0)
    off_centre: float = 0.0292  # along x, from the centre of the sheet to each camera
    exposure: float = 1.2  # of the right camera relative to the left one
    bending: float = 1.9e-3  # N m, of a thick sheet: a press leaves a bell two pitches wide at half its depth, as figs 6 and 12 show it
    foundation: float = 0.9e6  # N/m^3, of the layer that holds it and draws nothing inwards


SHEET = ArealDual()

_TIP = 'ball_8mm'
_LAMPS = Lamps(tuple((x, y, -0.042) for x in (-0.088, 0.086) for y in (-0.036, 0.002, 0.033)),
               (95.0, 110.0, 88.0, 120.0, 100.0, 92.0), 0.060, 85.0, SHEET_COLOUR)
_IMAGING = Imaging(blur=0.9, read_noise=0.9, shot_noise=0.014, ink=INK, housing=2.0, cosine=2.0, stop=0.05)
#: Cameras without a trigger: the right one is 6 ms earlier to 12 ms later than the left one; as USB cameras of 30 Hz may be
_FREE = Shutters(offset=0.003, swing=0.009, jitter=2e-4)


def areal_dual(seed: int, thick: bool = False) -> Specimen:
    """A sheet with two cameras. seed: of manufacturing tolerances and noise; thick: it bends and does not stretch."""
    rng = np.random.default_rng([seed, 12])
    stiffer = 1 + rng.normal(0, 0.03)
    rubber = Rubber(0.0, np.inf, SHEET.bending * stiffer, SHEET.foundation) if thick else Rubber(70.0 * stiffer, 1.25, 3.5e-4)
    sheet = Sheet(2 * SHEET.half[0], 2 * SHEET.half[1], rubber, 97)
    cameras = tuple(CameraDesign((289.0, 289.0), centre, SHEET.distortion, turn, position, SHEET.size).built(rng).mounted(SHEET.size[0])
                    for centre, turn, position in (
        ((241.0, 318.0), (0.006, -0.010, -0.022), (SHEET.off_centre, 0.0006, 0.0465)),
        ((238.0, 321.0), (-0.005, 0.012, 0.026), (-SHEET.off_centre, -0.0008, 0.0460))))
    pattern = markers(sheet, 11, 14, (0.0094, 0.0082), 0.0021, rng)
    lights = _LAMPS, replace(_LAMPS, exposure=_LAMPS.exposure * SHEET.exposure * (1 + rng.normal(0, 0.03)))
    renderers = tuple(Renderer(sheet, camera, light, _IMAGING, 2 * seed + side)
                      for side, (camera, light) in enumerate(zip(cameras, lights)))
    return Specimen('areal_dual', sheet, pattern, cameras, renderers, trigger_delay=0.003 + 0.001 * rng.uniform())


def _calibration(rng: np.random.Generator) -> list:
    """Presses over the whole sheet to all depths, and drags in random directions."""
    half = SHEET.half
    return presses(_TIP, grid((0.057, 0.037), 9, 7), half, SHEET.deepest, 2, rng) + drags(_TIP, 8, half, (0.0015, 0.0045), 0.018, rng)


def _test(rng: np.random.Generator) -> list:
    """Presses at other positions, with the calibrated fingertip and others, and drags."""
    acts = [act for tool in (_TIP, 'ball_7.5mm', 'ball_10mm')
            for act in presses(tool, scattered((0.052, 0.033), 8, rng), SHEET.half, SHEET.deepest, 2, rng)]
    return acts + drags(_TIP, 4, SHEET.half, (0.0015, 0.0045), 0.018, rng)


#: m: positions of table 2 of the paper areal_sensor_contact_position, at 10 px a mm; and those of table 4, path by path.
_TABLE_2 = [(-0.0367, -0.0255), (0.0367, -0.0255), (0.0367, 0.0255), (-0.0367, 0.0255), (-0.0367, 0.0), (0.0367, 0.0), (0.0, -0.0255),
            (0.0, 0.0255), (0.0, 0.0)]
_TABLE_4 = [(-0.0210, -0.0107), (-0.0010, 0.0043), (0.0231, 0.0092), (-0.0259, -0.0128), (-0.0165, 0.0173), (-0.0015, 0.0013),
            (0.0360, -0.0140), (0.0270, 0.0140), (-0.0220, -0.0110)]

#: The experiments of the paper.
_PAPERS = {
    'plate': by_the_step('plate_127x87mm', [(0.0, 0.0)], 0.001, 0.002, 0.003),  # as deep as the presses
    'markers': stage_presses(_TIP, on_markers((1, 4, 6, 7, 9, 12), (1, 3, 5, 7, 9), 14, 11, (0.0094, 0.0082)), (0.001, 0.002, 0.003),
                             SHEET.half, 3, np.random.default_rng(10)),
    'table_2': by_the_step(_TIP, _TABLE_2, 0.001, 0.002, 0.003),
    'table_4': by_the_step(_TIP, _TABLE_4, 0.003),
}

AREAL_DUAL_SCENES: dict[str, Script] = {f'areal_dual_{name}': Script(areal_dual, acts) for name, acts in {
    'press': one_after_the_other([partial(press, _TIP, 0.004, -0.008, 0.002, 0.005)]),
    # two fingertips, 2.5 to 5 marker pitches apart
    'two': one_after_the_other([partial(press, f'fingertips_{mm}mm', x, y, 0.002, 0.004) for mm, x, y in (
        (46, 0.0, 0.0), (37, 0.010, -0.012), (28, -0.030, 0.010), (23, 0.003, 0.005))], pause=0.5),
    # two of unlike size, of which one goes deeper and moves away
    'two_unlike': one_after_the_other([partial(one_of_two, 'fingers_6_and_12mm_30mm', (0.003, 0.004, 0.5), 0.002, 0.001, 0.008),
                                       partial(one_of_two, 'fingers_6_and_12mm_42mm', (-0.012, -0.003, 2.8), 0.0035, -0.001, 0.006)],
                                      pause=0.5),
    'calibration': one_after_the_other(_calibration(np.random.default_rng(3)), pause=0.3),
    'test': one_after_the_other(_test(np.random.default_rng(4)), pause=0.3),
    'session': one_after_the_other(session(_TIP, grid((0.047, 0.032), 4, 3), 0.0015, 0.003, 0.0045)),
    **_PAPERS,
}.items()} | {f'areal_dual_paper_{name}': Script(partial(areal_dual, thick=True), acts) for name, acts in _PAPERS.items()} | {
    f'areal_dual_{name}': Script(areal_dual, acts, shutters=_FREE) for name, acts in {
    # presses in the left view, in both views and in the right view; a drag from left to right; two fingertips
    'demo': one_after_the_other([
        partial(press, _TIP, -0.035, 0.015, 0.002, 0.005), partial(press, _TIP, 0.002, -0.010, 0.002, 0.005),
        partial(press, _TIP, 0.040, -0.018, 0.0015, 0.004), partial(drag, _TIP, (-0.025, -0.012), 0.0035, (0.050, 0.020), duration=2.5),
        partial(press, 'fingertips_37mm', 0.0, 0.005, 0.002, 0.004)], untouched=TIMING.starting),
    # presses at 30, 65 and 100 mm/s, under each camera and at the seam
    'fast': one_after_the_other([partial(press, _TIP, x, y, 0.0045, move=0.0045 / speed)
                                 for speed, y in ((0.030, 0.012), (0.065, -0.014), (0.100, 0.003)) for x in (-0.034, 0.002, 0.037)],
                                pause=0.3),
    # drags at about 70 and 100 mm/s through the seam, and out to a corner
    'fast_drag': one_after_the_other([partial(drag, _TIP, (-0.020, 0.005), 0.0035, (0.040, -0.010), duration=0.6),
                                      partial(drag, _TIP, (0.020, -0.015), 0.003, (-0.040, 0.030), duration=0.5),
                                      partial(drag, _TIP, (0.010, -0.015), 0.003, (0.030, 0.030), duration=0.5)], pause=0.3),
}.items()} | {'areal_dual_rest': Script(areal_dual, duration=10.0)}
