# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""package.xml, what the code imports, setup.py or CMakeLists.txt, the change logs, and rosdep's lists agree."""

import ast
import os
import pathlib
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree

import pytest
import yaml
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package_version import get_forthcoming_label

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON_PACKAGES = ('tactile_driver', 'tactile_perception', 'tactile_bringup')
PACKAGES = ('tactile_msgs',) + PYTHON_PACKAGES
#: Keys of package.xml that are named otherwise than the module that is imported or the package that CMake finds.
KEYS = {'cv2': 'python3-opencv', 'numpy': 'python3-numpy', 'scipy': 'python3-scipy', 'yaml': 'python3-yaml', 'serial': 'python3-serial',
        'matplotlib': 'python3-matplotlib', 'psutil': 'python3-psutil', 'PIL': 'python3-pil', 'pytest': 'python3-pytest',
        'hypothesis': 'python3-hypothesis', 'catkin_pkg': 'python3-catkin-pkg-modules', 'Eigen3': 'eigen', 'pybind11': 'pybind11_vendor',
        'Python3': 'python3-dev', 'packaging': 'python3-packaging'}
#: Needed when the packages run, imported by nobody: the storage plugin of MCAP, the command `ros2 launch`, the limit in pytest.ini.
RUN_TIME = {'rosbag2_storage_mcap', 'ros2launch', 'rosidl_default_runtime', 'python3-pytest-timeout'}
#: Used where they are installed: what the benchmark compares with and reads old recordings with, and environment/extras.txt.
OPTIONAL = {'trackpy', 'rosbags', 'rerun', 'h5py', 'zarr', 'pyarrow', 'distributed'}


def manifest(package):
    return xml.etree.ElementTree.parse(ROOT / package / 'package.xml').getroot()


def declared(package, *tags):
    return {element.text for element in manifest(package) if element.tag in tags}


def is_cmake(package):
    return manifest(package).findtext('export/build_type') == 'ament_cmake'


def without_comments(text):
    return re.sub(r'#.*', '', text)


def imported(*folders, own=()):
    """Keys of the modules that the Python files import, but for Python's own, the project's own, and those that may be missing."""
    files = [path for folder in folders for path in (ROOT / folder).rglob('*.py')]
    found = set()
    for path in files:
        tree = ast.parse(path.read_text())
        attempts = [block for block in ast.walk(tree) if isinstance(block, ast.Try)
                    and any(isinstance(handler.type, ast.Name) and handler.type.id == 'ImportError' for handler in block.handlers)]
        optional = {id(node) for block in attempts for statement in block.body for node in ast.walk(statement)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Import) and id(node) not in optional:
                found |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and id(node) not in optional:
                found.add(node.module.split('.')[0])
    return {KEYS.get(name, name) for name in found - set(own) - set(sys.stdlib_module_names)}


def found_by_cmake(package):
    names = set(re.findall(r'find_package\((\w+)', without_comments((ROOT / package / 'CMakeLists.txt').read_text())))
    return {KEYS.get(name, name) for name in names}


def test_manifests_are_complete():
    for package in PACKAGES:
        root = manifest(package)
        assert root.get('format') == '3', package
        assert [root.findtext(tag) for tag in ('name', 'license')] == [package, 'Apache-2.0']
        assert (ROOT / package / 'CMakeLists.txt').is_file() == is_cmake(package) != (ROOT / package / 'setup.py').is_file(), package
        assert root.findtext('version') == manifest('tactile_msgs').findtext('version'), package


def test_all_manifests_name_the_same_addresses():
    def addresses(package):
        root = manifest(package)
        return [(url.get('type'), url.text) for url in root.findall('url')], root.find('maintainer').get('email')
    assert all(addresses(package) == addresses(PACKAGES[0]) for package in PACKAGES)


def test_setup_says_what_the_manifest_says():
    for package in (name for name in PACKAGES if not is_cmake(name)):
        text = (ROOT / package / 'setup.py').read_text()
        said = {name: manifest(package).findtext(name) for name in ('version', 'description', 'license', 'maintainer')}
        said['maintainer_email'] = manifest(package).find('maintainer').get('email')
        assert {name: re.search(rf"{name}='([^']*)'", text).group(1) for name in said} == said
        assert (ROOT / package / 'resource' / package).is_file()


@pytest.mark.parametrize('package', PYTHON_PACKAGES)
def test_what_is_imported_is_declared_and_nothing_else(package):
    code = imported(f'{package}/{package}', f'{package}/launch', own={package, *OPTIONAL})
    assert code == declared(package, 'depend', 'exec_depend') - RUN_TIME


@pytest.mark.parametrize('package', PYTHON_PACKAGES)
def test_what_tests_import_is_declared_and_nothing_else(package):
    # What needs more than one package is tested at the top level; the topmost package declares it.
    folders = [f'{package}/test', 'test'] if package == PYTHON_PACKAGES[-1] else [f'{package}/test']
    helpers = {path.stem for folder in ('test', *(f'{name}/test' for name in PYTHON_PACKAGES)) for path in (ROOT / folder).rglob('*.py')}
    imports = imported(*folders, own=helpers | {package, *OPTIONAL})
    at_run_time, for_tests = declared(package, 'depend', 'exec_depend'), declared(package, 'test_depend') - RUN_TIME
    assert imports <= at_run_time | for_tests
    assert for_tests <= (imports - at_run_time) | (found_by_cmake(package) if is_cmake(package) else set())


