# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-validation residuals of a calibration: outliers, a plot over the surface of the sensor, and the lines of the report."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.calibration_file import CalibrationFile, write_calibration
from .constants import COMMON
from .statistics import robust_sigma


@dataclass(frozen=True)
class Residuals:
    """Errors of one quantity.

    name, unit: for display; value: (N,) in that unit, NaN when unknown; position: (N, 2) along axes (two names with units); when: names
    (N,) of presses by recording and time.
    """

    name: str
    unit: str
    value: np.ndarray
    position: np.ndarray
    axes: tuple[str, str]
    when: Sequence[str]


def outliers(found: Sequence[Residuals]) -> list[str]:
    """One line per press whose error is an outlier, largest first, at most COMMON.max_lines per quantity."""
    lines = []
    for residuals in found:
        size = np.abs(np.asarray(residuals.value, float))
        known = np.flatnonzero(np.isfinite(size))
        if len(known) < COMMON.min_presses:
            continue
        middle = float(np.median(size[known]))
        limit = middle + COMMON.outlier_sigmas * float(robust_sigma(size[known] - middle))
        beyond = [k for k in known[np.argsort(-size[known])] if size[k] > limit]
        lines += [f'{residuals.when[k]}: {residuals.name} error {size[k]:.3g} {residuals.unit}, the median is {middle:.2g} {residuals.unit}'
                  for k in beyond[:COMMON.max_lines]]
    return lines


def draw_residuals(path: Path, title: str, found: Sequence[Residuals]) -> None:
    """Write a PNG with one panel per quantity: a disc at each press, coloured by its error. Raises OSError."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, len(found), figsize=(5.2 * len(found), 4.6), squeeze=False, layout='constrained')
    for panel, residuals in zip(panels[0], found):
        value, position = np.asarray(residuals.value, float), np.asarray(residuals.position, float)
        known = np.argsort(np.abs(value))[:np.isfinite(value).sum()]  # of several presses at one position the largest error is on top
        largest = max(float(np.abs(value[known]).max(initial=0.0)), 1e-12)
        middle = np.median(np.abs(value[known])) if len(known) else np.nan
        drawn = panel.scatter(*position[known].T, c=value[known], s=36, edgecolors='black', linewidths=0.4, cmap='coolwarm', vmin=-largest,
                              vmax=largest)
        figure.colorbar(drawn, ax=panel, label=f'{residuals.name} ({residuals.unit})')
        panel.set_title(f'{residuals.name}: median {middle:.2g}, largest {largest:.2g} {residuals.unit}', fontsize='small')
        panel.set(xlabel=residuals.axes[0], ylabel=residuals.axes[1])
    figure.suptitle(title)
    try:
        figure.savefig(path, dpi=90)
    finally:
        pyplot.close(figure)


def write_and_report(output: Path, content: CalibrationFile, found: Sequence[Residuals], lines: Sequence[str],
                     also: Sequence[Residuals] = ()) -> str:
    """Write a calibration with the outliers of the residuals found, and beside it a plot of these and of `also`.

    Returns the report: lines, what was left out, and the paths. Raises BadCalibration or OSError as write_calibration does.
    """
    content.outliers = outliers(found)
    write_calibration(output, content)
    return '\n'.join([*lines, *(f'left out: {line}' for line in content.left_out), f'written: {output}',
                      *report_residuals([*found, *also], content.outliers, output, content.sensor)])


def report_residuals(found: Sequence[Residuals], standing_out: Sequence[str], output: Path, sensor: str) -> list[str]:
    """Plot the residuals beside the calibration file output; lines that name the plot and the outliers (standing_out)."""
    picture = output.with_name(output.stem + '_residuals.png')
    try:
        draw_residuals(picture, f'{sensor}: errors at held-out presses', found)
        drawn = f'plot of the errors: {picture}'
    except OSError as error:
        drawn = f'the plot of the errors was not written: {error}'
    return [*(f'outlier: {line}' for line in standing_out), drawn]
