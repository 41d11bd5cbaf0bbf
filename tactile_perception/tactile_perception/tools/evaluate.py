# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""evaluate: compares estimates with ground_truth/* of recordings: errors, states, missed and false touches, covariances, time.

A bag that process_bag wrote, or that launch recorded of a simulated sensor (record:=), has both. With --params the estimates are computed
from the raw data in the bag and timed.
"""
from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

from tactile_driver.errors import reports_errors

from ..core.errors import BadArgument
from ..evaluation.evaluation import Evaluation
from ..evaluation.plots import draw
from .judged_bag import JudgedBag
from .many import Task, WorkResult, add_arguments, are_many, check_arguments, recordings, run

_TITLE = '{:<50s}{:>12s}{:>12s}{:>12s}{:>12s}{:>9s}{:>10s}'


def text(report: dict) -> str:
    """The report as text for a terminal. report: Evaluation.summary() with the entries instants and times."""
    parts = [_counted(report), _errors(report['errors']),
             _states('dots: true state by row, estimate by column', report['dot_states']),
             _states('slip: true state by row, estimate by column', report['slip_states']),
             _covariance(report['covariance']), _times(report['times'])]
    return '\n\n'.join(part for part in parts if part)


def _counted(report: dict) -> str:
    frames, touches, instants = report['frames'], report['touches'], report['instants']
    after = touches['reported_after_ms']
    lines = [f'{instants["judged"]} instants compared; {instants["without an estimate"]} without an estimate, '
             f'{instants["without truth"]} without ground truth']
    if frames['judged']:
        lines += [
            f'touches:  {touches["there"]} true, {touches["never_reported"]} missed, {touches["made_up"]} false, '
            f'{touches["renumbered"]} changes of id; detection delay {_format(after["median"])} ms in the median, '
            f'{_format(after["worst"])} at most',
            f'frames:   {frames["touched"]} with contact: {frames["missed"]} missed, {frames["too_few"]} with too few touches, '
            f'{frames["too_many"]} with too many; {frames["untouched"]} without contact: {frames["false"]} false']
        flags = [f'{count} {name}' for name, count in report['flagged'].items() if count]
        lines += [f'flags:    {", ".join(flags)}'] if flags else []
    return '\n'.join(lines)


def _errors(errors: dict) -> str:
    lines = [_TITLE.format('error of', 'unit', 'median', '95 % within', 'worst', 'number', 'unknown')]
    for found in errors.values():
        numbers = [_format(found[name]) for name in ('median', 'within_95', 'worst')]
        lines.append(_TITLE.format(found['text'], found['unit'], *numbers, str(found['count']), str(found['not_reported'])))
    biased = [f'{found["text"]} {found["bias"]:+.3g} {found["unit"]}' for found in errors.values() if 'bias' in found]
    return '\n'.join(lines + ([f'bias (median of the signed error): {"; ".join(biased)}'] if biased else [])) if errors else ''


def _states(title: str, states: dict | None) -> str:
    if states is None:
        return ''
    lines = [f'{title}\n{"":<22s}' + ''.join(f'{name:>12s}' for name in [*states['reported'], 'F1'])]
    lines += [f'  {name:<20s}' + ''.join(f'{count:>12d}' for count in row) + f'{_format(states["f1"][name]):>12s}'
              for name, row in zip(states['true'], states['counts'])]
    return '\n'.join(lines)


def _covariance(found: dict) -> str:
    if not found['count']:
        return f'position covariance: unknown for {found["not_stated"]} touches' if found['not_stated'] else ''
    return (f'position covariance: normalised squared error {_format(found["mean"])} in the mean (consistent: 1), '
            f'{100 * found["within_95"]:.0f} % of {found["count"]} touches within its 95 %' +
            (f'; unknown for {found["not_stated"]}' if found['not_stated'] else ''))


def _times(times: dict) -> str:
    lines = [f'latency of {topic}: {_ms(found)}' for topic, found in times['latency_ms'].items()]
    lines += [f'time per frame, {stage}: {_ms(found)}, one thread' for stage, found in times['stages_ms'].items()]
    lines += [f'memory: {times["memory_mb"]:.0f} MB at most'] if math.isfinite(times['memory_mb']) else []
    lines += [f'left out: {line}' for line in times['left_out']]
    return '\n'.join(lines)


def _ms(found: dict) -> str:
    return f'{_format(found["median"])} ms in the median, {_format(found["within_95"])} in 95 %, {_format(found["worst"])} at most'


def _format(value: float) -> str:
    """The value with three digits; - when unknown."""
    if not math.isfinite(value):
        return '-'
    return f'{value:.0f}' if abs(value) >= 100 else f'{value:.3g}'


def plain(value):
    """The report as JSON can hold it: None for NaN and infinity."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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


@reports_errors('evaluate')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='evaluate', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, nargs='+', help='rosbag2 recordings with ground_truth/*, and estimates (or raw data, with '
                        '--params), or folders of them')
    parser.add_argument('--report', type=Path, help='folder for report.json, report.txt and plots; of several recordings, of theirs')
    parser.add_argument('--params', type=Path, help='parameter file of the sensor: compute the estimates from raw data and time them')
    parser.add_argument('--calibration', type=Path, help='calibration file, with --params; default: the one in the parameter file')
    parser.add_argument('--namespace', default='', help='namespace of the sensor; needed when the recording has several sensors')
    add_arguments(parser)
    given = parser.parse_args(args)
    check_arguments(given)
    if given.calibration and not given.params:
        raise BadArgument('--calibration needs --params: it is used when the estimates are computed from raw data')
    found = recordings(given.bag)
    if are_many(found, given.bag):
        given.params, given.calibration = (path and path.absolute() for path in (given.params, given.calibration))
        return run([Task(name, work, bag, given.report and given.report.absolute() / name, given) for name, bag in found.items()],
                   given.jobs, given.scheduler)
    bag = given.bag[0]
    evaluation, report = evaluate(JudgedBag(bag, given.namespace, given.params, given.calibration))
    print(text(report))
    if given.report:
        print('\n' + '\n'.join(map(str, write(evaluation, report, bag.resolve().name, given.report))))
    return 0


def work(bag: Path, target: Path | None, given: argparse.Namespace) -> WorkResult:
    """Evaluate one recording of many; its median errors."""
    evaluation, report = evaluate(JudgedBag(bag, given.namespace, given.params, given.calibration))
    if target:
        write(evaluation, report, bag.name, target)
    medians = [f'{found["text"]} {_format(found["median"])} {found["unit"]}' for found in report['errors'].values()]
    return WorkResult(0, f'{report["instants"]["judged"]} instants; medians: {"; ".join(medians)}')
