# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs estimates with the ground truth of a recording; estimates are the recorded ones, or computed from raw data and timed."""
from __future__ import annotations

import math
import resource
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from tactile_driver.recordings.reader import BagReader, LeftOut, RawMessage
from tactile_driver.recordings.serialization import decode
from tactile_driver.stamp_gaps import SAME_CLOCK_S

from ..bags.replay import Replay
from ..bags.stamped import choose_prefix
from ..common.estimates import ContactEstimate
from ..common.messages import contacts_from_message, region_from_message, slip_from_message, wrench_from_message
from ..common.progress import progress
from ..core.errors import BadFrame, BadRecording
from ..evaluation.evaluation import Instant

TRUE = 'ground_truth/'
#: topic -> field of Instant, and the conversion of its message
_FIELDS = {'contacts': ('contacts', contacts_from_message), 'contact_region': ('region', region_from_message),
           'slip': ('slip', slip_from_message), 'wrench': ('wrench', wrench_from_message)}
_RAW = {'image_raw', 'left/image_raw', 'voltages', 'taxels'}
_BATCH_NS = 10_000_000_000  # of a recording, after which instants are judged: estimates of a batch earlier are not waited for
_LONGEST_NS = 60_000_000  # between two known stamps. Derived: a little more than the longest batch of psd_node


class JudgedBag:
    """A recording with ground_truth/*.

    params: parameter file of the sensor; with it, estimates are computed from raw data, with calibration or the file that params names.
    reported, true: topics of estimates and of ground truth. In the course of instants(): unmatched: counts of stamps with only one of the
    two; left_out: messages that could not be used; stages: s of thread time per frame, by stage, of computed estimates. Raises
    BadRecording for a bag without ground truth, without estimates, or with several sensors and no namespace; TactileError as process_bag
    does.
    """

    def __init__(self, bag: Path, namespace: str = '', params: Path | None = None, calibration: Path | None = None):
        self._bag, self.unmatched, self.left_out, self.stages, self._latencies = bag, Counter(), LeftOut(), {}, defaultdict(list)
        self._used = set[int]()  # stamps of the truth that belong to an estimate
        self._replay = Replay(bag, params, calibration, namespace, _FIELDS) if params else None
        if self._replay:
            topics, self.prefix, self.left_out, self.stages = (
                self._replay.topics, self._replay.prefix, self._replay.left_out, self._replay.stages)
        else:
            with BagReader(bag) as reader:
                topics = reader.topics
            self.prefix = _find_sensor(topics, namespace)
        mine = {topic.removeprefix(self.prefix) for topic in topics if topic.startswith(self.prefix)}
        self._live = bool(mine & _RAW) and not self._replay
        self.true = [name for name in _FIELDS if TRUE + name in mine]
        self.reported = [name for name in _FIELDS if name in (self._replay.outputs if self._replay else mine)]
        if not self.true:
            raise BadRecording(f'{bag}: no ground truth: {self.prefix}{TRUE}* are missing; record them, or choose another bag')
        if not self.reported:
            raise BadRecording(f'{bag}: no estimates ({", ".join(_FIELDS)}): compute them by process_bag, or give --params FILE '
                               '(and --calibration FILE)')

    def instants(self) -> Iterator[tuple[float, Instant, Instant]]:
        """Yield (stamp s, estimate, truth) of each stamp that has both, in order. Contacts of which nothing else is true are so between the
        stamps of their ground truth too: of a PSD finger each estimate carries the mean time of its samples."""
        reported, true, begin_ns, end = {}, {}, None, -math.inf
        for received_ns, topic, message in self._messages():
            begin_ns = received_ns if begin_ns is None else begin_ns
            if received_ns - begin_ns > _BATCH_NS:
                yield from self._judged(reported, true, end)
                begin_ns, end = received_ns, max((*reported, *true))
            name, stamp = topic.removeprefix(TRUE), _stamp_ns(message)
            part, read = _FIELDS[name]
            instant = (reported if name == topic else true).setdefault(stamp, Instant())
            try:
                setattr(instant, part, read(message))
            except BadFrame as error:
                self.left_out.add(topic, str(error), stamp)
        yield from self._judged(reported, true, math.inf)

    def _judged(self, reported: dict[int, Instant], true: dict[int, Instant], end: float) -> Iterator[tuple[float, Instant, Instant]]:
        """Yield as `instants` those with stamps up to `end`, and remove them; true ones remain for interpolation."""
        stamps = sorted(true) if self.true == ['contacts'] else []
        for stamp in sorted(stamp for stamp in reported if stamp <= end):
            found, known, index = reported.pop(stamp), true.get(stamp), bisect_left(stamps, stamp)
            if known is not None:
                self._used.add(stamp)
            elif 0 < index < len(stamps) and stamps[index] - stamps[index - 1] <= _LONGEST_NS:
                first, last = stamps[index - 1:index + 1]
                self._used |= {first, last}
                known = Instant(contacts=_between(true[first].contacts, true[last].contacts, (stamp - first) / (last - first)))
            if known is None:
                self.unmatched['without truth'] += 1
            else:
                yield 1e-9 * stamp, found, known
        for stamp in [stamp for stamp in true if stamp <= end - _LONGEST_NS]:
            del true[stamp]
            if stamp not in self._used:
                self.unmatched['without an estimate'] += 1
            self._used.discard(stamp)

    def _messages(self) -> Iterator[tuple[int, str, object]]:
        """Yield (time of recording, ns, topic, message) of the truth, and of the estimates, recorded or computed from raw data."""
        wanted = {self.prefix + name for name in (*self.reported, *(TRUE + name for name in self.true))}
        for raw in progress(chain.from_iterable(self._replay) if self._replay else self._recorded(wanted), 'messages'):
            name = raw.topic.removeprefix(self.prefix)
            if raw.topic not in wanted:
                continue
            try:
                message = raw.message or decode(raw.data, raw.type_name)
            except BadFrame as error:
                self.left_out.add(name, str(error), raw.stamp_ns)
                continue
            if self._live and not name.startswith(TRUE):
                self._latencies[name].append(1e-9 * (raw.stamp_ns - _stamp_ns(message)))
            yield raw.stamp_ns, name, message

    def _recorded(self, wanted: set[str]) -> Iterator[RawMessage]:
        with BagReader(self._bag) as reader:
            yield from reader.messages(wanted)

    def times(self) -> dict:
        """median, within_95 and worst, ms, of each stage of computed estimates, and of each latency from stamp to receipt of a bag recorded
        live; memory: MB, peak of the process; what was left out."""
        late = {topic: values for topic, values in self._latencies.items() if 0 < np.median(values) < SAME_CLOCK_S}
        return {'latency_ms': {topic: _spread(values) for topic, values in late.items()},
                'stages_ms': {stage: _spread(values) for stage, values in self.stages.items()},
                'memory_mb': resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 'left_out': self.left_out.lines()}