@pytest.mark.parametrize('package', PACKAGES)
def test_what_cmake_finds_is_declared_and_nothing_else(package):
    if not is_cmake(package):
        pytest.skip(f'{package} is built by setuptools')
    at_build_time = declared(package, 'depend', 'build_depend', 'buildtool_depend')
    assert at_build_time <= found_by_cmake(package) <= at_build_time | declared(package, 'test_depend')


@pytest.mark.parametrize('package', PYTHON_PACKAGES)
def test_every_console_script_has_its_module(package):
    text = (ROOT / package / ('CMakeLists.txt' if is_cmake(package) else 'setup.py')).read_text()
    scripts = re.findall(rf"^ +'?\w+ (?:= )?{package}\.([\w.]+):?(\w*)", text, re.MULTILINE)
    texts = {script: (ROOT / package / package / (script[0].replace('.', '/') + '.py')).read_text() for script in scripts}
    missing = [script for script, text in texts.items() if not re.search(rf'^(def |class )?{script[1] or "main"}( =|\()', text, re.M)]
    assert texts and missing == []


@pytest.fixture(scope='module')
def rosdistro():
    """The folder with rosdep's lists and Jazzy's distribution file."""
    recordings = os.environ.get('TACTILE_RECORDINGS')
    folder = pathlib.Path(os.environ.get('TACTILE_ROSDISTRO') or (pathlib.Path(recordings).parent / 'rosdistro' if recordings else ''))
    if not (folder / 'jazzy' / 'distribution.yaml').is_file():
        pytest.skip('TACTILE_ROSDISTRO names no folder with rosdep/*.yaml and jazzy/distribution.yaml of github.com/ros/rosdistro')
    return folder.resolve()


def by_apt(entry):
    """Whether an entry of rosdep's lists names packages of apt for Ubuntu 24.04."""
    entry = entry.get('ubuntu', {}) if isinstance(entry, dict) else {}
    if isinstance(entry, dict):
        entry = entry.get('noble', entry.get('*', entry.get('apt', {})))
    if isinstance(entry, dict):
        entry = entry.get('packages', entry.get('apt', {}).get('packages', ()))
    return bool(entry) and all(isinstance(name, str) for name in entry)


def test_every_key_is_a_package_of_jazzy_or_of_apt(rosdistro):
    loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
    lists = [yaml.load((rosdistro / 'rosdep' / f'{name}.yaml').read_bytes(), loader) for name in ('base', 'python')]
    jazzy = set(PACKAGES)
    for name, repository in yaml.load((rosdistro / 'jazzy' / 'distribution.yaml').read_bytes(), loader)['repositories'].items():
        jazzy |= set(repository.get('release', {}).get('packages', [name] if 'release' in repository else []))
    keys = {element.text for package in PACKAGES for element in manifest(package) if element.tag.endswith('depend')}
    assert len(keys) > 20
    assert [key for key in sorted(keys - jazzy) if not any(by_apt(entries.get(key)) for entries in lists)] == []


@pytest.mark.full
def test_rosdep_installs_by_apt_alone(rosdistro, tmp_path, monkeypatch):
    rosdep = shutil.which('rosdep')
    if not rosdep:
        pytest.skip('rosdep is not installed')
    (tmp_path / 'lists').mkdir()
    (tmp_path / 'lists' / '20-default.list').write_text(
        ''.join(f'yaml {(rosdistro / "rosdep" / name).as_uri()}.yaml\n' for name in ('base', 'python')))
    for name, value in {'ROSDEP_SOURCE_PATH': str(tmp_path / 'lists'), 'ROS_HOME': str(tmp_path / 'home'), 'ROS_DISTRO': 'jazzy',
                        'ROS_OS_OVERRIDE': 'ubuntu:24.04:noble', 'ROSDISTRO_INDEX_URL': (rosdistro / 'index-v4.yaml').as_uri()}.items():
        monkeypatch.setenv(name, value)
    subprocess.run([rosdep, 'update', '--rosdistro', 'jazzy'], check=True, capture_output=True)
    said = subprocess.run([rosdep, 'install', '--simulate', '--from-paths', *(str(ROOT / name) for name in PACKAGES), '--ignore-src', '-y'],
                          capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    lines = [line.strip() for line in said.stdout.splitlines() if line.strip() and not line.startswith('#')]
    assert lines and [line for line in lines if 'apt-get install' not in line] == []


@pytest.mark.parametrize('package', PACKAGES)
def test_catkin_pkg_reads_each_change_log(package):
    log = get_changelog_from_path(str(ROOT / package), package)
    assert log is not None and 'Changelog for package ' + package in log.rst
    # Before a release its changes stand under the label that catkin_prepare_release renames, after it under the version.
    assert get_forthcoming_label(log.rst) or log.get_content_of_version(manifest(package).findtext('version'))
