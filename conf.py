# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the pages of the repository and the API reference. `make docs` uses it, and rosdoc2 by tactile_bringup/rosdoc2.yaml.

The source folder is the top of the repository, so that a link of a page leads to the same file here and on a Git server, and so that
rosdoc2, which executes this file beside a copy of the source folder, finds everything.
"""
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT / 'docs/extension'), str(ROOT / 'tactile_driver'), str(ROOT / 'tactile_perception'), str(ROOT / 'tactile_bringup')]

project = 'Tactile sensors for ROS 2'
author = copyright = 'The tactile authors'
extensions = ['sphinx.ext.autodoc', 'sphinx.ext.mathjax', 'numpydoc', 'myst_parser', 'headers']
root_doc = 'docs/index'
include_patterns = ['README.md', 'CONTRIBUTING.md', 'docs/**.md', 'docs/**.rst', 'tactile_driver/doc/*.md', 'test/benchmark/doc/*.md']
exclude_patterns = ['.*', 'build', 'docs_*', 'install', 'log', 'out', 'tactile_*/test', '**/__pycache__']  # need not be walked
html_theme = 'furo'
html_title = project
html_extra_path = ['docs/_extra']
html_show_sourcelink = False

myst_heading_anchors = 4
myst_enable_extensions = ['dollarmath', 'deflist']

# A machine that builds the pages needs no ROS, and no compiler.
autodoc_mock_imports = ['ament_index_python', 'builtin_interfaces', 'cv_bridge', 'diagnostic_msgs', 'geometry_msgs', 'launch', 'launch_ros',
                        'lifecycle_msgs', 'message_filters', 'rcl_interfaces', 'rclpy', 'rosbag2_py', 'rosgraph_msgs', 'rosidl_runtime_py',
                        'sensor_msgs', 'std_msgs', 'std_srvs', 'tf2_msgs', 'tf2_ros',
                        'visualization_msgs', 'tactile_msgs', 'tactile_perception._core']
autodoc_member_order = 'bysource'
autodoc_typehints = 'none'
numpydoc_show_class_members = False

# rosdoc2 would mock other modules, and add a theme and extensions of its own.
rosdoc2_settings = dict.fromkeys(('enable_autodoc', 'enable_intersphinx', 'automatically_extend_intersphinx_mapping', 'override_theme',
                                  'support_markdown', 'enable_breathe', 'enable_exhale'), False)

#: Page to what a reader who looks for it may type: the first result of the search. `check_search.py` looks whether it is.
SEARCHED = {
    'docs/stick_slip': ('stick or slip', 'stick slip', 'where is stick or slip decided'),
    'docs/controllers': ('wrench frame', 'frame of the wrench', 'age of a result'),
    'docs/gel': ('calibrate gel', 'calibrate a gel'),
    'docs/calibration': ('calibration file', 'calibrate a sensor'),
    'docs/hand': ('start a hand', 'how is a hand started', 'several sensors'),
    'docs/faults': ('unplugged camera', 'camera unplugged'),
    'docs/extending': ('add a sensor', 'how do I add a sensor', 'new sensor type', 'add an algorithm'),
    'docs/air_cushion': ('depth of the dome', 'how does the dome get its depth', 'dome depth'),
    'docs/accuracy': ('accuracy figure', 'benchmark'),
    'docs/methods': ('equation 7', 'equation 7 of the touchpad paper', 'image to dots', 'image becomes dots', 'equations of the papers'),
    'docs/README': ('parameters of a node', 'default parameters'),
    'docs/troubleshooting': ('rviz shows nothing', 'no frame arrives'),
    'docs/devices': ('serial permission', 'stable device name'),
}


def add_index_entries(app, page, source) -> None:
    """Sphinx's event source-read: put the entries of SEARCHED before a page."""
    entries = ', '.join(f'! {query}' for query in SEARCHED.get(page, ()))  # !: a main entry, which ranks before words and titles
    source[0] = (f'```{{index}} {entries}\n```\n\n' if entries else '') + source[0]


def setup(app) -> None:
    """Connect the event."""
    app.connect('source-read', add_index_entries)
