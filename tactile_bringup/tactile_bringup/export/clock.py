# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""All topics of a recording on one clock: a row a step, with the message of each topic that holds or is nearest then."""
from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tactile_driver.errors import BadRecording
from tactile_driver.recordings.reader import BagReader, RawMessage
from tactile_driver.recordings.serialization import decode, header_stamp_ns
from tactile_perception.common.progress import progress

from .together import HandReader

HELD, NEAREST = 'held', 'nearest'


def stamp_ns_of(message: RawMessage, has_header: bool) -> int:
    """The stamp of a message with a header, else the time when it was recorded, ns."""
    return header_stamp_ns(message.data) if has_header else message.stamp_ns


@dataclass(frozen=True)
class Row:
    """One step. stamp_ns: of the clock; messages: by topic, with their own stamps, ns."""

    stamp_ns: int
    messages: Mapping[str, tuple[int, RawMessage]]


class Clock:
    """The rows of a recording, from when all topics have begun to its end.

    Parameters
    ----------
    reader : BagReader or HandReader
        The opened recording.
    headed : Mapping
        Topics that become columns, and whether their messages begin with a header.
    rate : float
        Rows per second.
    pick : str
        `HELD`, the last message before a step, or `NEAREST`.
    marks : str
        Topic of std_msgs/Bool that is true while an episode lasts; ``''``: the recording is one episode.

    Raises
    ------
    BadRecording
        If a topic has no message, or clocks disagree.
    """

    def __init__(self, reader: BagReader | HandReader, headed: Mapping[str, bool], rate: float, pick: str, marks: str = ''):
        self._reader, self._headed, self._rate, self._pick = reader, headed, rate, pick
        stamps, recorded = ({topic: array('q') for topic in headed} for _ in range(2))
        switched: list[tuple[int, bool]] = []
        for message in progress(reader.messages({*headed, *filter(None, [marks])}), 'messages looked at'):
            if message.topic == marks:
                switched.append((message.stamp_ns, decode(message.data, message.type_name).data))
            if message.topic in headed:
                stamps[message.topic].append(stamp_ns_of(message, headed[message.topic]))
                recorded[message.topic].append(message.stamp_ns)
        self._stamps = {topic: np.asarray(found, np.int64) for topic, found in stamps.items()}
        self._check(recorded)
        begin = max(int(found.min()) for found in self._stamps.values())
        end = max(int(found.max()) for found in self._stamps.values())
        self.episodes = _episodes(switched, begin, end) if marks else [(begin, end)]
        if not self.episodes:
            raise BadRecording(f'bag {reader.path}: {marks} is never true while all topics have messages')

    def _check(self, recorded: Mapping[str, array]) -> None:
        """Compare the stamps of topics with the times, ns, at which their messages were recorded: clocks disagree that differ by more than
        the recording lasts."""
        empty = [topic for topic, found in recorded.items() if not len(found)]
        if empty or not recorded:
            raise BadRecording(f'bag {self._reader.path}: no message on {", ".join(empty) or "any topic"}; name others with --topics')
        times = {topic: np.asarray(found, np.int64) for topic, found in recorded.items()}
        offsets = {topic: float(np.median(self._stamps[topic] - found)) for topic, found in times.items()}
        early, late = min(offsets, key=offsets.get), max(offsets, key=offsets.get)
        ahead = offsets[late] - offsets[early]
        if ahead > max(found.max() for found in times.values()) - min(found.min() for found in times.values()):
            raise BadRecording(f'bag {self._reader.path}: the clock of {late} is {1e-9 * ahead:.1f} s ahead of that of {early}; '
                               'they disagree: name topics of one clock with --topics')

    def rows(self) -> Iterator[tuple[int, Row]]:
        """Yield (number of the episode, row). A message is read once, and kept until its last row."""
        steps = [(number, step) for number, times in enumerate(self.episodes) for step in self._steps(*times)]
        numbers = {topic: self._numbers(found, np.array([step for _, step in steps])) for topic, found in self._stamps.items()}
        wanted = {topic: deque(np.unique(index).tolist()) for topic, index in numbers.items()}
        kept: dict[str, dict[int, tuple[int, RawMessage]]] = {topic: {} for topic in numbers}
        read = dict.fromkeys(numbers, 0)
        row = 0
        for message in progress(self._reader.messages(set(numbers)), 'messages'):
            topic, number = message.topic, read[message.topic]
            read[topic] += 1
            if wanted[topic] and wanted[topic][0] == number:
                wanted[topic].popleft()
                kept[topic][number] = stamp_ns_of(message, self._headed[topic]), message
            while row < len(steps) and all(numbers[topic][row] < read[topic] for topic in numbers):
                yield steps[row][0], Row(steps[row][1], {topic: kept[topic][numbers[topic][row]] for topic in numbers})
                row += 1
                for topic, index in numbers.items():
                    for number in [old for old in kept[topic] if row < len(steps) and old < index[row]]:
                        del kept[topic][number]

    def _steps(self, begin: int, end: int) -> list[int]:
        count = int((end - begin) * self._rate / 1e9 + 1e-6) + 1
        return [begin + round(1e9 * number / self._rate) for number in range(count)]

    def _numbers(self, stamps: np.ndarray, steps: np.ndarray) -> list[int]:
        """Number of the message for each step. Messages that were recorded out of order are taken in the order of their stamps."""
        order = np.argsort(stamps, kind='stable')
        after = np.searchsorted(stamps[order], steps, 'right')
        before = np.maximum(after - 1, 0)
        if self._pick == NEAREST:
            after = np.minimum(after, len(stamps) - 1)
            is_after_nearer = stamps[order][after] - steps < steps - stamps[order][before]
            before = np.where(is_after_nearer, after, before)
        # Of messages out of order a later one is not needed by an earlier step, so that one pass over the recording suffices.
        return np.maximum.accumulate(order[before]).tolist()


def _episodes(switched: Collection[tuple[int, bool]], begin: int, end: int) -> list[tuple[int, int]]:
    """Begin and end, ns, of the times in which the last mark is true."""
    found, since = [], None
    for stamp_ns, is_on in [*sorted(switched), (end, False)]:
        if is_on and since is None:
            since = max(stamp_ns, begin)
        elif not is_on and since is not None:
            found.append((since, min(stamp_ns, end)))
            since = None
    return [(first, last) for first, last in found if first < last]
