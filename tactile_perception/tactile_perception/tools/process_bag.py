# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag: computes from a recording of raw data all results that the live nodes would publish, and writes them to a new bag."""
from __future__ import annotations

import argparse
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import COMPRESSED, BagWriter

from ..bags.replay import KEPT, Replay
from ..common.progress import progress
from ..errors import BadArgument, TactileError

FAILED, INCOMPLETE, SIGNALLED = 1, 3, 128
_BAGS = '.mcap', '.db3', '.zstd', '.yaml'  # endings of rosbag2's files
_CODES = f"""exit code: 0 complete; {FAILED} no result, with a one-line error; 2 wrong command line; {INCOMPLETE} complete except for
what is listed as left out; {SIGNALLED} + number of the signal that interrupted it, the bag written so far can be read"""


def process_bag(replay: Replay, target: Path, stopped: Callable[[], bool] = lambda: False) -> Counter:
    """Write what comes of a recording to target, a new bag, with the stamps of the recording; number of messages by topic.

    stopped: called after each message of the recording; True ends the work. An interrupted bag is readable. Raises TactileError for an
    existing target, OSError when it cannot be written.
    """
    written = Counter()
    with BagWriter(target, COMPRESSED) as writer:  # measured: points of a taxel array are 60 times as large as its images
        for messages in progress(replay, 'messages'):
            for message in messages:
                type_name, data = (message.type_name, message.data) if message.data else encode(message.message)
                writer.write(message.topic, type_name, message.stamp_ns, data)
                written[message.topic.removeprefix(replay.prefix)] += 1
            if stopped():
                break
    return written


@contextmanager
def _signals() -> Iterator[list[int]]:
    """Context that yields a list, which takes the number of the first SIGINT or SIGTERM, so that the work ends after the current message;
    a second one ends it immediately."""
    taken = []

    def take(number: int, _frame: object) -> None:
        taken.append(number)
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    before = {number: signal.signal(number, take) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield taken
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _check_source(source: Path, params: Path) -> None:
    """Raise BadArgument for what is no bag."""
    if source.is_file() and source.suffix not in _BAGS or source.is_dir() and not any(file.suffix in _BAGS for file in source.iterdir()):
        raise BadArgument(f'{source} is no bag. Make one of a video, images or an array\'s file: ros2 launch tactile_bringup '
                          f'SENSOR.launch.py source:=file path:={source} rate:=0 params:={params} record:=BAG')


def main(args: list[str] | None = None) -> int:
    """Run the command; --help lists the exit codes."""
    parser = argparse.ArgumentParser(prog='process_bag', description=__doc__, epilog=_CODES)
    parser.add_argument('input', type=Path, help='rosbag2 recording (MCAP or sqlite3, compressed or not); an unfinished one is read as far '
                        'as it goes')
    parser.add_argument('output', type=Path, help='new rosbag2 folder (MCAP) for the results')
    parser.add_argument('--params', type=Path, required=True, help='parameter file of the sensor, as the launch file takes it')
    parser.add_argument('--calibration', type=Path, help='calibration file; default: the one in the parameter file')
    parser.add_argument('--namespace', default='', help='namespace of the sensor; needed when the recording has several sensors')
    given = parser.parse_args(args)
    try:
        _check_source(given.input, given.params)
        begin, replay = time.monotonic(), Replay(given.input, given.params, given.calibration, given.namespace)
        with _signals() as signals:
            written = process_bag(replay, given.output, lambda: bool(signals))
    except (TactileError, OSError) as error:
        print(f'process_bag: {error}', file=sys.stderr)
        return FAILED
    results = ', '.join(f'{n} {topic}' for topic, n in sorted(written.items())) or 'no results'
    print(f'{given.output}: {replay.done} frames, {time.monotonic() - begin:.1f} s; {results} written')
    for line in replay.left_out.lines():
        print(f'  left out: {line}')
    if signals:
        print(f'process_bag: interrupted; {given.output} can be read', file=sys.stderr)
        return SIGNALLED + signals[0]
    if written.keys() <= set(KEPT):
        print('process_bag: no result could be computed', file=sys.stderr)
        return FAILED
    return INCOMPLETE if replay.left_out.total else 0
