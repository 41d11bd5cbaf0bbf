# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The first image of a reference in a file: a process that starts again under a contact has no other one of the untouched sensor."""
from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np

from ..core.errors import BadArgument


class KeptImage:
    """path: of a file (.npy), '' for none. Raises BadArgument for a path in no folder."""

    def __init__(self, path: str):
        self._path, self._is_written = Path(path).expanduser() if path else None, False
        if self._path and not self._path.parent.is_dir():
            raise BadArgument(f'reference_file {path}: there is no folder {self._path.parent}')

    def read(self, shape: tuple[int, ...]) -> np.ndarray | None:
        """The image, uint8; None without a file, and for one of another shape."""
        image = None
        if self._path:
            with suppress(OSError, ValueError, EOFError):
                image = np.load(self._path, allow_pickle=False)
        self._is_written = isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.shape == shape
        return image if self._is_written else None

    def add(self, image: np.ndarray) -> None:
        """Write an image, of which the first one since the start or remove is kept, if the folder can be written."""
        if self._path and not self._is_written:
            self._is_written = True
            part = self._path.with_name(f'{self._path.name}.part')
            with suppress(OSError):
                with part.open('wb') as file:
                    np.save(file, image)
                part.replace(self._path)

    def remove(self) -> None:
        """Remove the file: the image no longer shows the reference."""
        self._is_written = False
        if self._path:
            with suppress(OSError):
                self._path.unlink(missing_ok=True)
