# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The bags of the presses of a guided calibration, which continue an interrupted one."""
from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.recordings.writer import write_messages


class PressBags:
    """Bags of one press each, which start with untouched images. folder: of all; namespace: of the topics."""

    def __init__(self, folder: Path, namespace: str):
        self.folder, self._namespace = folder, namespace

    def __len__(self) -> int:
        return len(self.paths)

    @property
    def paths(self) -> list[Path]:
        """The bags in their order."""
        return sorted(self.folder.glob('press_*'))

    def add(self, messages: Iterable[tuple[int, str, object]]) -> None:
        """Write a bag of (stamp in ns, topic, message), under another name first, so that no bag is incomplete."""
        number = 1 + max((int(bag.name.removeprefix('press_')) for bag in self.paths), default=0)
        unfinished = self.folder / 'unfinished'
        shutil.rmtree(unfinished, ignore_errors=True)
        self.folder.mkdir(parents=True, exist_ok=True)
        write_messages(unfinished, self._namespace, messages)
        unfinished.rename(self.folder / f'press_{number:03d}')

    def remove_last(self) -> None:
        """Remove the newest bag."""
        shutil.rmtree(self.paths[-1])

    def presses(self) -> list[tuple[np.ndarray, list[float]]]:
        """(position (2,) m, depths m) of each press."""
        found = []
        for bag in self.paths:
            with BagReader(bag) as reader:
                topics = {topic for topic in reader.topics if topic.endswith('ground_truth/contacts')}
                contacts = [decode(raw.data, raw.type_name).contacts for raw in reader.messages(topics)]
            touches = [contact[0] for contact in contacts if contact]
            positions = [[touch.position.x, touch.position.y] for touch in touches] or np.zeros((1, 2))
            found.append((np.mean(positions, axis=0), sorted({round(touch.depth, 5) for touch in touches})))
        return found

    def first_images(self) -> list:
        """The first image message of each camera of the first bag; none without a bag."""
        if not self.paths:
            return []
        with BagReader(self.paths[0]) as reader:
            images = sorted(topic for topic in reader.topics if topic.endswith('image_raw'))
            firsts = [next(iter(reader.messages({topic}))) for topic in images]
            return [decode(raw.data, raw.type_name) for raw in firsts]
