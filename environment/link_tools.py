# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""
Make the unpacked tools part of the venv whose python runs this: importable, and `ros2` and `launch_test` as commands.

Usage: python link_tools.py TOOLS VERBS, the folder that fetch_tools.py filled and the folder of this project's own ros2 verbs.
"""

import pathlib
import sys
import sysconfig

COMMANDS = {'ros2': 'ros2cli.cli', '_ros2_daemon': 'ros2cli.daemon', 'launch_test': 'launch_testing.launch_test'}
VERBS = '[ros2cli.command]\nlaunch = tactile_ros2_verbs.launch:LaunchCommand\n'
SCRIPT = """#!{python}
import sys

from {module} import main

sys.exit(main())
"""


def write_commands(bin_folder):
    """Write the console scripts that pip would have made."""
    for name, module in COMMANDS.items():
        script = bin_folder / name
        script.write_text(SCRIPT.format(python=sys.executable, module=module))
        script.chmod(0o755)


def register_verbs(site_packages):
    """Write the metadata by which ros2cli finds the verbs."""
    metadata = site_packages / 'tactile_ros2_verbs-0.1.0.dist-info'
    metadata.mkdir(exist_ok=True)
    (metadata / 'METADATA').write_text('Metadata-Version: 2.1\nName: tactile-ros2-verbs\nVersion: 0.1.0\n')
    (metadata / 'entry_points.txt').write_text(VERBS)


def main():
    """Write the path file, the commands and the verbs' metadata."""
    tools, verbs = sys.argv[1:3]
    site_packages = pathlib.Path(sysconfig.get_paths()['purelib'])
    (site_packages / 'tactile_ros_tools.pth').write_text(f'{tools}/python\n{verbs}\n')
    write_commands(pathlib.Path(sys.executable).parent)
    register_verbs(site_packages)


if __name__ == '__main__':
    main()
