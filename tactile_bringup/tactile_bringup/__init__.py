# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Launch files, parameters, views and commands of the sensors."""
from pathlib import Path

from ament_index_python.packages import get_package_share_directory

import tactile_driver  # noqa: F401, for what it does about Ctrl-C


def share(*parts: str, package: str = 'tactile_bringup') -> str:
    """Return the path of an installed file of a package.

    Parameters
    ----------
    *parts : str
        Parts of the path in the package's share folder.
    package : str
        Name of the package.

    Returns
    -------
    str
        The path.
    """
    return str(Path(get_package_share_directory(package), *parts))
