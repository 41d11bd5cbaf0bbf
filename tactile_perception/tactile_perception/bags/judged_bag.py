# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pairs estimates with the ground truth of a recording; estimates are the recorded ones, or computed from raw data and timed."""
from __future__ import annotations

import resource
from bisect import bisect_left, insort
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from tactile_driver.recordings.reader import BagReader, RawMessage
from tactile_driver.recordings.serialization import decode

from ..common.estimates import ContactEstimate
from ..common.progress import Progress
from ..errors import BadFrame, BadRecording
from ..evaluation.evaluation import Instant
from ..nodes.messages.estimates import contacts_from_message, region_from_message, slip_from_message, wrench_from_message
from .stamped import choose_prefix, find_prefix
from .stream import FrameDone, Skipped, Task, stream

TRUE = 'ground_truth/'
#: topic -> field of Instant, and the conversion of its message
_FIELDS = {'contacts': ('contacts', contacts_from_message), 'contact_region': ('region', region_from_message),
           'slip': ('slip', slip_from_message), 'wrench': ('wrench', wrench_from_message)}
_RAW = {'image_raw', 'left/image_raw', 'voltages'}
_MOST_WAITING = 1000  # chosen: stamps that wait for their remaining messages
_LONGEST_NS = 60_000_000  # between two known stamps. Derived: a little more than the longest batch of psd_node
_SAME_CLOCK_S = 60.0  # chosen: a longer latency means that the stamps come from another clock


@dataclass
class Times:
    """Times of one run.

    latencies: s from stamp to receipt, by topic, of a bag recorded live; stages: s of thread time per frame, by stage, for computed
    estimates; refused: number of frames by reason; memory: MB, peak of the process, for computed estimates, otherwise NaN.
    """

    latencies: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    stages: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    refused: Counter = field(default_factory=Counter)
    memory: float = np.nan

    def summary(self) -> dict:
        """median, within_95 and worst of each latency and stage, ms; memory, MB; refused frames. Unknown latencies are left out."""
        late = {topic: values for topic, values in self.latencies.items() if 0 < np.median(values) < _SAME_CLOCK_S}
        return {'latency_ms': {topic: _spread(values) for topic, values in late.items()},
                'stages_ms': {stage: _spread(values) for stage, values in self.stages.items()},
                'memory_mb': self.memory, 'refused': dict(self.refused)}


def _spread(seconds: list[float]) -> dict[str, float]:
    middle, most, worst = 1e3 * np.percentile(seconds, [50, 95, 100])
    return {'median': float(middle), 'within_95': float(most), 'worst': float(worst), 'count': len(seconds)}


class SampledTruth:
    """True contacts at and between stamps, for estimates that carry the mean time of several samples. used: the stamps between which some
    were asked for."""

    def __init__(self):
        self._known: dict[int, list[ContactEstimate]] = {}
        self._stamps: list[int] = []
        self.used: set[int] = set()

    def add(self, stamp: int, contacts: list[ContactEstimate]) -> None:
        """Contacts at a stamp, ns."""
        if stamp not in self._known:
            insort(self._stamps, stamp)
        self._known[stamp] = contacts

    def at(self, stamp: int) -> list[ContactEstimate] | None:
        """Contacts at a stamp between two known ones that are not far apart, None elsewhere: moved evenly from one to the other where they
        are the same, otherwise those of the earlier stamp."""
        place = bisect_left(self._stamps, stamp)
        if not 0 < place < len(self._stamps) or self._stamps[place] - self._stamps[place - 1] > _LONGEST_NS:
            return None
        first, last = self._stamps[place - 1], self._stamps[place]
        self.used |= {first, last}
        before, after = self._known[first], {contact.id: contact for contact in self._known[last]}
        if {contact.id for contact in before} != set(after):
            return before
        return [_between(contact, after[contact.id], (stamp - first) / (last - first)) for contact in before]


def _between(one: ContactEstimate, other: ContactEstimate, part: float) -> ContactEstimate:
    position, normal, depth, force = ((1 - part) * getattr(one, name) + part * getattr(other, name)
                                      for name in ('position', 'normal', 'depth', 'force'))
    length = np.linalg.norm(normal)
    return replace(one, position=position, normal=normal / length if length > 0 else normal, depth=depth, force=force)


@dataclass
class _Waiting:
    reported: Instant = field(default_factory=Instant)
    true: Instant = field(default_factory=Instant)
    topics: set[str] = field(default_factory=set)


