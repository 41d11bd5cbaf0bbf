# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated marker sheet with one camera and its scenes: 60 x 45 mm, 13 x 9 green discs, LEDs at the sides."""
from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ..optics.camera import CameraDesign
from ..optics.light import Lamps
from ..optics.rendering import Imaging, Renderer
from ..scene.specimen import TIMING, Act, Script, Specimen, by_the_step, drag, one_after_the_other, one_of_two, press, session
from ..skin.surfaces import Rubber, Sheet
from .marker_sheet import INK, SHEET_COLOUR, drags, grid, markers, on_markers, presses, scattered, stage_presses


@dataclass(frozen=True)
class ArealSingle:
    """A sheet with one camera, as made: lengths in m."""

    half: tuple[float, ...] = (0.030, 0.0225)  # of the sides
    deepest: float = 0.013  # press
    near: tuple[float, ...] = (0.0585, 508.0)  # distance of the camera, and its focal length in px


SHEET = ArealSingle()

_TIP = 'ball_6mm'
_LAMPS = Lamps(((-0.046, 0.010, -0.040), (0.048, -0.016, -0.044)), (330.0, 150.0), 0.045, 60.0, SHEET_COLOUR)
#: The box of the paper areal_sensor_contact_position: twice as thick as that of its two cameras, with the same field of view; LEDs at both
#: sides, as bright as each other.
_FAR = 0.093, 508.0 * 0.093 / 0.0585
_PAPERS_LAMPS = Lamps(tuple((x, y, -0.055) for x in (-0.046, 0.046) for y in (-0.014, 0.014)), (150.0,) * 4, 0.055, 60.0, SHEET_COLOUR)


def areal_single(seed: int, width: int = 640, camera: tuple[float, float] = SHEET.near, lamps: Lamps = _LAMPS) -> Specimen:
    """A sheet with one camera. seed: of manufacturing tolerances and noise; width: of the image, px; camera: distance, m, and focal length,
    px."""
    rng = np.random.default_rng([seed, 11])
    sheet = Sheet(2 * SHEET.half[0], 2 * SHEET.half[1], Rubber(48.0 * (1 + rng.normal(0, 0.03)), 1.3, 1.5e-4), 65)
    distance, focal = camera
    camera = CameraDesign((focal, focal), (318.0, 241.0), (-0.085, 0.013, 3e-4, -2e-4, 0.0), (0.0, 0.0, 0.0),
                          (0.0, 0.0, distance)).built(rng).mounted(width)
    imaging = Imaging(blur=1.0, read_noise=0.9, shot_noise=0.014, ink=INK, housing=2.0, cosine=3.0, stop=0.1)
    pattern = markers(sheet, 9, 13, (0.0045, 0.0045), 0.0012, rng)
    return Specimen('areal_single', sheet, pattern, (camera,), (Renderer(sheet, camera, lamps, imaging, seed),))


def _calibration(rng: np.random.Generator) -> list:
    """Presses over the whole sheet to all depths, and drags in random directions."""
    half = SHEET.half
    return presses(_TIP, grid((0.024, 0.0165), 7, 5), half, SHEET.deepest, 3, rng) + drags(_TIP, 8, half, (0.003, 0.009), 0.009, rng)


def _test(rng: np.random.Generator) -> list:
    """Presses at other positions, with the calibrated fingertip and others, and drags."""
    acts = [act for tool in (_TIP, 'ball_5mm', 'ball_7.5mm')
            for act in presses(tool, scattered((0.021, 0.0145), 6, rng), SHEET.half, SHEET.deepest, 3, rng)]
    return acts + drags(_TIP, 4, SHEET.half, (0.003, 0.009), 0.009, rng)


def _session() -> tuple[Act, ...]:
    """Presses as a person makes them: at twelve positions; one that slides at once, one without a pause before it."""
    acts = session(_TIP, grid((0.021, 0.0155), 4, 3), 0.002, 0.004, 0.006)
    acts.insert(3, partial(drag, _TIP, (-0.008, 0.002), 0.004, (0.012, 0.0)))
    first = one_after_the_other(acts[:2], pause=1.6)
    hasty = press(_TIP, 0.0, 0.005, 0.003, start=first[-1][1][-1].t + 0.3, move=0.2, hold=0.5)
    return (*first, hasty, *one_after_the_other(acts[2:], untouched=hasty[1][-1].t + 1.6, pause=1.6))


#: m: positions of table 1 of the paper areal_sensor_contact_position, and the depth at each, three times each.
_TABLE_1 = [position for position in ((0.0130, -0.0095, 0.010), (-0.0160, 0.0055, 0.007), (-0.0140, -0.0115, 0.013)) for _ in range(3)]
#: The experiments of the paper.
_PAPERS = {
    'plate': by_the_step('plate_57x39mm', [(0.0, 0.0)], *(1e-3 * mm for mm in range(1, 14))),
    'markers': stage_presses(_TIP, on_markers((1, 4, 6, 8, 11), (1, 3, 4, 5, 7), 13, 9, (0.0045, 0.0045)), (0.003, 0.006, 0.009, 0.012),
                             SHEET.half, 3, np.random.default_rng(9)),
    'table_1': by_the_step(_TIP, _TABLE_1),
    'motion': one_after_the_other([partial(press, _TIP, 0.0045, -0.0030, 0.004, 0.008, hold=0.5),
                                   partial(drag, _TIP, (-0.010, 0.004), 0.006, (0.020, -0.006))]),
}

AREAL_SINGLE_SCENES: dict[str, Script] = {f'areal_single_{name}': Script(areal_single, acts) for name, acts in {
    'demo': one_after_the_other([
        partial(press, _TIP, 0.004, -0.003, 0.003, 0.008), partial(press, _TIP, -0.017, 0.008, 0.004, 0.009),
        partial(press, _TIP, 0.016, 0.010, 0.002, 0.006), partial(drag, _TIP, (-0.012, -0.006), 0.006, (0.022, 0.008)),
        partial(press, 'fingertips_18mm', 0.0, 0.0, 0.003, 0.006)], untouched=TIMING.starting),
    'press': one_after_the_other([partial(press, _TIP, 0.007, -0.005, 0.004, 0.010)]),
    'drag': one_after_the_other([partial(drag, _TIP, (-0.010, 0.004), 0.006, (0.020, -0.006))]),
    # two fingertips, 2.5 to 5 marker pitches apart
    'two': one_after_the_other([partial(press, f'fingertips_{mm}mm', x, y, 0.003, 0.006) for mm, x, y in (
        (23, 0.0, 0.0), (18, 0.004, -0.006), (14, -0.006, 0.005), (11, 0.003, 0.002))], pause=0.5),
    # two of unlike size, of which one goes deeper and moves away
    'two_unlike': one_after_the_other([partial(one_of_two, 'fingers_4_and_9mm_20mm', (0.001, 0.002, 0.6), 0.003, 0.002, 0.004),
                                       partial(one_of_two, 'fingers_4_and_9mm_26mm', (-0.002, -0.001, 2.9), 0.005, -0.002, 0.003)],
                                      pause=0.5),
    'calibration': one_after_the_other(_calibration(np.random.default_rng(1)), pause=0.3),
    'test': one_after_the_other(_test(np.random.default_rng(2)), pause=0.3),
    'session': _session(),
    **_PAPERS,
}.items()} | {f'areal_single_paper_{name}': Script(partial(areal_single, camera=_FAR, lamps=_PAPERS_LAMPS), acts)
              for name, acts in _PAPERS.items()} | {'areal_single_rest': Script(areal_single, duration=10.0)}
