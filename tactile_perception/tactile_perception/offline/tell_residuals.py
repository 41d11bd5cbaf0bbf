# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What every calibration tells at its end: presses that stand out, and the picture of what is wrong where."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..calibration.residual_plot import draw_residuals, plot_path
from ..calibration.residuals import Residuals


def tell_residuals(found: Sequence[Residuals], standing_out: Sequence[str], output: Path, sensor: str) -> list[str]:
    """Draw the residuals beside the calibration file output; lines that tell of the picture and of what is standing out."""
    picture = plot_path(output)
    try:
        draw_residuals(picture, f'{sensor}: errors at presses held out', found)
        drawn = f'errors over the sensor: {picture}'
    except OSError as error:
        drawn = f'no picture of the errors: {error}'
    return [*(f'stands out: {line}' for line in standing_out), drawn]
