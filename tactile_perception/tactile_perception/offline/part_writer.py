# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes a rosbag2 folder in parts (MCAP files), of which each is a recording by itself once it is ended: what is written stays readable
whatever happens, and more parts can follow later.
"""
from __future__ import annotations

import os
import shutil
from pathlib import Path

import yaml

from .rosbag2_writer import Rosbag2Writer

UNFINISHED = 'unfinished'
_INFORMATION = 'rosbag2_bagfile_information'


class PartWriter:
    """The parts NAME_0.mcap, NAME_1.mcap ... of the bag at path, and its metadata.yaml; the part that is being written is in a folder of
    its own below. store: message definitions that the files carry; metadata: of the parts that are there already and stay; others are
    removed."""

    def __init__(self, path: Path, store, metadata: dict | None = None):
        self._path, self._store, self.metadata = path, store, metadata or {}
        self._writer: Rosbag2Writer | None = None
        self._connections: dict[str, object] = {}
        (path / UNFINISHED).mkdir(parents=True, exist_ok=True)
        for file in path.glob('*.mcap'):
            if file.name not in self.metadata.get('relative_file_paths', []):
                file.unlink()
        self._write_metadata()

    @property
    def parts(self) -> int:
        """How many are ended."""
        return len(self.metadata.get('files', []))

    def write(self, topic: str, type_name: str, stamp_ns: int, data: bytes) -> None:
        """Append one serialised message to the present part."""
        if self._writer is None:
            folder = self._path / UNFINISHED / f'{self._path.name}_{self.parts}'
            shutil.rmtree(folder, ignore_errors=True)
            self._writer = Rosbag2Writer(folder, self._store)
            self._writer.open()
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_topic(topic, type_name)
        self._writer.write(self._connections[topic], stamp_ns, data)

    def end_part(self) -> None:
        """Close the present part, if anything is in it, and make it one of the bag."""
        if self._writer is None:
            return
        writer, self._writer, self._connections = self._writer, None, {}
        writer.close()
        added = yaml.safe_load((writer.path / 'metadata.yaml').read_text())[_INFORMATION]
        name = added['relative_file_paths'][0]
        os.replace(writer.path / name, self._path / name)
        self.metadata = _joined(self.metadata, added) if self.metadata else added
        self._write_metadata()
        shutil.rmtree(writer.path)

    def _write_metadata(self) -> None:
        target = self._path / 'metadata.yaml'
        if not self.metadata:
            target.unlink(missing_ok=True)
            return
        partial = self._path / UNFINISHED / 'metadata.yaml'
        partial.write_text(yaml.safe_dump({_INFORMATION: self.metadata}, sort_keys=False))
        os.replace(partial, target)


def _joined(before: dict, added: dict) -> dict:
    """The metadata of parts before and one that is added."""
    begins, ends = zip(*(_span(part) for part in (before, added)))
    counts = {topic['topic_metadata']['name']: dict(topic) for topic in before['topics_with_message_count']}
    for topic in added['topics_with_message_count']:
        known = counts.setdefault(topic['topic_metadata']['name'], topic | {'message_count': 0})
        known['message_count'] += topic['message_count']
    return before | {
        'relative_file_paths': before['relative_file_paths'] + added['relative_file_paths'],
        'starting_time': {'nanoseconds_since_epoch': min(begins)},
        'duration': {'nanoseconds': max(ends) - min(begins)},
        'message_count': before['message_count'] + added['message_count'],
        'topics_with_message_count': list(counts.values()),
        'files': before['files'] + added['files'],
    }


def _span(metadata: dict) -> tuple[int, int]:
    """ns of the first and the last message."""
    begin = metadata['starting_time']['nanoseconds_since_epoch']
    return begin, begin + metadata['duration']['nanoseconds']
