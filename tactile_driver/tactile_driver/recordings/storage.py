# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Finds the files of a rosbag2 recording and reads their messages; damaged files are read as far as possible."""
from __future__ import annotations

import re
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import yaml
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader

from ..errors import BadRecording
from .left_out import LeftOut
from .salvage_mcap import SalvagedMcap, zstd
from .salvage_sqlite import SalvagedSqlite

_SALVAGE = {'.mcap': SalvagedMcap, '.db3': SalvagedSqlite}
_PACKED = '.zstd'
_BLOCK = 1 << 20  # bytes per read while decompressing; chosen
Message = tuple[str, str, int, bytes]  # topic, type name, time of recording in ns, CDR data


def bag_files(path: Path, left_out: LeftOut) -> tuple[list[Path], bool]:
    """The files of a recording (a folder or one file), in order, and whether messages are compressed individually.

    A folder without a usable metadata.yaml, as an interrupted recording leaves it, is searched for files. Raises BadRecording if it has
    none.
    """
    if not path.is_dir():
        return [path], False
    known = _metadata(path / 'metadata.yaml', left_out)
    files = [path / Path(name).name for name in known['relative_file_paths']] if known else _found(path)
    for lost in [file for file in files if not file.exists()]:
        left_out.add(path.name, f'file {lost.name} is missing')
    files = [file for file in files if file.exists()]
    if not files:
        raise BadRecording(f'bag {path}: cannot be read: no .mcap or .db3 file in it')
    return files, str(known.get('compression_mode', '')).lower() == 'message'


def _metadata(path: Path, left_out: LeftOut) -> dict:
    try:
        known = yaml.safe_load(path.read_text())['rosbag2_bagfile_information']
        return known if known['relative_file_paths'] else {}
    except FileNotFoundError:
        left_out.add(path.parent.name, 'there is no metadata.yaml: the recording was cut off')
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError) as error:
        left_out.add(path.parent.name, f'metadata.yaml cannot be read: {error}')
    return {}


def _found(folder: Path) -> list[Path]:
    """The storage files in a folder, in natural order: file 10 after file 9."""
    kinds = (*_SALVAGE, *[kind + _PACKED for kind in _SALVAGE])
    files = [file for file in folder.rglob('*') if file.name.endswith(kinds)]
    return sorted(files, key=lambda file: [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', file.name)])


def unpacked(file: Path, folder: Path, left_out: LeftOut) -> Path:
    """Path of the file; a file compressed as a whole is decompressed into folder first."""
    if file.suffix != _PACKED:
        return file
    target = folder / file.stem
    try:
        with zstd.open(file, 'rb') as packed, target.open('wb') as plain:
            shutil.copyfileobj(packed, plain, _BLOCK)
    except (OSError, EOFError, zstd.ZstdError) as error:
        left_out.add(file.name, f'the compressed file is cut off or damaged: {error}')
    return target


class StorageFile:
    """One storage file.

    topics: topic -> type name; definitions: type name -> text, '' without one; counts: topic -> number of messages; in_messages: whether
    each message is compressed individually. Losses are added to left_out when they are found. Raises BadRecording for a file that is
    neither .mcap nor .db3.
    """

    def __init__(self, path: Path, in_messages: bool, left_out: LeftOut):
        self.path, self._in_messages, self._left_out = path, in_messages, left_out
        if path.suffix not in _SALVAGE:
            raise BadRecording(f'{path}: no .mcap or .db3 file')
        self._reader = Reader(path)
        try:
            self._reader.open()
        except Exception as error:  # rosbags raises errors of its own, of struct, sqlite and zstandard
            self._damaged = self._salvaged(error)
            self.topics, self.definitions, self.counts = self._damaged.topics, self._damaged.definitions, self._damaged.counts
            return
        self._damaged, self.counts = None, Counter()
        self.topics = {c.topic: c.msgtype for c in self._reader.connections}
        text = {c.msgtype: c.msgdef for c in self._reader.connections}
        self.definitions = {kind: found.data if found.format == MessageDefinitionFormat.MSG else '' for kind, found in text.items()}
        for connection in self._reader.connections:
            self.counts[connection.topic] += connection.msgcount

    def _salvaged(self, error: Exception) -> SalvagedMcap | SalvagedSqlite:
        self._left_out.add(self.path.name, f'the file is not whole ({error}); it is read as far as it goes')
        return _SALVAGE[self.path.suffix](self.path, self._left_out)

    def close(self) -> None:
        """Close the file."""
        if self._damaged is None:
            self._reader.close()

    def messages(self, topics: set[str]) -> Iterator[Message]:
        """Messages of the topics, in order of recording."""
        found = self._plain(topics) if self._damaged is None else self._damaged.messages(topics)
        return self._decompressed(found) if self._in_messages else found

    def _plain(self, topics: set[str]) -> Iterator[Message]:
        """Read with rosbags; after its first failure, continue with the salvaging reader."""
        last_ns, at_last = -1, Counter()
        try:
            chosen = [c for c in self._reader.connections if c.topic in topics]
            for connection, stamp_ns, data in self._reader.messages(chosen) if chosen else ():
                yield connection.topic, connection.msgtype, stamp_ns, bytes(data)
                if stamp_ns != last_ns:
                    last_ns, at_last = stamp_ns, Counter()
                at_last[connection.topic] += 1
        except GeneratorExit:
            raise
        except Exception as error:  # see __init__
            for message in self._salvaged(error).messages(topics):
                if message[2] > last_ns:
                    yield message
                elif message[2] == last_ns and at_last[message[0]]:
                    at_last[message[0]] -= 1
                elif message[2] == last_ns:
                    yield message

    def _decompressed(self, found: Iterator[Message]) -> Iterator[Message]:
        for topic, type_name, stamp_ns, data in found:
            try:
                yield topic, type_name, stamp_ns, zstd.decompress(data)
            except zstd.ZstdError as error:
                self._left_out.add(topic, f'a compressed message is damaged: {error}', stamp_ns)
