# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A picture of what a calibration gets wrong, over the sensor's surface."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .residuals import Residuals


def plot_path(calibration: Path) -> Path:
    """Where the picture of a calibration file is: beside it."""
    return calibration.with_name(calibration.stem + '_residuals.png')


def draw_residuals(path: Path, title: str, found: Sequence[Residuals]) -> None:
    """Write a PNG with a panel for each quantity: a disc at each press, coloured by its error. Raises OSError."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, len(found), figsize=(5.2 * len(found), 4.6), squeeze=False, layout='constrained')
    for panel, residuals in zip(panels[0], found):
        order = np.argsort(np.abs(residuals.value))  # of several presses at one place the worst is seen
        value, place = np.asarray(residuals.value, float)[order], np.asarray(residuals.place, float)[order]
        known = np.isfinite(value)
        signed = bool((value[known] < 0).any())
        most = max(float(np.abs(value[known]).max(initial=0.0)), 1e-12)
        drawn = panel.scatter(*place[known].T, c=value[known], s=36, edgecolors='black', linewidths=0.4,
                              cmap='coolwarm' if signed else 'viridis', vmin=-most if signed else 0.0, vmax=most)
        panel.scatter(*place[~known].T, marker='x', c='grey', s=24)
        figure.colorbar(drawn, ax=panel, label=f'{residuals.name} ({residuals.unit})')
        middle = np.median(np.abs(value[known])) if known.any() else np.nan
        panel.set_title(f'{residuals.name}: median {middle:.2g}, largest {most:.2g} {residuals.unit}', fontsize='small')
        panel.set(xlabel=residuals.axes[0], ylabel=residuals.axes[1])
        same = residuals.axes[0].split('(')[-1] == residuals.axes[1].split('(')[-1]
        panel.set_aspect('equal' if same else 'auto', adjustable='datalim')
    figure.suptitle(title)
    try:
        figure.savefig(path, dpi=90)
    finally:
        pyplot.close(figure)
