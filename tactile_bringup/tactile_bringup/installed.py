# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Files of this package where it is installed."""
from __future__ import annotations

from pathlib import Path

from ament_index_python.packages import get_package_share_directory


def share(*parts: str) -> str:
    """The path of an installed file of this package."""
    return str(Path(get_package_share_directory('tactile_bringup'), *parts))