def _stamp_ns(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def _spread(seconds: list[float]) -> dict[str, float]:
    middle, most, worst = 1e3 * np.percentile(seconds, [50, 95, 100])
    return {'median': float(middle), 'within_95': float(most), 'worst': float(worst), 'count': len(seconds)}


def _between(before: list[ContactEstimate], after: list[ContactEstimate], part: float) -> list[ContactEstimate]:
    """Contacts at a fraction of the time from before to after: interpolated where the ids are the same, otherwise those before."""
    then = {contact.id: contact for contact in after}
    if {contact.id for contact in before} != set(then):
        return before
    found = []
    for contact in before:
        moved = {name: (1 - part) * getattr(contact, name) + part * getattr(then[contact.id], name)
                 for name in ('position', 'normal', 'depth', 'force')}
        length = np.linalg.norm(moved['normal'])
        found.append(replace(contact, **moved | {'normal': moved['normal'] / length if length > 0 else moved['normal']}))
    return found


def _find_sensor(topics: dict[str, str], namespace: str) -> str:
    """'/ns/' of the sensor with ground truth among topics. Raises BadRecording without one, and for several without a namespace."""
    found = {topic.partition(TRUE)[0] for topic in topics if '/' + TRUE in topic}
    if not found:
        raise BadRecording(f'no ground truth: the bag has no topic */{TRUE}*; record a simulated sensor, or what a stage or a '
                           'force/torque sensor reads')
    return choose_prefix(found, namespace, TRUE + '*')
