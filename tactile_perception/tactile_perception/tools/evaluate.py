# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""evaluate: compares estimates with ground_truth/* of one recording: errors, states, missed and false touches, covariances, time.

A bag that process_bag wrote, or that launch recorded of a simulated sensor (record:=), has both. With --params the estimates are computed
from the raw data in the bag and timed.
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
    """Evaluate a recording; the report is a dictionary. Raises TactileError, BadArgument when no instant can be compared."""
    evaluation, judged = Evaluation(), 0
    for stamp, reported, true in bag.instants():
        evaluation.add(stamp, reported, true)
        judged += 1
    if not judged:
        raise BadArgument('no instant has both an estimate and ground truth; check the stamps of ground_truth/*')
    unmatched = {name: bag.unmatched[name] for name in ('without an estimate', 'without truth')}
    return evaluation, {'instants': {'judged': judged, **unmatched}, **evaluation.summary(), 'times': bag.times()}


def write(evaluation: Evaluation, report: dict, name: str, folder: Path) -> list[Path]:
    """Write report.json, report.txt and the plots to a folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'report.json').write_text(json.dumps(plain(report), indent=1) + '\n')
    (folder / 'report.txt').write_text(f'{name}\n\n{text(report)}\n')
    return [folder / 'report.json', folder / 'report.txt', *draw(evaluation, name, folder)]


@tells_errors('evaluate')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='evaluate', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, help='rosbag2 recording with ground_truth/*, and estimates (or raw data, with --params)')
    parser.add_argument('--report', type=Path, help='folder for report.json, report.txt and plots')
    parser.add_argument('--params', type=Path, help='parameter file of the sensor: compute the estimates from raw data and time them')
    parser.add_argument('--calibration', type=Path, help='calibration file, with --params; default: the one in the parameter file')
    parser.add_argument('--namespace', default='', help='namespace of the sensor; needed when the recording has several sensors')
    given = parser.parse_args(args)
    if given.calibration and not given.params:
        raise BadArgument('--calibration needs --params: it is used when the estimates are computed from raw data')
    evaluation, report = evaluate(JudgedBag(given.bag, given.namespace, given.params, given.calibration))
    print(text(report))
    if given.report:
        print('\n' + '\n'.join(map(str, write(evaluation, report, given.bag.resolve().name, given.report))))
    return 0


if __name__ == '__main__':
    sys.exit(main())
