# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Many recordings: one task each, in processes of this machine or on a Dask cluster; one table of what came of them.

An output has its name only when it is complete, so that a command that is started again continues where it stopped.
"""
from __future__ import annotations

import argparse
import gc
import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import NamedTuple

from ..common.progress import progress
from ..core.errors import BadArgument, TactileError

FAILED, INCOMPLETE, INTERRUPTED = 1, 3, 130  # exit codes; 0 is complete
_UNFINISHED = '.unfinished_'
_STORAGE = '.mcap', '.db3', '.zstd'
_STATES = {0: 'done', INCOMPLETE: 'incomplete'}


class WorkResult(NamedTuple):
    """Result of `Task.work` for one recording. code: exit code; text: lines for the user."""

    code: int
    text: str


@dataclass(frozen=True)
class Task:
    """One recording.

    Parameters
    ----------
    name : str
        In the table.
    work : callable
        ``work(bag, target, given)`` writes target and returns WorkResult; a function of a module. TactileError and OSError are failures.
    bag : Path
        The recording.
    target : Path or None
        File or folder to write; None, nothing is written.
    given : argparse.Namespace
        The arguments of the command.
    """

    name: str
    work: Callable[[Path, Path | None, argparse.Namespace], WorkResult]
    bag: Path
    target: Path | None
    given: argparse.Namespace


class Outcome(NamedTuple):
    """A row of the table. state: done, incomplete, failed or 'done before'."""

    name: str
    state: str
    seconds: float
    text: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of all commands that take many recordings."""
    parser.add_argument('--jobs', type=int, default=1, metavar='N', help='recordings at a time (default: %(default)s)')
    parser.add_argument('--scheduler', default='', metavar='ADDRESS', help='Dask cluster that does the work, as tcp://HOST:8786')


def check_arguments(given: argparse.Namespace) -> None:
    """Raise BadArgument for a wrong number of jobs, and where Dask is needed and missing."""
    if given.jobs < 1:
        raise BadArgument(f'--jobs {given.jobs}: must be 1 or more')
    if given.scheduler and not find_spec('distributed'):
        raise BadArgument('--scheduler needs Dask: python3 -m pip install distributed')


def recordings(paths: Sequence[Path]) -> dict[str, Path]:
    """The recordings at paths and in the folders among them.

    Returns
    -------
    dict
        Name -> absolute path; the name of a recording in a folder is its path there.

    Raises
    ------
    BadArgument
        If a folder has no recordings, or two have one name.
    """
    found: dict[str, Path] = {}
    for path in paths:
        inside = _inside(path)
        if not inside:
            raise BadArgument(f'{path}: there is no recording in this folder')
        for bag in inside:
            name = bag.absolute().name if bag == path else str(bag.relative_to(path))
            if name in found:
                raise BadArgument(f'{bag} and {found[name]} have one name: rename one of them, or name the folder that holds both')
            found[name] = bag.absolute()
    return found


def are_many(found: dict[str, Path], paths: Sequence[Path]) -> bool:
    """Whether the recordings found at paths are not one that is named itself."""
    return [*found.values()] != [paths[0].absolute()]


def _inside(path: Path) -> list[Path]:
    if not path.is_dir() or is_recording(path) or not any(each.is_dir() for each in path.iterdir()):
        return [path]
    return sorted(Path(folder) for folder, _, _ in os.walk(path) if is_recording(Path(folder))
                  and not any(part.startswith('.') for part in Path(folder).relative_to(path).parts))


def is_recording(folder: Path) -> bool:
    """Whether a folder has files of rosbag2."""
    return any(file.name == 'metadata.yaml' or file.suffix in _STORAGE for file in folder.iterdir() if file.is_file())


def run(tasks: Sequence[Task], jobs: int, scheduler: str) -> int:
    """Do all tasks whose target is not there, and print the table.

    Parameters
    ----------
    tasks : sequence of Task
        The work.
    jobs : int
        Processes at a time.
    scheduler : str
        Address of a Dask scheduler, whose workers do the work instead; ``''``, none.

    Returns
    -------
    int
        Exit code: 0 for complete results, `INCOMPLETE` where something was left out, `FAILED` where a recording failed, `INTERRUPTED`.
    """
    outcomes = {task.name: Outcome(task.name, 'done before', 0.0, str(task.target))
                for task in tasks if task.target and task.target.exists()}
    left = [task for task in tasks if task.name not in outcomes]
    folders = {task.target.parent for task in left if task.target}
    for folder in folders:
        folder.mkdir(parents=True, exist_ok=True)
    try:
        for outcome in progress(_on_dask(left, scheduler) if scheduler else _here(left, jobs), f'of {len(left)} recordings'):
            outcomes[outcome.name] = outcome
    except KeyboardInterrupt:
        print(f'interrupted after {len(outcomes)} of {len(tasks)} recordings; the same command continues', file=sys.stderr)
        return INTERRUPTED
    finally:
        for path in [path for folder in folders for path in folder.glob(_UNFINISHED + '*')]:  # of workers that were killed
            shutil.rmtree(path, ignore_errors=True)
    rows = [outcomes[task.name] for task in tasks]
    print(table(rows))
    states = {row.state for row in rows}
    return FAILED if 'failed' in states else INCOMPLETE if 'incomplete' in states else 0