class JudgedBag:
    """A recording with ground_truth/*.

    params: parameter file of the sensor; with it, estimates are computed from raw data, with calibration or the file that params names.
    reported, true: topics of estimates and of ground truth; times: filled by instants(); unmatched: counts of stamps with only one of the
    two. Raises BadRecording for a bag without ground truth, without estimates, or with several sensors and no namespace; TactileError as
    process_bag does.
    """

    def __init__(self, bag: Path, namespace: str = '', params: Path | None = None, calibration: Path | None = None):
        self._bag, self.times, self.unmatched = bag, Times(), Counter()
        self._task = Task(bag, params, calibration, namespace, _FIELDS) if params else None
        chain = self._task and self._task.chain()
        with self._task.open(chain) if chain else BagReader(bag) as reader:
            topics = reader.topics
        self.prefix = find_prefix(topics, namespace, chain.raw, chain.raw_type) if chain else _find_sensor(topics, namespace)
        mine = {topic.removeprefix(self.prefix) for topic in topics if topic.startswith(self.prefix)}
        self._live = bool(mine & _RAW)
        self.true = [name for name in _FIELDS if TRUE + name in mine]
        self.reported = [name for name in _FIELDS if name in mine]
        if not self.true:
            raise BadRecording(f'{bag}: no {self.prefix}{TRUE}*: nothing says what is true')
        if not (chain or self.reported):
            raise BadRecording(f'{bag}: no estimates in it ({", ".join(_FIELDS)}): make them by process_bag, or name --params FILE '
                               '(and --calibration FILE), and they are computed here')

    def instants(self) -> Iterator[tuple[float, Instant, Instant]]:
        """Yield (stamp s, estimate, truth) of each stamp that has both, in the order of their first messages. Contacts are true between the
        stamps of their ground truth too: of a PSD finger each estimate carries the mean time of its samples."""
        truth, alone = SampledTruth(), set()
        waiting: dict[int, _Waiting] = defaultdict(_Waiting)
        for name, message in self._anew() if self._task else self._recorded():
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            at, (part, read) = waiting[stamp], _FIELDS[name.removeprefix(TRUE)]
            try:
                setattr(at.true if name.startswith(TRUE) else at.reported, part, read(message))
            except BadFrame as error:
                self.times.refused[str(error)] += 1
            at.topics.add(name)
            if self.true == ['contacts'] and at.true.contacts is not None:
                truth.add(stamp, at.true.contacts)
            if len(waiting) > _MOST_WAITING:
                oldest = next(iter(waiting))
                yield from self._judged(oldest, waiting.pop(oldest), truth, alone)
        for stamp, at in waiting.items():
            yield from self._judged(stamp, at, truth, alone)
        self.unmatched['without an estimate'] = len(alone - truth.used)
        self.unmatched = +self.unmatched

    def _judged(self, stamp: int, at: _Waiting, truth: SampledTruth, alone: set[int]) -> Iterator[tuple[float, Instant, Instant]]:
        """See instants; alone: takes the stamps of truth without an estimate."""
        true = any(name.startswith(TRUE) for name in at.topics)
        reported = any(not name.startswith(TRUE) for name in at.topics)
        if true and reported:
            yield 1e-9 * stamp, at.reported, at.true
        elif true:
            alone.add(stamp)
        elif (between := truth.at(stamp)) is not None:
            yield 1e-9 * stamp, at.reported, Instant(contacts=between)
        else:
            self.unmatched['without truth'] += 1

    def _recorded(self) -> Iterator[tuple[str, object]]:
        """Yield (topic, message) of the recorded estimates and truth."""
        topics = {self.prefix + name for name in (*self.reported, *(TRUE + name for name in self.true))}
        with BagReader(self._bag) as reader:
            for raw in Progress(reader.messages(topics), 'messages'):
                name, message = raw.topic.removeprefix(self.prefix), self._decoded(raw)
                if message is None:
                    continue
                if self._live and not name.startswith(TRUE):
                    stamp = message.header.stamp
                    self.times.latencies[name].append(1e-9 * (raw.stamp_ns - stamp.sec * 10**9 - stamp.nanosec))
                yield name, message

    def _anew(self) -> Iterator[tuple[str, object]]:
        """Yield (topic, message) of the truth, and of estimates computed from raw data."""
        wanted = {*_FIELDS, *(TRUE + name for name in self.true)}
        for item in Progress(stream(self._task), 'messages'):
            if isinstance(item, Skipped):
                self.times.refused[item.reason] += 1
            elif isinstance(item, FrameDone):
                for name, seconds in (*item.seconds.items(), ('all', sum(item.seconds.values()))) if item.seconds else ():
                    self.times.stages[name].append(seconds)
            elif isinstance(item, RawMessage) and (name := item.topic.removeprefix(self.prefix)) in wanted:
                message = item.message or self._decoded(item)
                if message is not None:
                    yield name, message
        self.times.memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

    def _decoded(self, raw: RawMessage):
        """The decoded message; None for a damaged one, which is counted."""
        try:
            return decode(raw.data, raw.type_name)
        except BadFrame as error:
            self.times.refused[f'{raw.topic}: {error}'] += 1
            return None


def _find_sensor(topics: dict[str, str], namespace: str) -> str:
    """'/ns/' of the sensor with ground truth among topics. Raises BadRecording without one, and for several without a namespace."""
    found = {topic.partition(TRUE)[0] for topic in topics if '/' + TRUE in topic}
    if not found:
        raise BadRecording(f'no */{TRUE}* in the bag: nothing says what is true; record a simulated sensor, or what a stage or a '
                           'force/torque sensor reads')
    return choose_prefix(found, namespace, TRUE + '*')
