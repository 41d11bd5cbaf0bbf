# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An evaluation in words and as JSON."""
from __future__ import annotations

import math

_TITLE = '{:<50s}{:>12s}{:>12s}{:>12s}{:>12s}{:>9s}{:>10s}'


def text(report: dict) -> str:
    """The report, of Evaluation.summary() with 'instants' and 'times', as lines for a terminal."""
    parts = [_counted(report), _errors(report['errors']), _states('dots, true by told', report['dot_states']),
             _states('slip, true by told', report['slip_states']), _covariance(report['covariance']), _times(report['times'])]
    return '\n\n'.join(part for part in parts if part)


def _counted(report: dict) -> str:
    frames, touches, instants = report['frames'], report['touches'], report['instants']
    after = touches['told_after_ms']
    lines = [f'{instants["judged"]} instants judged; {instants["without an estimate"]} had no estimate, '
             f'{instants["without truth"]} no truth']
    if frames['judged']:
        lines += [
            f'touches:  {touches["there"]} there, {touches["never_told"]} never told, {touches["made_up"]} made up, '
            f'{touches["renumbered"]} times another number; told {_said(after["median"])} ms after they began '
            f'(worst {_said(after["worst"])})',
            f'frames:   {frames["touched"]} touched, {frames["missed"]} of them missed, {frames["too_few"]} with too few touches, '
            f'{frames["too_many"]} with too many; {frames["untouched"]} untouched, {frames["false"]} of them called touched']
        flags = [f'{count} {name}' for name, count in report['flagged'].items() if count]
        lines += [f'flags:    {", ".join(flags)}'] if flags else []
    return '\n'.join(lines)


def _errors(errors: dict) -> str:
    lines = [_TITLE.format('error of', 'unit', 'median', '95 % within', 'worst', 'number', 'not told')]
    for found in errors.values():
        numbers = [_said(found[name]) for name in ('median', 'within_95', 'worst')]
        lines.append(_TITLE.format(found['text'], found['unit'], *numbers, str(found['count']), str(found['not_told'])))
    biased = [f'{found["text"]} {found["bias"]:+.3g} {found["unit"]}' for found in errors.values() if 'bias' in found]
    return '\n'.join(lines + ([f'bias (median with its sign): {"; ".join(biased)}'] if biased else [])) if errors else ''


def _states(title: str, states: dict | None) -> str:
    if states is None:
        return ''
    lines = [f'{title:<22s}' + ''.join(f'{name:>12s}' for name in [*states['told'], 'F1'])]
    lines += [f'  {name:<20s}' + ''.join(f'{count:>12d}' for count in row) + f'{_said(states["f1"][name]):>12s}'
              for name, row in zip(states['true'], states['counts'])]
    return '\n'.join(lines)


def _covariance(found: dict) -> str:
    if not found['count']:
        return f'stated covariances: none for {found["not_stated"]} places' if found['not_stated'] else ''
    low, high = found['range_95']
    honest = ' to '.join(_said(value) for value in found['honest_range_95'])
    return (f'stated covariances: squared error over stated variance {_said(found["mean"])} in the mean (honest: 1), 95 % between '
            f'{_said(low)} and {_said(high)} (honest: {honest}); {100 * found["within_honest_range"]:.0f} % of {found["count"]} places '
            'in the honest range' + (f'; none stated for {found["not_stated"]}' if found['not_stated'] else ''))


def _times(times: dict) -> str:
    lines = [f'latency of {topic}: {_ms(found)}' for topic, found in times['latency_ms'].items()]
    lines += [f'time a frame, {stage}: {_ms(found)} of one thread' for stage, found in times['stages_ms'].items()]
    lines += [f'memory: {times["memory_mb"]:.0f} MB at the most'] if math.isfinite(times['memory_mb']) else []
    lines += [f'refused {count} times: {reason}' for reason, count in times['refused'].items()]
    return '\n'.join(lines)


def _ms(found: dict) -> str:
    return f'{_said(found["median"])} ms in the median, {_said(found["within_95"])} in 95 %, {_said(found["worst"])} at the most'


def _said(value: float) -> str:
    """Three figures; a dash for what is not known."""
    if not math.isfinite(value):
        return '-'
    return f'{value:.0f}' if abs(value) >= 100 else f'{value:.3g}'


def plain(value):
    """A report as JSON can hold it: None for numbers that are none."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