def table(rows: Sequence[Outcome]) -> str:
    """The rows as text, with a line of their numbers."""
    width = max(len('recording'), *(len(row.name) for row in rows))
    lines = [f'{"recording":<{width}s}  {"state":<12s}{"time":>8s}']
    for row in rows:
        took = f'{row.seconds:.1f} s' if row.seconds else ''
        lines += [f'{row.name:<{width}s}  {row.state:<12s}{took:>8s}  ' + '; '.join(map(str.strip, row.text.splitlines()))]
    counted = Counter(row.state for row in rows)
    return '\n'.join([*lines, f'{len(rows)} recordings: ' + ', '.join(f'{count} {state}' for state, count in sorted(counted.items()))])


def done(task: Task) -> Outcome:
    """Do one task. Its output is written in a folder beside the target, and gets its name when it is complete."""
    begin, code, text = time.monotonic(), FAILED, ''
    try:
        if task.target:
            with tempfile.TemporaryDirectory(prefix=_UNFINISHED, dir=task.target.parent, ignore_cleanup_errors=True) as folder:
                part = Path(folder, task.target.name)
                code, text = task.work(task.bag, part, task.given)
                if code in _STATES and not task.target.exists():  # a cluster may do a task twice, when it has lost a worker
                    part.rename(task.target)
        else:
            code, text = task.work(task.bag, None, task.given)
    except Exception as error:  # a fault that one recording shows costs no other one
        text = str(error) if isinstance(error, (TactileError, OSError)) else repr(error)
    return Outcome(task.name, _STATES.get(code, 'failed'), time.monotonic() - begin, text or 'no reason given')


def _here(tasks: Sequence[Task], jobs: int) -> Iterator[Outcome]:
    """Yield what comes of each task, done in a process of its own: one that dies takes no other with it. This process has no threads,
    which a fork would not copy."""
    context, waiting, running = get_context('fork'), iter(tasks), {}
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        while True:
            for task in islice(waiting, jobs - len(running)):
                receiver, sender = context.Pipe(duplex=False)
                process = context.Process(target=_answer, args=(task, sender))
                process.start()
                sender.close()
                running[receiver] = task, process
            if not running:
                return
            for receiver in wait(list(running)):
                task, process = running.pop(receiver)
                yield _received(task, receiver, process)
    finally:
        signal.signal(signal.SIGTERM, before)
        for _, process in running.values():
            process.terminate()
            process.join()


def _interrupt(*_args) -> None:
    raise KeyboardInterrupt


def _answer(task: Task, sender: Connection) -> None:
    gc.freeze()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    sys.stdout = sys.stderr = open(os.devnull, 'w')  # the table says what came of it
    sender.send(done(task))


def _received(task: Task, receiver: Connection, process) -> Outcome:
    with receiver, suppress(EOFError):
        return receiver.recv()
    process.join()
    return Outcome(task.name, 'failed', 0.0, f'its process ended with exit code {process.exitcode}')


def _on_dask(tasks: Sequence[Task], scheduler: str) -> Iterator[Outcome]:
    """Yield what comes of each task on a cluster, which gives the tasks of a lost worker to another one."""
    from distributed import Client, as_completed
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise BadArgument(f'--scheduler {scheduler}: no scheduler answers ({error}); start one by dask scheduler') from error
    with client:
        package = __package__.partition('.')[0]
        missing = [worker for worker, found in client.run(find_spec, package).items() if not found]  # they would never answer
        if missing:
            raise BadArgument(f'the workers {", ".join(missing)} cannot import {package}: source setup.bash before dask worker')
        futures = {client.submit(done, task, pure=False): task for task in tasks}
        for future in as_completed(futures):
            yield future.result() if future.status == 'finished' else Outcome(futures[future].name, 'failed', 0.0, repr(future.exception()))
