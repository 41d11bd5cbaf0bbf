# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""evaluate: estimates against ground_truth/* of the same recording: errors, states, missed and false touches, honesty of covariances, time.

A bag that process_bag wrote, or that was recorded with record:= of a simulated sensor, has both. With --params the estimates are computed
here from the bag's raw data, and timed.
"""
from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from tactile_driver.command import tells_errors

from ..bags.judged_bag import JudgedBag
from ..errors import BadArgument
from ..evaluation.evaluation import Evaluation
from ..evaluation.plots import draw
from ..evaluation.report import plain, text


def evaluate(bag: JudgedBag) -> tuple[Evaluation, dict]:
    """The evaluation of all instants of a recording, and its report by name. Raises TactileError, BadArgument where nothing could be
    judged."""
    evaluation, judged = Evaluation(), 0
    for stamp, told, true in bag.instants():
        evaluation.add(stamp, told, true)
        judged += 1
    if not judged:
        raise BadArgument('no instant has both an estimate and truth: do the stamps of ground_truth/* belong to these estimates?')
    unmatched = {name: bag.unmatched[name] for name in ('without an estimate', 'without truth')}
    return evaluation, {'instants': {'judged': judged, **unmatched}, **evaluation.summary(), 'times': bag.times.summary()}


def write(evaluation: Evaluation, report: dict, name: str, folder: Path) -> list[Path]:
    """report.json, report.txt and the pictures in a folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'report.json').write_text(json.dumps(plain(report), indent=1) + '\n')
    (folder / 'report.txt').write_text(f'{name}\n\n{text(report)}\n')
    return [folder / 'report.json', folder / 'report.txt', *draw(evaluation, report['times'], name, folder)]


@tells_errors('evaluate')
def main(args: list[str] | None = None) -> int:
    """The command evaluate; exit code 0, or 1 with one line that says what is wrong."""
    parser = argparse.ArgumentParser(prog='evaluate', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, help='rosbag2 recording with ground_truth/*, and estimates (or raw data, with --params)')
    parser.add_argument('--report', type=Path, help='folder for report.json, report.txt and pictures')
    parser.add_argument('--params', type=Path, help='parameter file of the sensor: compute the estimates anew, and time them')
    parser.add_argument('--calibration', type=Path, help='calibration file, with --params; without it the one named in the parameters')
    parser.add_argument('--namespace', default='', help='of the sensor, where the recording holds several')
    given = parser.parse_args(args)
    if given.calibration and not given.params:
        raise BadArgument('--calibration is for estimates that are computed anew: name --params too')
    evaluation, report = evaluate(JudgedBag(given.bag, given.namespace, given.params, given.calibration))
    print(text(report))
    if given.report:
        print('\n' + '\n'.join(map(str, write(evaluation, report, given.bag.resolve().name, given.report))))
    return 0


if __name__ == '__main__':
    sys.exit(main())
