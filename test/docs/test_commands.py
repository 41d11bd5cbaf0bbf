# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every command of the documentation names packages, launch files, arguments, options and topics that exist."""
import functools
import io
import re
import runpy
import shlex
import sys
from contextlib import redirect_stdout
from pathlib import Path
from unittest import mock

import pytest
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from pages import ALL_PAGES, ROOT, commands, files, indented_commands

VERBS = ('topic', 'service', 'param', 'node', 'bag')
TOPICS = {'friction', 'image_raw', 'camera_info', 'time_reference', 'voltages', 'description', 'dots', 'contact_region', 'contacts', 'slip',
          'wrench', 'markers', 'image_annotated', 'points', 'set_reference', 'object', 'diagnostics'}
ALL = [pytest.param(page, command, id=f'{page.stem}: {command[:90]}') for page in ALL_PAGES
       for command in commands(page) + indented_commands(page)]


@functools.cache
def launch_arguments(package, file):
    """Names of the arguments that a launch file takes."""
    from launch.launch_description_sources import get_launch_description_from_python_launch_file
    path = Path(get_package_share_directory(package), 'launch', file)
    assert path.is_file(), f'{package} has no launch file {file}'
    return {argument.name for argument in get_launch_description_from_python_launch_file(str(path)).get_launch_arguments()}


@functools.cache
def options(package, executable):
    """What --help says of an executable."""
    path = Path(get_package_prefix(package), 'lib', package, executable)
    assert path.is_file(), f'{package} has no executable {executable}'
    with redirect_stdout(io.StringIO()) as said, mock.patch.object(sys, 'argv', [str(path), '--help']), pytest.raises(SystemExit):
        runpy.run_path(str(path), run_name='__main__')
    return said.getvalue()


def check_launch(words, _page):
    known = launch_arguments(words[2], words[3])
    for word in words[4:]:
        assert word.split(':=')[0] in known, f'{words[3]} takes no argument {word}'


def check_run(words, _page):
    own = words[4:words.index('--ros-args')] if '--ros-args' in words else words[4:]
    given = [word for word in own if word.startswith('--')]
    if given:
        known = options(words[2], words[3])
        assert not [word for word in given if word not in known], f'{words[3]} takes not all of {given}'
    else:
        assert Path(get_package_prefix(words[2]), 'lib', words[2], words[3]).is_file(), f'{words[2]} has no executable {words[3]}'


def check_python(words, page):
    assert words[1] in files(page) or (ROOT / words[1]).is_file(), f'{words[1]} exists neither on the page nor in the repository'


def check_make(words, _page):
    assert f'\n{words[1]}:' in (ROOT / 'Makefile').read_text()


def check_copy(words, _page):
    assert len(words) == 3


def check_ros2(words, page):
    verb = words[1]
    if verb in ('launch', 'run'):
        return {'launch': check_launch, 'run': check_run}[verb](words, page)
    assert verb in VERBS, f'ros2 {verb} is not in every environment'
    for word in words[3:]:
        if word.startswith('/') and verb in ('topic',):
            assert word.split('/')[-1] in TOPICS, f'no node publishes {word}'
    return None


CHECKS = {'ros2': check_ros2, 'python3': check_python, 'make': check_make, 'cp': check_copy}


@pytest.mark.parametrize('page, command', ALL)
def test_the_command_names_what_exists(page, command):
    words = shlex.split(re.sub(r'\$\(ros2 pkg prefix (\w+)\)', lambda match: get_package_prefix(match[1]), command))
    assert words[0] in CHECKS, f'no test knows how to check {words[0]}'
    CHECKS[words[0]](words, page)
    for path in (word.split(':=')[-1] for word in words if '/share/' in word):
        assert Path(path).is_file(), f'{path} is not installed'
