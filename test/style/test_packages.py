# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""package.xml, setup.py, the change log and the folders agree."""

import pathlib
import re
import xml.etree.ElementTree

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON_PACKAGES = ('tactile_driver', 'tactile_perception', 'tactile_bringup')
PACKAGES = ('tactile_msgs',) + PYTHON_PACKAGES
# What an import needs in package.xml, where the rosdep key is another name than the module.
KEYS = {'cv2': 'python3-opencv', 'numpy': 'python3-numpy', 'scipy': 'python3-scipy', 'yaml': 'python3-yaml', 'serial': 'python3-serial',
        'matplotlib': 'python3-matplotlib', 'rosbags': 'python3-rosbags-pip', 'psutil': 'python3-psutil', 'PIL': 'python3-pil'}
ROS_MODULE = re.compile(
    r'rclpy|launch(_ros)?|cv_bridge|message_filters|diagnostic_updater|ament_index_python|\w+_msgs|\w+_srvs|tactile_\w+')


def manifest(package):
    return xml.etree.ElementTree.parse(ROOT / package / 'package.xml').getroot()


def keyword(package, name):
    return re.search(rf"{name}='([^']*)'", (ROOT / package / 'setup.py').read_text()).group(1)


def imported(package):
    text = '\n'.join(path.read_text() for folder in (package, 'launch') for path in (ROOT / package / folder).rglob('*.py'))
    return set(re.findall(r'^\s*(?:from|import) (\w+)', text, re.MULTILINE)) - {package}


def test_manifests_are_complete():
    for package in PACKAGES:
        root = manifest(package)
        assert root.get('format') == '3', package
        assert [root.findtext(tag) for tag in ('name', 'license')] == [package, 'Apache-2.0']
        assert root.findtext('export/build_type') == ('ament_python' if (ROOT / package / 'setup.py').is_file() else 'ament_cmake'), package
        assert root.findtext('version') == manifest('tactile_msgs').findtext('version'), package


def test_setup_says_what_the_manifest_says():
    for package in ('tactile_driver', 'tactile_bringup'):
        said = {name: manifest(package).findtext(name) for name in ('version', 'description', 'license')}
        assert {name: keyword(package, name) for name in said} == said
        assert (ROOT / package / 'resource' / package).is_file()


def test_every_import_is_declared():
    for package in PYTHON_PACKAGES:
        declared = {element.text for element in manifest(package) if element.tag.endswith('depend')}
        needed = {KEYS.get(name, name) for name in imported(package) if name in KEYS or ROS_MODULE.fullmatch(name)}
        assert needed <= declared, package


@pytest.mark.parametrize('package', PYTHON_PACKAGES)
def test_every_console_script_has_its_module(package):
    listed = next(path for name in ('setup.py', 'CMakeLists.txt') if (path := ROOT / package / name).is_file()).read_text()
    scripts = re.findall(rf"^ +'?(\w+) (?:= )?{package}\.([\w.]+)", listed, re.MULTILINE)
    files = [ROOT / package / package / (module.replace('.', '/') + '.py') for _, module in scripts]
    assert scripts and [file for file in files if 'def main(' not in file.read_text()] == []


def test_change_log_names_the_version():
    assert f"{manifest('tactile_msgs').findtext('version')} (" in (ROOT / 'CHANGELOG.rst').read_text()
