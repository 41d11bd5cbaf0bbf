# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""export: writes recordings as a data set for learning: all topics on one clock, a row a step, with the age of each value.

    ros2 run tactile_bringup export BAG ... --to hdf5|zarr|lerobot OUT
"""
from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from tactile_driver.errors import BadArgument, BadRecording, reports_errors
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, unusable
from tactile_perception.tools.many import (
    FAILED,
    INCOMPLETE,
    INTERRUPTED,
    Task,
    WorkResult,
    add_arguments,
    are_many,
    check_arguments,
    recordings,
    run,
)

from .clock import HELD, NEAREST, Clock, Row
from .fields import Field, fields_of
from .store import Store, join
from .together import ATTRIBUTES, HandReader, joined, opened

#: Modules that a format needs.
_NEEDS = {'hdf5': ('h5py',), 'zarr': ('zarr',), 'lerobot': ('h5py', 'pyarrow')}
_NO_DATA = 'visualization_msgs/', 'diagnostic_msgs/', 'rcl_interfaces/', 'std_msgs/msg/String'
_DRAWN = '/image_annotated'


@reports_errors('export', OSError)
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, 3 where damaged messages were left out, or 1 with a one-line error and no output."""
    parser = argparse.ArgumentParser(prog='export', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, nargs='+', help='recordings, or folders of them; each recording is an episode; '
                        'those of one folder that were made at the same time, as by a hand, are one')
    parser.add_argument('out', type=Path, help='new file (hdf5) or folder')
    parser.add_argument('--to', required=True, choices=_NEEDS, help='format of the data set')
    parser.add_argument('--rate', type=float, default=30.0, help='rows per second (default: %(default)s)')
    parser.add_argument('--topics', nargs='+', default=[], help='topics to write; default: all of known type but drawings and texts')
    parser.add_argument('--sample', choices=(HELD, NEAREST), default=HELD, help='value of a step: the last one before it, or the nearest')
    parser.add_argument('--episodes', default='', help='topic (std_msgs/Bool) that is true while an episode lasts')
    parser.add_argument('--task', default='touch', help='lerobot: description of the task')
    add_arguments(parser)
    given = parser.parse_intermixed_args(args)
    _check(given)
    check_arguments(given)
    found = joined(recordings(given.bag))
    part = given.out.with_name(given.out.name + '.part')
    _remove(part)
    try:
        if are_many(found, given.bag):
            code = _export_many(found, given, part)
        else:
            code = _export_one(given, part)
        if part.exists():
            part.rename(given.out)
    finally:
        _remove(part)
    return code


def _export_one(given: argparse.Namespace, part: Path) -> int:
    store = part
    if given.to == 'lerobot':
        part.mkdir()
        store = part / 'rows.h5'
    code, text = work(given.bag[0], store, given)
    if given.to == 'lerobot':
        _as_lerobot([store], part, given)
        store.unlink()
    print(f'{given.out}: {text}')
    return code


def _export_many(found: Mapping[str, Path], given: argparse.Namespace, part: Path) -> int:
    """Export each recording into a store of its own beside the output, and join these. The stores remain when a recording fails."""
    stores = given.out.with_name(given.out.name + '.parts').absolute()
    options = stores / '.options.json'
    wanted = json.dumps({name: getattr(given, name) for name in ('to', 'rate', 'topics', 'sample', 'episodes')})
    if stores.exists() and options.read_text() != wanted:
        raise BadArgument(f'{stores} is of an export with other options: remove it, or choose another name than {given.out}')
    stores.mkdir(exist_ok=True)
    options.write_text(wanted)
    tasks = [Task(name, work, bag, stores / name, given) for name, bag in found.items()]
    code = run(tasks, given.jobs, given.scheduler)
    if code in (FAILED, INTERRUPTED):
        print(f'export: {given.out} is not written; the same command continues with what is in {stores}', file=sys.stderr)
        return code
    targets = [task.target for task in tasks]
    if given.to == 'lerobot':
        part.mkdir()
        _as_lerobot(targets, part, given)
    else:
        join(targets, part, given.to)
    _remove(stores)
    print(f'{given.out}: of {len(tasks)} recordings')
    return code


def _as_lerobot(stores: Sequence[Path], part: Path, given: argparse.Namespace) -> None:
    from .lerobot import write_lerobot
    write_lerobot(stores, part, int(given.rate), given.task)


def _check(given: argparse.Namespace) -> None:
    missing = [name for name in _NEEDS[given.to] if not find_spec(name)]
    if missing:
        raise BadArgument(f'--to {given.to} needs {" and ".join(missing)}: python3 -m pip install {" ".join(missing)}')
    if given.out.exists():
        raise BadArgument(f'{given.out} exists already: choose another name or remove it')
    if not 0.0 < given.rate < np.inf or given.to == 'lerobot' and given.rate != int(given.rate):
        raise BadArgument(f'--rate {given.rate:g}: must be above 0, and for lerobot a whole number')


