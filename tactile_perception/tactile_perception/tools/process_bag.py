# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag: computes from recordings of raw data all results that the live nodes would publish, and writes them to new bags."""
from __future__ import annotations

import argparse
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tactile_driver.recordings.writer import COMPRESSED, BagWriter

from ..bags.replay import KEPT, Replay
from ..common.progress import progress
from ..core.errors import BadArgument, TactileError
from .many import FAILED, INCOMPLETE, Task, WorkResult, add_arguments, are_many, check_arguments, recordings, run

SIGNALLED = 128
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
                writer.write(message.topic, message.type_name, message.stamp_ns, message.data)
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
    """Raise BadArgument for a path that is not a bag."""
    if source.is_file() and source.suffix not in _BAGS or source.is_dir() and not any(file.suffix in _BAGS for file in source.iterdir()):
        raise BadArgument(f'{source} is not a bag. Make one of a video, images or an array\'s file: ros2 launch tactile_bringup '
                          f'SENSOR.launch.py source:=file path:={source} rate:=0 params:={params} record:=BAG')


def main(args: list[str] | None = None) -> int:
    """Run the command; --help lists the exit codes."""
    parser = argparse.ArgumentParser(prog='process_bag', description=__doc__, epilog=_CODES)
    parser.add_argument('input', type=Path, nargs='+', help='rosbag2 recordings (MCAP or sqlite3, compressed or not), or folders of them; '
                        'an unfinished one is read as far as it goes')
    parser.add_argument('output', type=Path, help='new rosbag2 folder (MCAP) for the results; of several recordings a folder for theirs')
    parser.add_argument('--params', type=Path, required=True, help='parameter file of the sensor, as the launch file takes it')
    parser.add_argument('--calibration', type=Path, help='calibration file; default: the one in the parameter file')
    parser.add_argument('--namespace', default='', help='namespace of the sensor; needed when the recording has several sensors')
    add_arguments(parser)
    given = parser.parse_intermixed_args(args)
    try:
        check_arguments(given)
        found = recordings(given.input)
        if are_many(found, given.input):
            given.params, given.calibration = (path and path.absolute() for path in (given.params, given.calibration))
            return run([Task(name, work, bag, given.output.absolute() / name, given) for name, bag in found.items()],
                       given.jobs, given.scheduler)
        with _signals() as signals:
            code, said = work(given.input[0], given.output, given, lambda: bool(signals))
    except (TactileError, OSError) as error:
        print(f'process_bag: {error}', file=sys.stderr)
        return FAILED
    if signals:
        print(f'{given.output}: {said}\nprocess_bag: interrupted; {given.output} can be read', file=sys.stderr)
        return SIGNALLED + signals[0]
    print(f'process_bag: {said}' if code == FAILED else f'{given.output}: {said}', file=sys.stderr if code == FAILED else sys.stdout)
    return code


def work(bag: Path, target: Path, given: argparse.Namespace, stopped: Callable[[], bool] = lambda: False) -> WorkResult:
    """Process one recording with the arguments of the command; the exit code and what to say."""
    _check_source(bag, given.params)
    begin, replay = time.monotonic(), Replay(bag, given.params, given.calibration, given.namespace)
    written = process_bag(replay, target, stopped)
    left_out = [f'  left out: {line}' for line in replay.left_out.lines()]
    if written.keys() <= set(KEPT):
        return WorkResult(FAILED, '\n'.join(['no result could be computed', *left_out]))
    results = ', '.join(f'{n} {topic}' for topic, n in sorted(written.items()))
    said = f'{replay.done} frames, {time.monotonic() - begin:.1f} s; {results} written'
    return WorkResult(INCOMPLETE if replay.left_out.total else 0, '\n'.join([said, *left_out]))
