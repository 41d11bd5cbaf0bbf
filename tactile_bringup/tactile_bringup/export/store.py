# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Columns of a data set in HDF5 or zarr: arrays with a row a step that grow, entries of unequal number padded, with a mask."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from tactile_driver.errors import BadRecording

from .constants import EXPORT
from .fields import Field

_MASK = '.mask'
_EPISODE = 'episode_{:06d}'
_SMALLER = {'compression': 'lzf', 'shuffle': True}


class Columns:
    """The columns of an episode.

    Parameters
    ----------
    create : callable
        ``create(path, shape, chunks, dtype)`` makes an empty array whose first two dimensions can grow, with ``resize``, ``attrs``, slices.
    attributes : Mapping
        Of the columns besides their notes, by the part of their names before the last slash.
    """

    def __init__(self, create: Callable, attributes: Mapping[str, Mapping]):
        self._create, self._attributes, self._rows = create, attributes, 0
        self._arrays: dict[str, object] = {}
        self._waiting: dict[str, list[np.ndarray]] = {}
        self._notes: dict[str, dict] = {}

    def add(self, fields: Mapping[str, Field]) -> None:
        """Add a row. Raises BadRecording where a column is not as it was."""
        if self._rows and fields.keys() != self._waiting.keys():
            some = ', '.join(sorted(fields.keys() ^ self._waiting.keys()))
            raise BadRecording(f'columns {some} are not in all messages; leave out their topics with --topics')
        for name, field in fields.items():
            waiting = self._waiting.setdefault(name, [])
            if not self._rows:
                own = self._attributes.get(name.rpartition('/')[0], {})
                self._notes[name] = {'note': field.note, 'is_variable': field.is_variable, **own}
            waiting.append(field.values)
            if len(waiting) * max(field.values.nbytes, 64) > EXPORT.buffered_bytes:
                self._flush(name)
        self._rows += 1

    def close(self) -> None:
        """Write what waits."""
        for name in self._waiting:
            self._flush(name)

    def _flush(self, name: str) -> None:
        rows, is_variable = self._waiting[name], self._notes[name]['is_variable']
        self._waiting[name] = []
        if not rows:
            return
        if is_variable:
            width = max(len(row) for row in rows)
            padding = np.nan if rows[0].dtype.kind == 'f' else 0
            padded = np.full((len(rows), width, *rows[0].shape[1:]), padding, rows[0].dtype)
            mask = np.zeros((len(rows), width), bool)
            for number, row in enumerate(rows):
                padded[number, :len(row)], mask[number, :len(row)] = row, True
            self._append(name, padded)
            self._append(name + _MASK, mask)
        elif len({row.shape for row in rows}) > 1:
            raise BadRecording(f'{name}: arrays of shapes {sorted({row.shape for row in rows})}; name topics of one shape with --topics')
        else:
            self._append(name, np.stack(rows))

    def _append(self, name: str, block: np.ndarray) -> None:
        if name not in self._arrays:
            per_row = max(block[0].nbytes, 1)
            chunks = (max(1, min(1024, EXPORT.chunk_bytes // per_row)), *(max(1, size) for size in block.shape[1:]))
            self._arrays[name] = self._create(name, (0, *block.shape[1:]), chunks, block.dtype)
            self._arrays[name].attrs.update(self._notes.get(name, {'note': 'true where the array of this name has an entry'}))
        stored = self._arrays[name]
        before = stored.shape
        is_masked = name.endswith(_MASK) or name + _MASK in self._arrays or self._notes[name]['is_variable']
        width = max(before[1], block.shape[1]) if is_masked else 0
        shape = (before[0] + len(block), width, *block.shape[2:]) if is_masked else (before[0] + len(block), *block.shape[1:])
        if shape[1:] != before[1:] and not is_masked:
            raise BadRecording(f'{name}: an array of shape {block.shape[1:]} after {before[1:]}; name topics of one shape with --topics')
        stored.resize(shape)
        if is_masked:
            stored[before[0]:, :block.shape[1]] = block
        else:
            stored[before[0]:] = block


class Store:
    """A data set of episodes in one file (HDF5) or folder (zarr); a context manager.

    Parameters
    ----------
    path : Path
        To write; it must not exist.
    kind : str
        ``hdf5`` or ``zarr``.
    """

    def __init__(self, path: Path, kind: str):
        self._kind, self._path = kind, path
        if kind == 'hdf5':
            import h5py
            self._file = h5py.File(path, 'w')
        else:
            import zarr
            self._file = zarr.open_group(path, mode='w')

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_exc) -> None:
        if self._kind == 'hdf5':
            self._file.close()

    def take(self, source: Path, first: int) -> int:
        """Take over the episodes of another store, numbered from first; their number."""
        if self._kind == 'zarr':
            names = sorted(path.name for path in source.iterdir() if path.is_dir())
            for number, name in enumerate(names, first):
                (source / name).rename(self._path / _EPISODE.format(number))
            return len(names)
        import h5py
        with h5py.File(source) as data:
            for number, name in enumerate(sorted(data), first):
                data.copy(name, self._file, name=_EPISODE.format(number))
            return len(data)

    def episode(self, number: int, attributes: Mapping[str, str | float], of_topics: Mapping[str, Mapping]) -> Columns:
        """The columns of a new episode, with its attributes and those of its topics."""
        group = self._file.create_group(_EPISODE.format(number))
        group.attrs.update(attributes)
        if self._kind == 'zarr':
            return Columns(lambda path, shape, chunks, dtype: group.create_array(
                path, shape=shape, chunks=chunks, dtype=dtype, fill_value=np.nan if dtype.kind == 'f' else 0), of_topics)
        return Columns(lambda path, shape, chunks, dtype: group.create_dataset(
            path, shape=shape, maxshape=(None, None, *shape[2:])[:len(shape)], chunks=chunks, dtype=dtype,
            fillvalue=np.nan if dtype.kind == 'f' else 0, **({} if _is_large(shape, dtype) else _SMALLER)), of_topics)


def _is_large(shape: tuple[int, ...], dtype: np.dtype) -> bool:
    return int(np.prod(shape[1:], dtype=int)) * dtype.itemsize > EXPORT.max_compressed_row


def join(sources: Sequence[Path], target: Path, kind: str) -> None:
    """Write the episodes of several stores, one after the other, to a new one, target; those of zarr are moved there."""
    with Store(target, kind) as store:
        count = 0
        for source in sources:
            count += store.take(source, count)
