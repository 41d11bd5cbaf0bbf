# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rules that every source file of the repository keeps, checked by machine. What comes from files, messages and bags is data: no name in it
is called, imported, or run. The message definitions are the contract's, field by field."""
import ast
import functools
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = '# Copyright 2026 The tactile authors\n# SPDX-License-Identifier: Apache-2.0\n'
ABSOLUTE_PATH = re.compile(r"""['"](/home/|/root/|/work/|/tmp/|/dev/video\d|/opt/ros|/usr/)""")
LINES_OF_A_FILE = 600
LINES_OF_A_FUNCTION = 60
ARGUMENTS_OF_A_FUNCTION = 6  # besides self


def sources(*suffixes):
    """Return the files of the repository that git knows or would add, with one of the suffixes, as paths relative to the root."""
    command = ['git', 'ls-files', '--cached', '--others', '--exclude-standard']
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return [name for name in sorted(listed.stdout.splitlines()) if name.endswith(suffixes) and (ROOT / name).is_file()]


PYTHON = sources('.py')
CODE = [name for name in PYTHON if '/test/' not in name and not name.startswith('test/')]


def text_of(name):
    return (ROOT / name).read_text()


@functools.cache
def parsed(name):
    """Return (modules that a file imports by their full names, names of its functions that are too long, of those with many arguments)."""
    imports, long, wide = [], [], []
    for node in ast.walk(ast.parse(text_of(name), filename=name)):
        if isinstance(node, ast.Import):
            imports += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            imports.append(node.module)
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            given = {each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)} - {'self', 'cls'}
            long += [node.name] * (node.end_lineno - node.lineno >= LINES_OF_A_FUNCTION)
            wide += [node.name] * (len(given) > ARGUMENTS_OF_A_FUNCTION)
    return imports, long, wide


def test_files_have_the_licence_header():
    names = sources('.py', '.bash', '.msg', 'CMakeLists.txt', 'Makefile', '.yaml')
    assert [name for name in names if HEADER not in text_of(name)[:200]] == []


def test_a_sensor_type_is_named_in_its_folders_and_a_few_lists():
    named = {name for name in CODE + sources('.cpp', '.hpp', '.xacro') if '/force_taxels/' not in name and 'force_taxel' in text_of(name)}
    gripper = {f'tactile_bringup/tactile_bringup/grasp/{name}.py' for name in ('force_pad', 'objects')}  # its pad is such a sensor
    assert named - gripper == {
        'tactile_bringup/launch/force_taxels.launch.py', 'tactile_bringup/urdf/tactile_sensors.xacro', 'tactile_driver/setup.py',
        'tactile_perception/tactile_perception/core/sensor_type.py'}


def test_lines_have_no_trailing_blanks_and_files_end_with_one_newline():
    texts = {name: text_of(name) for name in sources('.py', '.bash', '.msg', '.md', '.rst', '.yaml')}
    assert [name for name, text in texts.items()
            if re.search(r'[ \t]+$', text, re.MULTILINE) or (text and (not text.endswith('\n') or text.endswith('\n\n')))] == []


def test_files_and_functions_are_not_too_long():
    long = [name for name in PYTHON if len(text_of(name).splitlines()) > LINES_OF_A_FILE]
    assert long + [f'{name}: {function}' for name in PYTHON for function in parsed(name)[1]] == []


def test_functions_have_few_arguments():
    assert [f'{name}: {function}' for name in CODE for function in parsed(name)[2]] == [], 'group what belongs together'


def test_bags_are_read_and_written_by_rosbag2_py_alone():
    # test/benchmark reads recordings of ROS 1, which rosbag2_py does not.
    users = {name for name in PYTHON if any(re.match(r'(rosbags|mcap)(\.|$)', module) for module in parsed(name)[0])}
    assert users <= {'environment/python/rosbag2_py/_files.py', 'test/benchmark/taxel_slip.py'}


def test_simulation_and_estimators_share_nothing():
    driver = {name: re.sub(r'#.*|"""(.|\n)*?"""', '', text_of(name)) for name in CODE if name.startswith('tactile_driver/')}
    assert [name for name, text in driver.items() if 'tactile_perception' in text] == []
    # The converter of recordings writes their ground truth in the form that a simulated sensor has it: a record, no formula.
    converts = ('/tools/convert/', '/finger/tools.py')
    forbidden = {name: r'(import|from) tactile_driver\.simulation' + (r'(?!\.truth )' if any(part in name for part in converts) else '')
                 for name in CODE if name.startswith('tactile_perception/')}
    assert [name for name, pattern in forbidden.items() if re.search(pattern, text_of(name))] == []


