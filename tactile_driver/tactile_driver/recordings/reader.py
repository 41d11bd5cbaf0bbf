# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads rosbag2 recordings (sqlite3 or MCAP, one file or several): raw messages, descriptions, truth, and what is missing."""
from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import yaml
from rosbag2_py import ConverterOptions, MetadataIo, SequentialCompressionReader, SequentialReader, StorageFilter, StorageOptions

from ..errors import BadFrame, BadRecording
from ..frame import COMPRESSED
from ..frame_names import sensor_frame
from .constants import RECORDINGS
from .serialization import decode
from .truth import RecordedTruth

_NUMBER = re.compile(r'-?\d+(\.\d+)?')


class LeftOut:
    """Skipped items by topic and reason. Reasons that differ only in numbers count as one; the first is reported."""

    def __init__(self):
        self._found: dict[tuple[str, str], list] = {}

    def add(self, where: str, reason: str, stamp_ns: int | None = None, count: int = 1) -> None:
        """Count skipped items. where: topic or file; stamp_ns: stamp of the message, ns; count: number of items."""
        key = (where, _NUMBER.sub('#', reason))
        if key not in self._found and len(self._found) >= RECORDINGS.max_reasons:
            key, reason = ('elsewhere', ''), 'other reasons'
        entry = self._found.setdefault(key, [0, reason, stamp_ns])
        entry[0] += count

    @property
    def total(self) -> int:
        """Number of skipped items."""
        return sum(count for count, _, _ in self._found.values())

    def merge(self, other: LeftOut) -> None:
        """Add the counts of another LeftOut."""
        for (where, _), (count, reason, stamp_ns) in other._found.items():
            self.add(where, reason, stamp_ns, count)

    def lines(self) -> list[str]:
        """One line per reason: count, topic, reason and first time; most frequent first."""
        reported = sorted(self._found.items(), key=lambda item: -item[1][0])
        return [f'{count} of {where}: {reason}' + ('' if stamp is None else f' (first at {stamp / 1e9:.3f} s)')
                for (where, _), (count, reason, stamp) in reported]


_FILES = ('.mcap', '.db3')
COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'


class RawMessage(NamedTuple):
    """One serialised (CDR) message of a bag; stamp_ns: time of recording, ns; message: the decoded message, None if not decoded."""

    topic: str
    type_name: str
    stamp_ns: int
    data: bytes
    message: object = None


