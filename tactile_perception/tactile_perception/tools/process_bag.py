# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag: computes from a recording of raw data all results that the live nodes would publish, and writes them to a new bag."""
from __future__ import annotations

import argparse
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tactile_driver.recordings.reader import LeftOut, RawMessage
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import COMPRESSED, BagWriter

from ..bags.stream import KEPT, Head, Skipped, Task, stream
from ..common.progress import ProgressLine
from ..errors import BadArgument, TactileError

FAILED, INCOMPLETE, SIGNALLED = 1, 3, 128
_BAGS = '.mcap', '.db3', '.zstd', '.yaml'  # endings of rosbag2's files
_CODES = f"""exit code: 0 complete; {FAILED} no result, with a one-line error; 2 wrong command line; {INCOMPLETE} complete except for
what is listed as left out; {SIGNALLED} + number of the signal that interrupted it, the bag written so far can be read"""


@dataclass
class Summary:
    """frames: raw messages read; written: results by topic; left_out: with reasons; seconds: duration; ended: True if interrupted."""

    frames: int = 0
    written: Counter = field(default_factory=Counter)
    left_out: LeftOut = field(default_factory=LeftOut)
    seconds: float = 0.0
    ended: bool = False


def process_bag(task: Task, target: Path, stopped: Callable[[], bool] = lambda: False) -> Summary:
    """Write the results for the task's bag to target, a new bag, with the stamps of the recording. An interrupted bag is readable.

    stopped: called after each frame; True ends the work. Raises TactileError for an unusable bag, OSError when target cannot be written.
    """
    if target.exists():
        raise BadArgument(f'bag {target}: exists already; choose another name or remove it')
    if task.source.is_file() and task.source.suffix not in _BAGS or task.source.is_dir() and not any(
            file.suffix in _BAGS for file in task.source.iterdir()):
        raise BadArgument(f'{task.source} is no bag. Make one of a video, images or an array\'s file: ros2 launch tactile_bringup '
                          f'SENSOR.launch.py source:=file path:={task.source} rate:=0 params:={task.params} record:=BAG')
    items = stream(task)
    head = next(items)
    summary, begin, progress = Summary(), time.monotonic(), ProgressLine('frames', head.frames)
    with _Output(target, head, summary) as output:
        for item in items:
            if isinstance(item, RawMessage):
                output.write(item)
            elif isinstance(item, Skipped):
                summary.left_out.add(item.topic, item.reason, item.stamp_ns)
            elif isinstance(item, LeftOut):
                summary.left_out.merge(item)
            else:
                summary.frames += 1
                progress.step()
                if stopped():
                    summary.ended = True
                    break
    progress.end()
    summary.seconds = time.monotonic() - begin
    return summary


class _Output:
    """The output bag and its counts in summary."""

    def __init__(self, target: Path, head: Head, summary: Summary):
        self._prefix, self._summary, self._unusable = head.prefix, summary, head.unusable
        self._writer = BagWriter(target, COMPRESSED)  # measured: points of a taxel array are 60 times as large as its images

    def __enter__(self) -> _Output:
        self._writer.__enter__()
        return self

    def __exit__(self, *exc) -> None:
        self._writer.__exit__(*exc)

    def write(self, message: RawMessage) -> None:
        """Write and count a message, or count it as left out."""
        topic = message.topic.removeprefix(self._prefix)
        if message.topic in self._unusable:
            self._summary.left_out.add(topic, self._unusable[message.topic], message.stamp_ns)
            return
        type_name, data = (message.type_name, message.data) if message.data else encode(message.message)
        self._writer.write(message.topic, type_name, message.stamp_ns, data)
        self._summary.written[topic] += 1


def report(summary: Summary, target: Path) -> str:
    """The summary as text."""
    results = ', '.join(f'{n} {topic}' for topic, n in sorted(summary.written.items()))
    lines = [f'{target}: {summary.frames} frames, {summary.seconds:.1f} s; {results or "no results"} written']
    lines += [f'  left out: {line}' for line in summary.left_out.lines()]
    return '\n'.join(lines)


class _Signals:
    """Stores the first SIGINT or SIGTERM in number, so that the work ends after the current frame; a second one ends it immediately."""

    def __init__(self):
        self.number = 0
        self._before: dict = {}

    def __enter__(self) -> _Signals:
        self._before = {number: signal.signal(number, self._on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_exc) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, number: int, _frame: object) -> None:
        self.number = number
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)


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
    task = Task(given.input, given.params, given.calibration, given.namespace)
    try:
        with _Signals() as signals:
            summary = process_bag(task, given.output, lambda: signals.number != 0)
    except (TactileError, OSError) as error:
        print(f'process_bag: {error}', file=sys.stderr)
        return FAILED
    print(report(summary, given.output))
    if summary.ended:
        print(f'process_bag: interrupted; {given.output} can be read', file=sys.stderr)
        return SIGNALLED + signals.number
    if not any(count for topic, count in summary.written.items() if topic not in KEPT):
        print('process_bag: no result could be computed', file=sys.stderr)
        return FAILED
    return INCOMPLETE if summary.left_out.total else 0


if __name__ == '__main__':
    sys.exit(main())
