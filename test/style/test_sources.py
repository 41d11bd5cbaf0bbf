# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rules that every source file of the repository keeps, checked by machine."""

import ast
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = '# Copyright 2026 The tactile authors\n# SPDX-License-Identifier: Apache-2.0\n'
ROS_MODULES = re.compile(
    r'(rclpy|launch\w*|cv_bridge|message_filters|diagnostic_updater|ament_index_python|rosidl\w*|\w+_msgs|\w+_srvs)(\.|$)')
MAY_IMPORT_ROS = re.compile(r'(tactile_\w+/tactile_\w+/nodes/|tactile_bringup/|environment/|test/|tactile_\w+/test/)')
ABSOLUTE_PATH = re.compile(r"""['"](/home/|/root/|/work/|/tmp/|/dev/video\d|/opt/ros|/usr/)""")
LINES_OF_A_FILE = 400
LINES_OF_A_FUNCTION = 60


def sources(*suffixes):
    """Return the files of the repository that git knows or would add, with one of the suffixes, as paths relative to the root."""
    command = ['git', 'ls-files', '--cached', '--others', '--exclude-standard']
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return [name for name in sorted(listed.stdout.splitlines()) if name.endswith(suffixes) and (ROOT / name).is_file()]


PYTHON = sources('.py')
CODE = [name for name in PYTHON if '/test/' not in name and not name.startswith('test/')]


def tree_of(name):
    return ast.parse((ROOT / name).read_text(), filename=name)


@pytest.mark.parametrize('name', sources('.py', '.bash', '.msg', 'CMakeLists.txt', 'Makefile', '.yaml'))
def test_has_the_licence_header(name):
    assert HEADER in (ROOT / name).read_text()[:200]


@pytest.mark.parametrize('name', sources('.py', '.bash', '.msg', '.md', '.rst', '.yaml'))
def test_has_no_trailing_blanks_and_ends_with_a_newline(name):
    text = (ROOT / name).read_text()
    assert not re.search(r'[ \t]+$', text, re.MULTILINE)
    assert not text or (text.endswith('\n') and not text.endswith('\n\n'))


@pytest.mark.parametrize('name', PYTHON)
def test_file_is_not_too_long(name):
    assert len((ROOT / name).read_text().splitlines()) <= LINES_OF_A_FILE


@pytest.mark.parametrize('name', PYTHON)
def test_functions_are_not_too_long(name):
    functions = [node for node in ast.walk(tree_of(name)) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
    long = {node.name: node.end_lineno - node.lineno + 1 for node in functions if node.end_lineno - node.lineno >= LINES_OF_A_FUNCTION}
    assert not long


@pytest.mark.parametrize('name', CODE)
def test_ros_is_imported_in_nodes_only(name):
    if MAY_IMPORT_ROS.match(name):
        return
    imported = []
    for node in ast.walk(tree_of(name)):
        if isinstance(node, ast.Import):
            imported += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            imported.append(node.module)
    assert not [module for module in imported if ROS_MODULES.match(module)]


@pytest.mark.parametrize('name', CODE)
def test_simulation_and_estimators_share_nothing(name):
    text = (ROOT / name).read_text()
    if name.startswith('tactile_driver/'):
        assert 'tactile_perception' not in re.sub(r'#.*|"""(.|\n)*?"""', '', text)
    if name.startswith('tactile_perception/'):
        # The converter of recordings writes their ground truth in the form that a simulated sensor has it: a record, no formula.
        allowed = r'(?!\.truth )' if '/offline/' in name else ''
        assert not re.search(r'(import|from) tactile_driver\.simulation' + allowed, text)


@pytest.mark.parametrize('name', CODE)
def test_has_no_absolute_path(name):
    assert not ABSOLUTE_PATH.search((ROOT / name).read_text())


def test_ruff_finds_nothing():
    found = subprocess.run([sys.executable, '-m', 'ruff', 'check', '--no-cache', '--output-format', 'concise', '.'], cwd=ROOT,
                           capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


def test_codespell_finds_nothing():
    names = sources('.py', '.bash', '.msg', '.md', '.rst', '.yaml', '.xml')
    found = subprocess.run([sys.executable, '-m', 'codespell_lib', '--ignore-words-list', 'empy,nd,ans', *names], cwd=ROOT,
                           capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
