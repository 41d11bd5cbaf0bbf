# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of what is drawn: colours, sizes and limits."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class Colours:
    """Red, green and blue, 0 to 1, of what is drawn."""

    states: tuple[tuple[float, float, float], ...] = constant(
        ((0.45, 0.62, 0.80), (0.20, 0.85, 0.35), (1.00, 0.15, 0.90)), '1', 'prior',
        'of dots by state: untouched, sticking, slipping (the constants of ContactRegion)')
    region: tuple[float, float, float] = constant((1.00, 0.82, 0.10), '1', 'prior', 'of the border of a contact, and of warnings')
    hole: tuple[float, float, float] = constant((0.30, 0.90, 1.00), '1', 'prior', 'of the border of a hole in a contact')
    contact: tuple[float, float, float] = constant((1.00, 1.00, 1.00), '1', 'prior', 'of a contact point and its normal')
    arrow: tuple[float, float, float] = constant((1.00, 1.00, 0.35), '1', 'prior', 'of displacements')
    force: tuple[float, float, float] = constant((1.00, 0.55, 0.10), '1', 'prior', 'of a force')
    torque: tuple[float, float, float] = constant((0.60, 0.40, 1.00), '1', 'prior', 'of a torque')
    text: tuple[float, float, float] = constant((1.00, 1.00, 1.00), '1', 'prior', 'of words, and of unknown states')
    glass: tuple[float, float, float] = constant((0.80, 0.86, 0.92), '1', 'prior', 'of the hemisphere of a finger')


COLOURS = Colours()


@dataclass(frozen=True)
class DrawingConstants:
    """Constants of pictures and markers."""

    min_arrow: float = constant(1.2, 'px', 'limit', 'of the picture; shorter arrows show mostly noise')
    arrow_head: float = constant(0.35, '1', 'prior', 'length of the head over that of the arrow')
    font_scale: float = constant(0.6, '1', 'prior', 'letters are 13 px high')
    max_bordered_arrows: int = constant(200, '1', 'limit', 'up to this number each arrow has a dark border')
    ring_gap: float = constant(2.0, 'px', 'prior', 'between a dot and its ring')
    panel_width: int = constant(600, 'px', 'prior', 'at which RViz shows the picture; what is drawn is legible there')
    marker_s: float = constant(2.0, 's', 'limit', 'after the last data, after which RViz removes markers')
    sigmas_95: float = constant(2.796, '1', 'numeric', 'square root of the 95 % quantile of chi-square with 3 degrees of freedom')
    min_diameter: float = constant(1e-5, 'm', 'limit', 'of a marker; RViz warns about a scale of zero')
    outline_height: float = constant(2e-4, 'm', 'numeric', 'of outlines over the surface, which would otherwise hide them')
    letter_share: float = constant(0.13, '1', 'prior',
                                   'letter height over the half width of the sensor; at least 16 px in the shipped views')
    min_half_width: int = constant(16, '1', 'limit', 'over the dot size; that of the touchpad, whose view smaller sensors share')
    line_pitch: float = constant(1.7, '1', 'prior',
                                 'letter heights between lines, each of which is a marker: RViz adds 10 mm between the lines of one marker')
    warning_size: tuple[int, int] = constant((36, 2), '1', 'limit',
                                             'letters in a line and lines of a warning; /diagnostics has the whole text')
    hand_warning_size: tuple[int, int] = constant((20, 1), '1', 'limit', 'the same for a sensor of a hand')
    hand_text_gap: float = constant(
        4.5, '1', 'prior',
        'letter heights from the edge of a sensor of a hand to the middle of its text, which has up to three lines')
    warning_height: tuple[float, float] = constant(
        (0.7, 1.2), '1', 'prior',
        'of a warning over the half width of the sensor and over its height, above the normal arrows')
    max_velocity_arrows: int = constant(200, '1', 'limit', 'slip velocities that are drawn')
    tones: int = constant(64, '1', 'numeric', 'steps of the colours of cells, finer than the eye resolves')
    min_value: float = constant(0.025, '1', 'limit', 'of the full value; a smaller one is drawn as untouched')
    layer: float = constant(1e-4, 'm', 'numeric', 'from the outlines down to the cells, and from the cells to the plate')


DRAWING = DrawingConstants()
