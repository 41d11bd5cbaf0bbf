# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark command on its shortest part: tables, numbers, plot, and the comparison with an earlier run."""
import json

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
import run

FINGER = ['--quick', '--part', 'finger', '--bags']


def test_measure_then_compare(tmp_path, capsys):
    old = tmp_path / 'old/benchmark.json'
    assert run.main([*FINGER, str(tmp_path), '--out', str(old.parent)]) == 0
    assert '| psd_finger | map | - |' in (old.parent / 'benchmark.md').read_text() and (old.parent / 'benchmark.png').exists()
    kept = json.loads(old.read_text())
    assert kept['about']['quick'] and {entry['method'] for entry in kept['entries']} == {'map', 'paper'}
    assert all(len(entry['ms']) == len(entry['relative']) == 2 for entry in kept['entries'])
    for entry in kept['entries']:
        entry['relative'] = [1000.0 if entry['method'] == 'map' else 1e-6] * 2
        entry['errors']['normal'] = [value * (0.5 if entry['method'] == 'map' else 1.0) for value in entry['errors']['normal']]
    old.write_text(json.dumps(kept))
    capsys.readouterr()
    assert run.main([*FINGER, str(tmp_path), '--out', str(tmp_path / 'new'), '--compare', str(old)]) == 1
    worse = capsys.readouterr().out.partition('worse than before:')[2].strip().splitlines()
    assert len(worse) == 2 and worse[0].startswith('finger, psd_finger, map: normal ')
    assert worse[1].startswith('finger, psd_finger, paper: slower by ')


@pytest.mark.parametrize('text, message', [('{}', 'no result of this benchmark'), ('nothing', 'no result of this benchmark'),
                                           ('{"entries": [], "about": {"quick": false, "recorded": false}}', 'other options')])
def test_what_cannot_be_compared_is_said(tmp_path, text, message):
    (tmp_path / 'old.json').write_text(text)
    with pytest.raises(SystemExit, match=message):
        run.compared(tmp_path / 'old.json', [], {'quick': True, 'recorded': False}, [])


def test_the_yardstick_and_the_machine():
    assert 0 < run.yardstick() < 1000 and run.machine()['cores'] >= 1
