# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far the work is comes back as it was noted; another task, or a broken note, is refused."""
import pytest
from tactile_perception.errors import BadArgument, BadRecording
from tactile_perception.offline.part_writer import UNFINISHED
from tactile_perception.offline.resume import Position, fingerprint, read_position, write_position
from tactile_perception.offline.stream import Checkpoint, Task

POSITION = Position(Checkpoint(7, (b'one\0', b'two')), {'files': [1]}, 5, {'dots': 4}, [['dots', 'late', 3, 1]])


def test_a_position_comes_back(tmp_path):
    (tmp_path / UNFINISHED).mkdir()
    write_position(tmp_path, 'mark', POSITION)
    assert read_position(tmp_path, 'mark') == POSITION
    with pytest.raises(BadArgument, match='by another version'):
        read_position(tmp_path, 'other')
    with pytest.raises(BadArgument, match='no output that was interrupted'):
        read_position(tmp_path / UNFINISHED, 'mark')
    (tmp_path / UNFINISHED / 'resume.json').write_text('{"fingerprint": "mark"}')
    with pytest.raises(BadRecording, match='begin anew'):
        read_position(tmp_path, 'mark')


def test_a_task_is_told_from_others_by_all_that_it_reads(tmp_path):
    params, calibration, bag = tmp_path / 'p.yaml', tmp_path / 'c.yaml', tmp_path / 'bag'
    bag.mkdir()
    named = f'/**:\n  ros__parameters:\n    calibration: {calibration}\n'
    marks = []
    for change in (lambda: None, lambda: params.write_text(named + '    rows: 5\n'), lambda: calibration.write_text('x'),
                   lambda: (bag / 'bag_0.mcap').write_bytes(b'xyz')):
        if not marks:
            params.write_text(named)
        change()
        marks.append(fingerprint(Task(bag, params)))
        assert marks[-1] == fingerprint(Task(bag, params))
    assert len({*marks, fingerprint(Task(bag, params, namespace='a'))}) == 5