def work(bag: Path, target: Path, given: argparse.Namespace) -> WorkResult:
    """Write the episodes of one recording to a new store, target, with the arguments of the command; how many, and what was left out."""
    last, columns, known = -1, None, {}
    with Store(target, 'zarr' if given.to == 'zarr' else 'hdf5') as store, opened(bag) as reader:
        topics, left_out = chosen_topics(reader, given.topics, given.episodes)
        clock = Clock(reader, {topic: _has_header(kind) for topic, kind in topics.items()}, given.rate, given.sample, given.episodes)
        about = {'bag': str(bag), 'rate': given.rate, 'sample': given.sample, **_said_once(reader)}
        for number, row in clock.rows():
            if number != last:
                if columns:
                    columns.close()
                begin, last = row.stamp_ns, number
                columns = store.episode(number, about | {'begin_ns': begin}, _attributes_of(row))
            columns.add(_columns_of(row, begin, known))
        columns.close()
        damaged = reader.left_out.lines()
    left_out += damaged
    return WorkResult(INCOMPLETE if damaged else 0, '\n'.join([f'{last + 1} episodes', *(f'  left out: {line}' for line in left_out)]))


def chosen_topics(reader: BagReader | HandReader, wanted: list[str], marks: str = '') -> tuple[dict[str, str], list[str]]:
    """Topic -> type of the columns, and what is left out.

    Raises BadRecording for a topic that is wanted and is not in the recording, or of unknown type.
    """
    problems = {topic: unusable(kind, reader.hashes.get(topic, '')) for topic, kind in reader.topics.items()}
    for topic in (*wanted, *filter(None, [marks])):
        if topic not in reader.topics:
            raise BadRecording(f'bag {reader.path}: no topic {topic}; it has {", ".join(sorted(reader.topics))}')
        if problems[topic]:
            raise BadRecording(f'bag {reader.path}: {topic}: {problems[topic]}')
    usual = [topic for topic, kind in reader.topics.items()
             if not topic.endswith((*ATTRIBUTES, _DRAWN)) and not kind.startswith(_NO_DATA) and topic != marks and reader.count({topic})]
    selected = {topic: reader.topics[topic] for topic in sorted(wanted or usual) if not problems[topic]}
    return selected, [f'{topic}: {problems[topic]}' for topic in wanted or usual if problems[topic]]


def _has_header(kind: str) -> bool:
    from rosidl_runtime_py.utilities import get_message
    return next(iter(get_message(kind).get_fields_and_field_types().values()), '') == 'std_msgs/Header'


def _said_once(reader: BagReader | HandReader) -> dict[str, str]:
    """Descriptions, frames and camera calibrations by topic, as YAML: of each topic the first message."""
    from rosidl_runtime_py.convert import message_to_yaml
    topics = {topic for topic in reader.topics if topic.endswith(ATTRIBUTES) and not unusable(reader.topics[topic], '')}
    said: dict[str, str] = {}
    for message in reader.messages(topics):
        if message.topic not in said:
            said[message.topic] = message_to_yaml(decode(message.data, message.type_name))
            if len(said) == len(topics):
                break
    return {'said once': json.dumps(said)} if said else {}


def _columns_of(row: Row, begin_ns: int, known: dict[str, tuple[object, dict[str, Field]]]) -> dict[str, Field]:
    """Columns of a row by name. known: topic -> message of the last row and its columns, which hold as long as it does."""
    columns = {'time': Field(np.float64(1e-9 * (row.stamp_ns - begin_ns)), note='s since begin_ns of the episode')}
    for topic, (stamp_ns, message) in row.messages.items():
        name = topic.strip('/')
        if known.get(topic, (None,))[0] is not message:
            fields = fields_of(decode(message.data, message.type_name))
            known[topic] = message, {f'{name}/{field}': values for field, values in fields.items()}
        columns[f'{name}/age'] = Field(np.float64(1e-9 * (row.stamp_ns - stamp_ns)), note='s from the stamp of the message to time')
        columns |= known[topic][1]
    return columns


def _attributes_of(row: Row) -> dict[str, dict]:
    """Attributes of the columns of each topic of a row, by the beginning of their names."""
    attributes = {}
    for topic, (_, message) in row.messages.items():
        decoded = decode(message.data, message.type_name)
        names = {'names': ', '.join(decoded.name)} if message.type_name == 'sensor_msgs/msg/JointState' else {}
        attributes[topic.strip('/')] = {
            'type': message.type_name, 'frame_id': decoded.header.frame_id if hasattr(decoded, 'header') else '', **names}
    return attributes


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
