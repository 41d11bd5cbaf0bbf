# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Data sets in HDF5 as a LeRobotDataset of version 3.0: rows in parquet, images as videos.

Layout: https://huggingface.co/docs/lerobot/lerobot-dataset-v3
"""
from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import cv2
import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tactile_driver.errors import BadRecording

from .constants import EXPORT

_FILE = 'chunk-{chunk_index:03d}/file-{file_index:03d}'
_FIRST = _FILE.format(chunk_index=0, file_index=0)
_OWN = {'timestamp': 'float32', 'frame_index': 'int64', 'episode_index': 'int64', 'index': 'int64', 'task_index': 'int64'}
_IMAGE = '/image'


def write_lerobot(sources: Sequence[Path], target: Path, rate: int, task: str) -> None:
    """Convert a data set.

    Parameters
    ----------
    sources : sequence of Path
        HDF5 files, as `Store` writes them.
    target : Path
        Folder to make.
    rate : int
        Rows per second.
    task : str
        What is done in the episodes.

    Raises
    ------
    BadRecording
        If the episodes have not the same columns, or a video cannot be written.
    """
    with ExitStack() as opened:
        files = [opened.enter_context(h5py.File(source)) for source in sources]
        episodes = [data[name] for data in files for name in sorted(data)]
        columns = [_columns(episode) for episode in episodes]
        if any(each.keys() != columns[0].keys() for each in columns):
            raise BadRecording('the recordings have different topics: ' + ', '.join(sorted(set().union(*columns) - set.intersection(
                *map(set, columns)))) + '; name common ones with --topics')
        widths = {name: np.max([each[name].shape[1:] for each in columns], axis=0).astype(int).tolist() for name in columns[0]}
        widths = {name: width for name, width in widths.items() if 0 not in width}  # such as positions of a sensor without a surface model
        for name in _images(widths):
            _write_video(target / 'videos' / _key(name) / f'{_FIRST}.mp4', [each[name] for each in columns], rate)
        summary = _write_rows(target / 'data' / f'{_FIRST}.parquet', columns, widths, rate)
        _write_meta(target / 'meta', columns, widths, rate, task, summary)


def _columns(episode: h5py.Group) -> dict[str, h5py.Dataset]:
    found: dict[str, h5py.Dataset] = {}
    episode.visititems(lambda name, each: found.update({name: each}) if isinstance(each, h5py.Dataset) else None)
    return found


def _images(names: Iterable[str]) -> list[str]:
    """Those that are images, and become videos."""
    return [name for name in names if name.endswith(_IMAGE)]


def _key(name: str) -> str:
    """Name of a feature: LeRobot allows no slash."""
    parts = name.removesuffix(_IMAGE).replace('/', '.')
    return f'observation.images.{parts}' if name.endswith(_IMAGE) else f'observation.{parts}'


def _write_video(path: Path, episodes: list[h5py.Dataset], rate: int) -> None:
    path.parent.mkdir(parents=True)
    height, width = episodes[0].shape[1:3]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'mp4v'), rate, (width, height))
    if not writer.isOpened():
        raise BadRecording(f'{path.name}: a video of {width} x {height} px cannot be written; export it to hdf5 or zarr')
    for images in episodes:
        for row in range(len(images)):
            picture = images[row]
            picture = (picture >> 8).astype(np.uint8) if picture.dtype == np.uint16 else picture
            writer.write(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture)
    writer.release()


def _write_rows(path: Path, columns: list[dict], widths: dict, rate: int) -> dict[str, dict]:
    """Write all rows; feature -> min, max, mean, std, count of the known values."""
    path.parent.mkdir(parents=True)
    sums: dict[str, list] = {}
    writer = None
    for block in _blocks(columns, widths, rate):
        table = pa.table({name: _arrow(values) for name, values in block.items()})
        writer = writer or pq.ParquetWriter(path, table.schema)
        writer.write_table(table)
        for name, values in block.items():
            _summarise(sums.setdefault(name, []), values)
    writer.close()
    return {name: _summary(parts) for name, parts in sums.items()}


def _blocks(columns: list[dict], widths: dict, rate: int) -> Iterator[dict[str, np.ndarray]]:
    images = _images(widths)
    before = 0
    for number, episode in enumerate(columns):
        count = len(next(iter(episode.values())))
        for begin in range(0, count, EXPORT.rows_in_memory):
            frames = np.arange(begin, min(begin + EXPORT.rows_in_memory, count))
            same = np.ones(len(frames), np.int64)
            own = {'timestamp': (frames / rate).astype(np.float32), 'frame_index': frames, 'episode_index': number * same,
                   'index': before + frames, 'task_index': 0 * same}
            rows = slice(begin, begin + EXPORT.rows_in_memory)
            yield {_key(name): _padded(episode[name][rows], widths[name]) for name in widths if name not in images} | own
        before += count


def _padded(values: np.ndarray, width: list[int]) -> np.ndarray:
    """(rows, entries) of (rows, ...), each dimension padded to the largest of all episodes."""
    whole = np.full((len(values), *width), np.nan if values.dtype.kind == 'f' else 0, values.dtype)
    whole[tuple(slice(size) for size in values.shape)] = values
    return whole.reshape(len(values), int(np.prod(width, dtype=int))) if width else whole


def _arrow(values: np.ndarray) -> pa.Array:
    flat = pa.array(values.ravel())
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1]) if values.ndim > 1 and values.shape[1] > 1 else flat


def _summarise(parts: list, values: np.ndarray) -> None:
    values = np.where(np.isfinite(values), values, np.nan).astype(float).reshape(len(values), -1)
    filled, known = np.nan_to_num(values), np.isfinite(values)
    parts.append((np.where(known, values, np.inf).min(axis=0), np.where(known, values, -np.inf).max(axis=0), filled.sum(axis=0),
                  (filled**2).sum(axis=0), known.sum(axis=0), len(values)))


def _summary(parts: list) -> dict[str, list]:
    low, high, total, squares, known, rows = zip(*parts)
    count = np.sum(known, axis=0)
    mean = np.sum(total, axis=0) / np.maximum(count, 1)
    spread = np.sqrt(np.maximum(np.sum(squares, axis=0) / np.maximum(count, 1) - mean**2, 0.0))
    values = {'min': np.min(low, axis=0), 'max': np.max(high, axis=0), 'mean': mean, 'std': spread}
    return {name: np.where(count > 0, each, 0.0).tolist() for name, each in values.items()} | {'count': [int(sum(rows))]}


def _write_meta(folder: Path, columns: list[dict], widths: dict, rate: int, task: str, summary: dict) -> None:
    images = _images(widths)
    lengths = [len(next(iter(each.values()))) for each in columns]
    ends = np.cumsum(lengths)
    features = {name: {'dtype': kind, 'shape': [1], 'names': None} for name, kind in _OWN.items()}
    for name, width in widths.items():
        if name in images:
            height, across = width[:2]
            features[_key(name)] = {'dtype': 'video', 'shape': [height, across, 3], 'names': ['height', 'width', 'channels'], 'info': {
                'video.height': height, 'video.width': across, 'video.codec': 'mpeg4', 'video.pix_fmt': 'yuv420p',
                'video.is_depth_map': False, 'video.fps': rate, 'video.channels': 3, 'has_audio': False}}
        else:
            about = columns[0][name]
            features[_key(name)] = {'dtype': 'bool' if about.dtype.kind == 'b' else about.dtype.name, 'names': None,
                                    'shape': [max(1, int(np.prod(width, dtype=int)))], 'note': about.attrs.get('note', '')}
    info = {'codebase_version': 'v3.0', 'robot_type': 'tactile', 'total_episodes': len(lengths), 'total_frames': int(ends[-1]),
            'total_tasks': 1, 'chunks_size': 1000, 'data_files_size_in_mb': 100, 'video_files_size_in_mb': 200, 'fps': rate,
            'splits': {'train': f'0:{len(lengths)}'}, 'data_path': f'data/{_FILE}.parquet',
            'video_path': f'videos/{{video_key}}/{_FILE}.mp4' if images else None, 'features': features}
    rows = {'episode_index': np.arange(len(lengths)), 'tasks': [[task]] * len(lengths), 'length': lengths,
            'dataset_from_index': ends - lengths, 'dataset_to_index': ends,
            **_first_file('data', len(lengths)), **_first_file('meta/episodes', len(lengths))}
    for name in images:
        rows |= _first_file(f'videos/{_key(name)}', len(lengths))
        rows |= {f'videos/{_key(name)}/from_timestamp': (ends - lengths) / rate, f'videos/{_key(name)}/to_timestamp': ends / rate}
    (folder / 'episodes' / _FIRST).parent.mkdir(parents=True)
    pq.write_table(pa.table(rows), folder / 'episodes' / f'{_FIRST}.parquet')
    pq.write_table(_tasks(task), folder / 'tasks.parquet')
    (folder / 'info.json').write_text(json.dumps(info, indent=4))
    (folder / 'stats.json').write_text(json.dumps(summary, indent=4))


def _first_file(where: str, count: int) -> dict[str, np.ndarray]:
    return {f'{where}/{name}_index': np.zeros(count, np.int64) for name in ('chunk', 'file')}


def _tasks(task: str) -> pa.Table:
    """One row, whose text is the index of the table when pandas reads it, as LeRobot does."""
    table = pa.table({'task_index': [0], 'task': [task]})
    about = {'index_columns': ['task'], 'column_indexes': [], 'columns': [
        {'name': 'task_index', 'field_name': 'task_index', 'pandas_type': 'int64', 'numpy_type': 'int64', 'metadata': None},
        {'name': 'task', 'field_name': 'task', 'pandas_type': 'unicode', 'numpy_type': 'object', 'metadata': None}],
        'pandas_version': '2.0.0'}
    return table.replace_schema_metadata({'pandas': json.dumps(about)})
