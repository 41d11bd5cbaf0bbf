# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the experiments: each has a function that draws it as its paper does."""
from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .constants import PAPERS

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

TRUTH, PUBLISHED, OURS = 'truth', 'its method', 'ours'
COLOURS = {TRUTH: 'silver', PUBLISHED: 'C1', OURS: 'C0'}


@dataclass(frozen=True)
class Picture:
    """A figure of a paper.

    name : of its file, behind the name of the paper.
    title : one sentence.
    draw : puts axes and content into the Figure that it is given. It is pickled, so it is a functools.partial of a function of a module.
    size : width and height, inches.
    """

    name: str
    title: str
    draw: Callable[[Figure], None]
    size: tuple[float, float] = (7.0, 4.5)

    def write(self, path: Path) -> None:
        """Write the figure as a PNG file."""
        from matplotlib.figure import Figure
        figure = Figure(figsize=self.size, layout='constrained')
        self.draw(figure)
        figure.suptitle(textwrap.fill(self.title, int(PAPERS.title_characters * self.size[0])), fontsize='medium')
        figure.savefig(path, dpi=90)


@dataclass(frozen=True)
class Curves:
    """Lines over one abscissa.

    ordinate, abscissa : names with unit.
    lines : name -> (x (N,), y (N,)).
    marker : of points; '' for lines.
    """

    ordinate: str
    abscissa: str
    lines: Mapping[str, tuple[np.ndarray, np.ndarray]]
    marker: str = ''


def draw_curves(panels: Sequence[Curves], figure: Figure) -> None:
    """A panel for each of panels, in two rows if more than PAPERS.max_panels, and a legend of all."""
    rows = 1 if len(panels) <= PAPERS.max_panels else 2
    axes = figure.subplots(rows, -(-len(panels) // rows), squeeze=False).ravel()
    for axis, curves in zip(axes, panels):
        for name, (x, y) in curves.lines.items():
            axis.plot(x, y, color=COLOURS.get(name), marker=curves.marker, linestyle='' if curves.marker else '-', markersize=4,
                      linewidth=2.5 if name == TRUTH else 1.0, label=name)
        axis.set(xlabel=curves.abscissa, ylabel=curves.ordinate)
    legend_of(figure, axes)


def legend_of(figure: Figure, axes: Sequence) -> Legend:
    """One legend below, of what the axes show."""
    known = {name: handle for axis in axes for handle, name in zip(*axis.get_legend_handles_labels())}
    return figure.legend(known.values(), known.keys(), loc='outside lower center', ncols=3)
