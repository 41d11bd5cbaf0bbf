# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of simulated sensors that are common to all specimens."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class SimulationConstants:
    """Constants of simulated sensors that are common to all specimens."""

    friction_rounds: int = constant(3, '1', 'numeric',
                                    'in which pressure and friction are fitted to each other; more change forces by 0.2 %')
    sticking_rounds: int = constant(8, '1', 'numeric', 'in which sticking is decided; more change forces by 0.2 %')
    mesh_radius: float = constant(9.0, 'thickness', 'numeric', 'of the meshed disc of the layer, whose border is held')
    element_growth: float = constant(
        1.14, '1', 'numeric',
        'ratio of neighbouring elements away from the load; half of it changes displacements by less than 0.3 %')
    max_element: float = constant(0.25, 'thickness', 'numeric', 'size of an element; half of it changes displacements by less than 0.3 %')
    patches: int = constant(4, '1', 'numeric', 'parts of a taxel over which friction varies independently')
    min_spread: float = constant(1e-9, 'm', 'numeric', 'against a division by zero')
    step_rounding: float = constant(1e-6, 'step', 'numeric', 'the times of two frames are rounded, which must not add a step')
    cover_radius: float = constant(0.016, 'm', 'physical', 'outer radius of the finger')
    distortion_waves: int = constant(8, '1', 'numeric', 'waves in the distortion of the fibre plate')
    cell_parts: int = constant(4, '1', 'numeric', 'subdivisions of a cell of the skin, along each side')
    max_contact_gap: float = constant(0.0237, 'spacing', 'limit', 'largest gap between skin and tool that counts as contact')
    gap_scale: float = constant(0.0713, 'spacing', 'numeric', 'scale that makes the gap dimensionless')
    slip_speed: float = constant(0.3e-3, 'm/s', 'limit',
                                 'points that are slower relative to the tool stick; 10 um per frame at 30 frames/s')
    rotation_travel: float = constant(7.1, 'spacing', 'numeric',
                                      'travel of the surface of a tool per unit of the Frobenius norm of a change of rotation')
    stage_sigma: float = constant(1e-3, 'm', 'prior', 'of the tip of a stage around a marker, which is hidden by the opaque sheet')
    margin_cells: int = constant(3, 'cell', 'numeric', 'of the mechanics beyond the image')
    gel_dot_radius: float = constant(0.24e-3, 'm', 'physical', 'of a dot on a photometric gel')
    gel_dot_albedo: float = constant(0.3, '1', 'physical', 'share of the light that such a dot reflects')
    image_rounds: int = constant(
        3, '1', 'numeric',
        'of the fixed point that finds which point of the skin a pixel shows; a further one changes it by less than 0.01 px')
    drawn_cells: int = constant(48, '1', 'numeric', 'approximate number of cells along each side of the grid used for rendering')
    far: float = constant(1000.0, 'm', 'numeric', 'distance at which the nearest point of any tool is its lowest')
    bar_length: float = constant(0.024, 'm', 'physical', 'of the face of the held bar')
    bar_width: float = constant(0.010, 'm', 'physical', 'of the same face')
    step_s: float = constant(0.01, 's', 'numeric', 'step of the motion of an object, small against the pitch of the positions')


SIMULATION = SimulationConstants()
