# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants of exported files."""
from dataclasses import dataclass

from tactile_driver.constants import constant


@dataclass(frozen=True)
class ExportConstants:
    """Constants of exported files."""

    rows_in_memory: int = constant(256, '1', 'limit', 'rows of a table that are in memory at once')
    chunk_bytes: int = constant(1 << 18, 'byte', 'numeric', 'of an array in the file')
    max_compressed_row: int = constant(1 << 16, 'byte', 'measured',
                                       'a larger row is an image of a camera: lzf would save 13 % of it, and cost 6.4 ms for 640 x 480 x 3')
    buffered_bytes: int = constant(1 << 18, 'byte', 'limit', 'of a column in memory')


EXPORT = ExportConstants()
