# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag: every estimate that the live nodes would publish, for each raw message of a recording, as fast as it can be computed."""
from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ..errors import BadArgument, TactileError
from ..nodes.serialization import MessageCodec
from .ahead import ahead
from .bags import RawMessage
from .definitions import known_as
from .left_out import LeftOut
from .part_writer import UNFINISHED, PartWriter
from .progress import ProgressLine
from .resume import Position, fingerprint, read_position, write_position
from .stream import KEPT, Checkpoint, FrameDone, Head, Item, Skipped, Task, computed, stream

FAILED, INCOMPLETE, SIGNALLED = 1, 3, 128
_SMALL = 200_000_000  # bytes
_CODES = f"""exit code: 0 all was done; {FAILED} nothing could be done, a line says why; 2 the command line is wrong; {INCOMPLETE} done,
but something was left out, which is listed; {SIGNALLED} + number of the signal that ended it, what is written can be read, --resume goes
on"""


@dataclass
class Summary:
    """What was done: raw messages read, results written by topic, what was left out, s that it took, whether it was ended before."""

    frames: int = 0
    written: Counter = field(default_factory=Counter)
    left_out: LeftOut = field(default_factory=LeftOut)
    seconds: float = 0.0
    ended: bool = False


def process_bag(task: Task, target: Path, jobs: int = 1, resume: bool = False, stopped: Callable[[], bool] = lambda: False) -> Summary:
    """Write the estimates for the task's bag to target, a new bag, or with resume one that was interrupted; stamps are the recording's.

    jobs: processes, of which two share the stages of a sensor that has several; stopped: asked after each frame whether to end; the same
    bytes in any case. Raises TactileError for a bag that cannot be used, OSError where target cannot be written.
    """
    if target.exists() and not resume:
        raise BadArgument(f'bag {target}: exists already; choose another name or remove it')
    mark = fingerprint(task)
    position = read_position(target, mark) if resume else Position()
    items = _items(task, position.checkpoint, jobs)
    output = _Output(target, mark, position, next(items))
    begin = time.monotonic()
    for item in items:
        output.take(item)
        if isinstance(item, FrameDone) and stopped():
            output.summary.ended = True
            break
    items.close()
    output.close()
    output.summary.seconds = time.monotonic() - begin
    return output.summary


def _items(task: Task, begin: Checkpoint, jobs: int) -> Iterator[Item]:
    """The stream through all stages, the first of several in a process of its own where there are to be two."""
    replay = task.replay()
    count = len(replay.stages)
    if min(jobs, count) < 2:
        yield from stream(task, begin, count)
        return
    items, codec = ahead(partial(stream, task, begin, 1)), MessageCodec()
    head = next(items)
    yield head
    for number in range(1, count):
        items = computed(items, replay, number, begin, head, codec)
    yield from items


class _Output:
    """The bag that is written, and what is told of it; position: from where on."""

    def __init__(self, target: Path, mark: str, position: Position, head: Head):
        self._target, self._mark, self._prefix = target, mark, head.prefix
        self.summary = Summary(position.frames, Counter(position.written), LeftOut.from_list(position.left_out))
        self._unknown: dict[str, str] = {}
        self._writer = PartWriter(target, self._store(head.definitions), position.metadata)
        self._before = position.frames
        self._progress = ProgressLine('frames', head.frames, position.frames)
        write_position(target, mark, position)

    def _store(self, definitions: dict[str, str]):
        """Message definitions: our own, and the recording's for what we have none for."""
        store = MessageCodec().store
        for kind, text in definitions.items():
            reason = known_as(store, kind, text)
            if reason:
                self._unknown[kind] = reason
        return store

    def take(self, item: Item) -> None:
        """Write or count an item."""
        if isinstance(item, RawMessage):
            self._write(item)
        elif isinstance(item, FrameDone):
            self.summary.frames += 1
            self._progress.step()
        elif isinstance(item, Skipped):
            self.summary.left_out.add(item.topic, item.reason, item.stamp_ns)
        elif isinstance(item, LeftOut):
            self.summary.left_out.merge(item)
        elif isinstance(item, Checkpoint):
            self._writer.end_part()
            done = self.summary
            write_position(self._target, self._mark,
                           Position(item, self._writer.metadata, done.frames, dict(done.written), done.left_out.to_list()))

    def _write(self, message: RawMessage) -> None:
        topic = message.topic.removeprefix(self._prefix)
        if message.type_name in self._unknown:
            self.summary.left_out.add(topic, self._unknown[message.type_name], message.stamp_ns)
            return
        self._writer.write(*message[:4])
        self.summary.written[topic] += 1

    def close(self) -> None:
        """End the last part; what is there to go on from goes once all is done."""
        self._progress.end()
        self._writer.end_part()
        if not self.summary.ended:
            shutil.rmtree(self._target / UNFINISHED)


def report(summary: Summary, target: Path) -> str:
    """The summary in words."""
    results = ', '.join(f'{n} {topic}' for topic, n in sorted(summary.written.items()))
    lines = [f'{target}: {summary.frames} frames, {summary.seconds:.1f} s; {results or "nothing"} written']
    lines += [f'  left out: {line}' for line in summary.left_out.lines()]
    return '\n'.join(lines)


class _Signals:
    """While this lasts, SIGINT and SIGTERM are noted in number, for the work to end after the present frame; the same again ends it at
    once."""

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


def usual_jobs(source: Path) -> int:
    """How many processes a recording is worth: starting another one takes as long as some hundred images."""
    size = sum(file.stat().st_size for file in (source, *source.glob('*')) if file.is_file())
    return 2 if size > _SMALL and len(os.sched_getaffinity(0)) > 1 else 1


def main(args: list[str] | None = None) -> int:
    """The command process_bag; its exit codes are told by --help."""
    parser = argparse.ArgumentParser(prog='process_bag', description=__doc__, epilog=_CODES)
    parser.add_argument('input', type=Path, help='rosbag2 recording (MCAP or sqlite3, compressed or not); damaged ones as far as they go')
    parser.add_argument('output', type=Path, help='new rosbag2 folder (MCAP) for the estimates')
    parser.add_argument('--params', type=Path, required=True, help='parameter file of the sensor, as the launch file takes it')
    parser.add_argument('--calibration', type=Path, help='calibration file; without it the one named in the parameters')
    parser.add_argument('--namespace', default='', help='of the sensor, where the recording holds several')
    parser.add_argument('--jobs', type=int, choices=(1, 2),
                        help='processes: with 2 the dots of the next images are found while the contact of one is worked out (sensors '
                        'without dots take 1); without it 2 where there are two cores and the recording is not small')
    parser.add_argument('--resume', action='store_true', help='go on with an output that was interrupted')
    given = parser.parse_args(args)
    task = Task(given.input, given.params, given.calibration, given.namespace)
    try:
        with _Signals() as signals:
            summary = process_bag(task, given.output, given.jobs or usual_jobs(given.input), given.resume, lambda: signals.number != 0)
    except (TactileError, OSError) as error:
        print(f'process_bag: {error}', file=sys.stderr)
        return FAILED
    print(report(summary, given.output))
    if summary.ended:
        print(f'process_bag: interrupted; {given.output} can be read, and --resume goes on', file=sys.stderr)
        return SIGNALLED + signals.number
    if not any(count for topic, count in summary.written.items() if topic not in KEPT):
        print('process_bag: nothing could be estimated', file=sys.stderr)
        return FAILED
    return INCOMPLETE if summary.left_out.total else 0


if __name__ == '__main__':
    sys.exit(main())
