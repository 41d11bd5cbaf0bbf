# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The command evaluate: a table, JSON and pictures of a recording, or one line that says why not."""
import json

import pytest
from tactile_perception.tools import evaluate as module, process_bag


@pytest.mark.full
def test_a_processed_bag_is_judged_by_the_truth_it_carries_as_if_computed_here(pressed_bag, tmp_path, capsys):
    assert process_bag.main([str(pressed_bag), str(tmp_path / 'out'), '--params', f'{pressed_bag}.yaml']) == 0
    assert module.main([str(tmp_path / 'out'), '--report', str(tmp_path / 'report')]) == 0
    out = capsys.readouterr().out
    assert '14 instants compared' in out and 'place of the touch' in out and 'states.png' in out
    report = json.loads((tmp_path / 'report/report.json').read_text())
    assert report['frames']['false'] == 0 and report['touches']['there'] == 1
    assert report['errors']['place']['median'] < 0.4 and report['errors']['depth']['median'] < 0.3
    assert report['errors']['region_overlap']['median'] > 0.85 and report['dot_states']['f1']['untouched'] > 0.97
    assert sum(map(sum, report['dot_states']['counts'])) == 14 * 529
    assert report['times']['stages_ms'] == report['times']['latency_ms'] == {}
    assert {path.name for path in (tmp_path / 'report').iterdir()} == {
        'report.json', 'report.txt', 'errors_over_time.png', 'errors_over_surface.png', 'states.png'}
    assert module.main([str(pressed_bag), '--params', f'{pressed_bag}.yaml', '--report', str(tmp_path / 'anew')]) == 0
    anew = json.loads((tmp_path / 'anew/report.json').read_text())
    assert anew.pop('times')['stages_ms']['all']['median'] > 0
    report.pop('times')
    assert anew == report


@pytest.mark.parametrize('arguments, message', [
    (['none'], 'no such file'), (['disc'], 'no estimates'), (['disc', '--namespace', 'elsewhere'], 'no /elsewhere/'),
    (['disc', '--calibration', 'x.yaml'], 'needs --params')])
def test_what_cannot_be_evaluated_is_said_in_one_line(pressed_bag, capsys, arguments, message):
    assert module.main([str(pressed_bag.parent / arguments[0]), *arguments[1:]]) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith('evaluate: ') and message in lines[0]
