# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The papers' experiments, at a small size: tables are complete, both methods give numbers; wrong input is named."""
import numpy as np
import pytest
from tactile_bringup.papers import command
from tactile_bringup.papers.bench import Bench, Table, draw
from tactile_bringup.papers.others import NO_GAP

ALL = [(name, experiment) for name, experiments in command.EXPERIMENTS.items() for experiment in experiments]
QUICK = 'one_camera',


def marks(experiment):
    return pytest.mark.full if experiment.__name__ in QUICK else pytest.mark.slow


@pytest.mark.timeout(600)
@pytest.mark.parametrize('paper, experiment', [pytest.param(*one, id=one[1].__name__, marks=marks(one[1])) for one in ALL])
def test_an_experiment_has_finite_columns(tmp_path, paper, experiment):
    tables = list(experiment(Bench(tmp_path, short=True)))
    assert tables
    for table in tables:
        assert len(table.lines()) >= 5 + len(table.rows)
        of_random_print = 'random' in table.title  # no calibration file of it ships
        assert len(table.published) == len(table.ours) == len(table.rows)
        assert (np.isfinite(table.published) != (NO_GAP in table.note)).all(), table
        assert np.isfinite(table.ours).all() or of_random_print, table
        for curves in table.curves:
            assert len(curves.lines) >= 2 and all(len(x) == len(y) for x, y in curves.lines.values())
    draw(tables, tmp_path / 'paper.png')
    assert (tmp_path / 'paper.png').stat().st_size > 1000


def test_what_is_unknown_is_no_number_in_a_table():
    lines = Table('title', [('place', 'mm', '')], [np.nan], [1.0]).lines()
    assert '| place | mm | - | - | 1 |' in lines


def test_an_unknown_paper_is_named(capsys):
    with pytest.raises(SystemExit):
        command.main(['--paper', 'another'])
    assert "invalid choice: 'another'" in capsys.readouterr().err