class BagReader:
    """Reads a rosbag2 folder, or one .mcap or .db3 file; use it in a with statement. Raises BadRecording if it cannot be read.

    A folder without metadata.yaml, as a killed recorder leaves it, is read file by file, and an unfinished MCAP file as far as rosbag2
    scans it. Where image_raw was not recorded, image_raw/compressed has its name, and its own type. left_out: what was missing or damaged
    so far. hashes: type description hash (RIHS01) by topic, '' if not recorded.
    """

    def __init__(self, path: str | Path):
        self.path, self.left_out = Path(path), LeftOut()
        if not self.path.exists():
            raise BadRecording(f'bag {self.path}: no such file or folder')
        self._bags: list[tuple[Path, bool]] = []
        self._counts: Counter = Counter()
        self._types: dict[str, str] = {}
        self.hashes: dict[str, str] = {}
        self._recorded: dict[str, str] = {}  # the name in the bag of a topic that has another one here

    def __enter__(self) -> BagReader:
        for bag in self._parts():
            try:
                self._add(bag)
            except BadRecording as error:
                if bag == self.path:
                    raise
                self.left_out.add(bag.name, str(error))
        self._name_compressed()
        if not self._types:
            raise _unreadable(self.path, '; '.join(self.left_out.lines()) or 'it is empty')
        return self

    def _add(self, bag: Path) -> None:
        packed = _packed(bag)
        for information in _opened(bag, packed).get_metadata().topics_with_message_count:
            topic = information.topic_metadata
            self._types[topic.name] = topic.type
            self.hashes[topic.name] = topic.type_description_hash
            self._counts[topic.name] += information.message_count
        self._bags.append((bag, packed))

    def __exit__(self, *_exc) -> None:
        self._bags = []

    def _parts(self) -> list[Path]:
        """What rosbag2 can open: the folder or file itself, or the files in a folder without metadata, in the order of their numbers."""
        if not self.path.is_dir() or MetadataIo().metadata_file_exists(str(self.path)):
            return [self.path]
        files = [file for file in self.path.iterdir() if file.suffix in _FILES]
        if not files:
            raise _unreadable(self.path, 'no metadata.yaml, .mcap or .db3 file in it')
        self.left_out.add(self.path.name, 'there is no metadata.yaml: the recording was cut off')
        return sorted(files, key=lambda file: [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', file.name)])

    def _name_compressed(self) -> None:
        for topic in [topic for topic, kind in self._types.items() if kind == COMPRESSED_IMAGE and topic.endswith(COMPRESSED)]:
            name = topic.removesuffix(COMPRESSED)
            if name not in self._types:
                self._recorded[name] = topic
                for table in (self._types, self._counts, self.hashes):
                    table[name] = table.pop(topic)

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> message type name."""
        return dict(self._types)

    @property
    def times_ns(self) -> tuple[int, int]:
        """When the first and the last message were recorded, ns, according to the bag."""
        found = [_opened(*bag).get_metadata() for bag in self._bags]
        begins = [each.starting_time.nanoseconds for each in found]
        return min(begins), max(begin + each.duration.nanoseconds for begin, each in zip(begins, found))

    def count(self, topics: set[str]) -> int:
        """Number of messages of these topics according to the bag."""
        return sum(self._counts[topic] for topic in topics)

    def messages(self, topics: set[str] | None = None) -> Iterator[RawMessage]:
        """Messages of the topics (None: all), file by file, in order of recording; left_out counts those that are missing."""
        wanted = set(self._types) if topics is None else topics & set(self._types)
        names = {self._recorded.get(topic, topic): topic for topic in wanted}
        expected, read, lost = BagReader.count(self, wanted), 0, 0
        for bag, packed in self._bags if wanted else ():
            reader = _opened(bag, packed)
            reader.set_filter(StorageFilter(topics=sorted(names)))
            while lost <= expected:  # an error may come again for ever
                try:
                    if not reader.has_next():
                        break
                    topic, data, stamp_ns = reader.read_next()
                except Exception as error:  # rosbag2's errors come as several types
                    self.left_out.add(bag.name, f'{_one_line(error)}; {_help(bag)}')
                    lost += 1
                    continue
                read += 1
                yield RawMessage(names[topic], self._types[names[topic]], stamp_ns, data)
        if read + lost < expected:
            reason = f'messages cannot be read: a file is damaged; {_help(self.path)}'
            self.left_out.add(self.path.name, reason, count=expected - read - lost)


def _packed(bag: Path) -> bool:
    """Whether rosbag2 compressed its files or messages."""
    try:
        return MetadataIo().metadata_file_exists(str(bag)) and bool(MetadataIo().read_metadata(str(bag)).compression_format)
    except Exception as error:  # see BagReader.messages
        raise _unreadable(bag, _one_line(error)) from error


def _opened(bag: Path, packed: bool) -> SequentialReader | SequentialCompressionReader:
    try:
        reader = SequentialCompressionReader() if packed else SequentialReader()
        reader.open(StorageOptions(uri=str(bag)), ConverterOptions())
        reader.get_metadata()
    except Exception as error:  # see BagReader.messages
        raise _unreadable(bag, _one_line(error)) from error
    return reader


def _unreadable(bag: Path, reason: str) -> BadRecording:
    return BadRecording(f'bag {bag}: cannot be read: {reason}; {_help(bag)}')


def _help(bag: Path) -> str:
    return f'try "ros2 bag reindex {bag if bag.is_dir() else bag.parent}", or "mcap recover" for a damaged .mcap file'


def _one_line(error: Exception) -> str:
    return ' '.join(str(error).split())


_STRING = 'std_msgs/msg/String'


def recorded_description(reader: BagReader, raw_topic: str) -> dict:
    """Description of the sensor with this raw topic: /ns/description for /ns/image_raw or /ns/left/image_raw; {} without one.

    For a recording of a replay, the description in the original recording is returned.
    """
    namespace = posixpath.dirname(raw_topic)
    for folder in (namespace, posixpath.dirname(namespace)):
        for about in _reported(reader, {posixpath.join(folder, 'description')}):
            if about:
                return about
    return {}


def descriptions(bag: str | Path) -> Iterator[dict]:
    """Descriptions of sensors in a bag; for a replayed sensor the original one.

    Messages without a YAML mapping are skipped. Raises BadRecording.
    """
    with BagReader(bag) as reader:
        yield from _reported(reader, {topic for topic in reader.topics if topic.endswith('/description')})


def recorded_frame(reader: BagReader, prefix: str) -> str:
    """The sensor frame of the sensor with topics under prefix, '/ns/': as its description says, else as its namespace is named."""
    reported = (about.get('frame_id') for about in _reported(reader, {prefix + 'description'}))
    return next((frame for frame in reported if frame and isinstance(frame, str)), sensor_frame(prefix))


def _reported(reader: BagReader, topics: set[str]) -> Iterator[dict]:
    """Descriptions of the sensors themselves: for a replay, the original one, which the driver keeps under the key recorded."""
    for raw in reader.messages({topic for topic in topics if reader.topics.get(topic) == _STRING}):
        try:
            about = yaml.safe_load(decode(raw.data, _STRING).data)
        except (BadFrame, yaml.YAMLError):
            continue
        if isinstance(about, dict):
            recorded = about.get('recorded')
            yield recorded if isinstance(recorded, dict) else about


#: Name of a topic under ground_truth/ -> type of its messages.
TRUTH_TYPES = {'tip': 'geometry_msgs/msg/PointStamped', 'contacts': 'tactile_msgs/msg/Contacts',
               'contact_region': 'tactile_msgs/msg/ContactRegion', 'slip': 'tactile_msgs/msg/Slip',
               'wrench': 'geometry_msgs/msg/WrenchStamped'}


def truth_topics(types: Mapping[str, str], raw_topic: str) -> dict[str, str]:
    """Topic -> its name under ground_truth/, of the sensor with this raw topic: /ns/image_raw, or /ns/left/image_raw; types: of all topics.
    """
    folder = posixpath.dirname(raw_topic)
    named = {posixpath.join(space, 'ground_truth', name): name for space in (folder, posixpath.dirname(folder)) for name in TRUTH_TYPES}
    return {topic: name for topic, name in named.items() if types.get(topic) == TRUTH_TYPES[name]}


def with_truth(messages: Iterable, raw_topic: str, topics: Mapping[str, str]) -> Iterator[tuple[object, RecordedTruth | None]]:
    """(raw message, what is recorded of the truth after it and before the next one), in the order of recording; truth before the first raw
    message comes with it. messages: RawMessages of the raw topic and of topics, as of truth_topics."""
    last, found = None, []
    for message in messages:
        if message.topic in topics:
            found.append((topics[message.topic], message.data))
        elif message.topic == raw_topic:
            if last is not None:
                yield last, RecordedTruth(tuple(found)) if found else None
                found = []
            last = message
    if last is not None:
        yield last, RecordedTruth(tuple(found)) if found else None
