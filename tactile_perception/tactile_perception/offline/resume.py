# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What process_bag leaves beside an unfinished output, so that the work can go on from the last whole part."""
from __future__ import annotations

import hashlib
import json
import os
from base64 import b64decode, b64encode
from dataclasses import dataclass, field
from pathlib import Path

from tactile_driver.nodes.parameters import Parameter

from ..errors import BadArgument, BadRecording
from ..pipeline.parameter_file import read_parameters
from .part_writer import UNFINISHED
from .stream import Checkpoint, Task

_FILE = 'resume.json'
_NODES = ('dot_tracker_node', 'psd_contact_node', 'taxel_contact_node', 'contact_point_node', 'contact_region_node')
_CALIBRATION = (Parameter('calibration', str, '', '', 'calibration file'),)


@dataclass
class Position:
    """How far the work is: the checkpoint, the parts of the output until then, frames done, results written by topic, what was left out."""

    checkpoint: Checkpoint = Checkpoint(0)
    metadata: dict = field(default_factory=dict)
    frames: int = 0
    written: dict[str, int] = field(default_factory=dict)
    left_out: list = field(default_factory=list)


def fingerprint(task: Task) -> str:
    """What tells a task, the files that it reads, and this software from others."""
    digest = hashlib.sha256(json.dumps([task.namespace, task.every]).encode())
    sources = Path(__file__).parents[1].rglob('*.py')
    named = {read_parameters(task.params, node, _CALIBRATION)['calibration'] for node in _NODES}
    files = [task.params, *([task.calibration] if task.calibration else []), *(Path(name) for name in sorted(named) if name)]
    for file in (*files, *sorted(sources)):
        digest.update(file.read_bytes() if file.is_file() else b'')
    for file in (task.source, *sorted(task.source.glob('*'))):
        digest.update(f'{file.name} {file.stat().st_size if file.is_file() else 0}'.encode())
    return digest.hexdigest()


def write_position(target: Path, mark: str, position: Position) -> None:
    """Note in the unfinished output target how far the task is, whole or not at all; mark: the task's fingerprint."""
    states = [b64encode(state).decode() for state in position.checkpoint.states]
    page = vars(position) | {'checkpoint': [position.checkpoint.read, states], 'fingerprint': mark}
    partial = target / UNFINISHED / (_FILE + '.partial')
    partial.write_text(json.dumps(page))
    os.replace(partial, partial.with_suffix(''))


def read_position(target: Path, mark: str) -> Position:
    """How far the task with that fingerprint was. Raises BadArgument where target is no unfinished output, or one of another task."""
    file = target / UNFINISHED / _FILE
    if not file.exists():
        raise BadArgument(f'{target}: is no output that was interrupted; leave out --resume, or name the one that was')
    try:
        page = json.loads(file.read_text())
        same = page.pop('fingerprint') == mark
        read, states = page.pop('checkpoint')
        position = Position(Checkpoint(read, tuple(map(b64decode, states))), **page)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadRecording(f'{file}: cannot be read ({error}); remove {target} and begin anew') from error
    if not same:
        raise BadArgument(f'{target}: was begun from another recording, with other parameters or calibration, or by another version of '
                          'this software; remove it and begin anew')
    return position