def test_code_has_no_absolute_path():
    assert [name for name in CODE if ABSOLUTE_PATH.search(text_of(name))] == []


def test_rclpy_is_used_by_its_public_names_alone():
    private = re.compile(r'_rclpy|rclpy\.impl\b|\.handle\b(?!\()')
    assert [name for name in CODE if re.match(r'tactile_', name) and private.search(text_of(name))] == []


def test_ruff_finds_nothing():
    found = subprocess.run([sys.executable, '-m', 'ruff', 'check', '--no-cache', '--output-format', 'concise', '.'], cwd=ROOT,
                           capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


def test_codespell_finds_nothing():
    names = sources('.py', '.bash', '.msg', '.md', '.rst', '.yaml', '.xml')
    found = subprocess.run([sys.executable, '-m', 'codespell_lib', *names], cwd=ROOT,
                           capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


CALLS = {'eval', 'exec', 'compile', '__import__'}
MODULES = {'pickle', 'marshal', 'shelve', 'subprocess', 'pty', 'code', 'runpy', 'dill', 'joblib'}
SYSTEM = {'system', 'popen', 'startfile', 'spawnl', 'spawnv', 'execv', 'execl', 'execvp', 'posix_spawn'}
UNSAFE_YAML = {'unsafe_load', 'unsafe_load_all', 'full_load', 'full_load_all', 'load_all', 'UnsafeLoader', 'FullLoader', 'Loader',
               'CLoader', 'UnsafeConstructor', 'FullConstructor'}
#: Where one of these is right, and why.
ALLOWED: dict[str, set[str]] = {'tactile_bringup/tactile_bringup/view/viewer.py': {'subprocess'}}  # it starts Rerun's viewer
#: Where modules are imported by name, each from a table or an entry point in the code itself.
IMPORTERS = {'tactile_perception/tactile_perception/core/sensor_type.py', 'tactile_perception/tactile_perception/__init__.py',
             'tactile_driver/tactile_driver/plugins.py'}


def found_in(name):
    """What a file has of all these."""
    for node in ast.walk(ast.parse(text_of(name), filename=name)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CALLS:
            yield node.func.id
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split('.')[0] in MODULES)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module.split('.')[0] in MODULES:
            yield node.module
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id == 'os' and node.attr in SYSTEM) or (node.value.id == 'yaml' and node.attr in UNSAFE_YAML):
                yield f'{node.value.id}.{node.attr}'
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == 'yaml.load' and len(node.args) + len(node.keywords) < 2:
            yield 'yaml.load without a loader'
        elif isinstance(node, ast.keyword) and node.arg == 'allow_pickle' and getattr(node.value, 'value', True):
            yield 'allow_pickle'


def test_input_cannot_execute_code():
    found = {name: set(found_in(name)) - ALLOWED.get(name, set()) for name in CODE if name.startswith('tactile_')}
    assert {name: what for name, what in found.items() if what} == {}


def test_modules_are_imported_by_name_in_few_files():
    assert {name for name in CODE if name.startswith('tactile_') and re.search('import_module|resolve_name', text_of(name))} == IMPORTERS


MESSAGES = pathlib.Path(__file__).resolve().parents[2] / 'tactile_msgs' / 'msg'
NAMES = sorted(path.stem for path in MESSAGES.glob('*'))


def definition(name):
    """Return [(field, comment), ...] of a message file, comment lines and empty ones left out."""
    lines = [line for line in (MESSAGES / f'{name}.msg').read_text().splitlines() if line.strip() and not line.lstrip().startswith('#')]
    return [(' '.join(line.partition('#')[0].split()), line.partition('#')[2].strip()) for line in lines]


def test_every_field_has_a_comment():
    assert [(name, field) for name in NAMES for field, comment in definition(name) if not comment] == []


def test_comments_are_beside_their_fields():
    # `ros2 interface show` puts the fields of a nested type in between
    lines = [(name, line) for name in NAMES for line in (MESSAGES / f'{name}.msg').read_text().splitlines()]
    assert [(name, line) for name, line in lines if line.lstrip().startswith('#') and line != line.lstrip()] == []
