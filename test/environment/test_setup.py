# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""setup.bash leaves the user's shell whole, does nothing when nothing is missing, and finds what it promises; what it fixes in wheels and
pins; `ros2 launch` as it is there."""
import fcntl
import importlib.util
import os
import pathlib
import signal
import subprocess
import sysconfig

import numpy
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = pathlib.Path(__file__).resolve().parents[2]


def shell(script, **variables):
    """Run the script in a bash of its own, far from the checkout; return the finished process."""
    return subprocess.run(['bash', '-c', script], cwd='/', capture_output=True, text=True, timeout=120,
                          env=dict(os.environ, ROOT=str(ROOT), **variables))


@pytest.mark.parametrize('options', ['+eu', '-eu'])
def test_options_of_the_shell_stay(options):
    done = shell(f'set {options}; before=$-; source "$ROOT/setup.bash"; test "$before" = "$-" && echo same')
    assert done.stdout.strip() == 'same', done.stderr


def test_sourced_twice_it_adds_nothing():
    done = shell('source "$ROOT/setup.bash"; first=$PATH:$PYTHONPATH:$AMENT_PREFIX_PATH; source "$ROOT/setup.bash"; '
                 'test "$first" = "$PATH:$PYTHONPATH:$AMENT_PREFIX_PATH" && echo same')
    assert done.stdout.strip() == 'same', done.stderr


def test_no_step_is_taken_when_nothing_is_missing():
    shell('source "$ROOT/setup.bash"')
    done = shell('source "$ROOT/setup.bash"')
    assert (done.returncode, done.stdout, done.stderr) == (0, '', '')


def test_commands_and_packages_are_found():
    done = shell('source "$ROOT/setup.bash"; command -v ros2 colcon pytest && ros2 pkg list')
    assert {'tactile_msgs', 'tactile_driver', 'tactile_perception', 'tactile_bringup'} <= set(done.stdout.split()), done.stderr


@pytest.mark.skipif('TACTILE_FALLBACK' not in os.environ, reason='only where setup.bash installs ROS 2 itself')
def test_bytecode_of_what_is_installed_is_there():
    script = ('import os, sys, tactile_perception.tools.process_bag; '
              'print(*(module.__cached__ for module in list(sys.modules.values()) if getattr(module, "__cached__", None)), sep="\\n")')
    done = shell(f"source \"$ROOT/setup.bash\"; python3 -c '{script}'")
    files = [file for file in done.stdout.splitlines() if not file.startswith(f'{ROOT}/tactile_')]  # of what is edited here it may be old
    assert len(files) > 100, done.stderr
    assert not [file for file in files if not os.path.exists(file)]


def test_run_instead_of_sourced_it_says_so():
    done = subprocess.run(['bash', str(ROOT / 'setup.bash')], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert 'source setup.bash' in done.stderr


def test_missing_compiler_is_named_with_the_line_to_type(tmp_path):
    for command in ('cut', 'python3', 'tr', 'uname', 'cmake', 'make'):
        (tmp_path / command).symlink_to(subprocess.check_output(['bash', '-c', f'command -v {command}'], text=True).strip())
    for name, text in (('id', 'echo 1000'), ('apt-get', 'exit 1')):
        (tmp_path / name).write_text(f'#!/bin/bash\n{text}\n')
        (tmp_path / name).chmod(0o755)
    bash = subprocess.check_output(['bash', '-c', 'command -v bash'], text=True).strip()
    for command in ('bash', 'g++'):
        if command == 'bash':
            (tmp_path / command).symlink_to(bash)
    script = 'say() { echo "$*"; }; fail() { echo "$*"; exit 1; }; source "$ROOT/environment/system.bash"; require_system'
    done = subprocess.run([bash, '-c', script], capture_output=True, text=True, timeout=120,
                          env={'PATH': str(tmp_path), 'ROOT': str(ROOT), 'HOME': str(tmp_path)})
    assert done.returncode == 1
    assert 'sudo apt-get install -y g++' in done.stdout, done.stdout + done.stderr


def test_python_that_is_too_new_is_named_with_the_line_to_type(tmp_path):
    (tmp_path / 'python3').write_text('#!/bin/bash\n[[ $1 == -V ]] && echo Python 3.14.0 || exit 1\n')
    (tmp_path / 'python3').chmod(0o755)
    script = 'find_python() { usable_python python3; }; require_system'
    done = shell('source "$ROOT/environment/steps.bash"; source "$ROOT/environment/system.bash"; PATH=$SCRATCH:$PATH; ' + script,
                 SCRATCH=str(tmp_path))
    assert done.returncode == 1
    assert 'Python 3.14.0' in done.stderr and 'TACTILE_PYTHON=' in done.stderr


def test_another_ros_2_is_named():
    done = shell('unset TACTILE_FALLBACK; export ROS_DISTRO=humble; source "$ROOT/setup.bash" && echo continued')
    assert (done.stdout, len(done.stderr.splitlines())) == ('', 1)
    assert 'humble' in done.stderr and 'Jazzy' in done.stderr


def test_little_space_is_named():
    done = shell('source "$ROOT/environment/steps.bash"; source "$ROOT/environment/system.bash"; free_megabytes() { echo 300; }; '
                 'require_space /; echo continued')
    assert done.stdout == ''
    assert '300 MB are free' in done.stderr


def test_a_second_shell_waits_for_the_first():
    with open(pathlib.Path(os.environ['TACTILE_FALLBACK'], 'lock'), 'w', encoding='utf-8') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        second = subprocess.Popen(['bash', '-c', 'source "$ROOT/setup.bash" && echo ready'], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                  text=True, env=dict(os.environ, ROOT=str(ROOT)))
        assert 'waiting for it' in second.stderr.readline()
    out, _ = second.communicate(timeout=120)
    assert out == 'ready\n'


STEP = """set -euo pipefail
    stamps=$SCRATCH/stamps logs=$SCRATCH/logs
    source "$ROOT/environment/steps.bash"
    """


@pytest.mark.parametrize('said, reported', [
    ('error: Failed to fetch: https://pypi.org/simple/six/', 'PyPI cannot be reached'),
    ('ERROR: No matching distribution found for uv==0.13.9', 'PyPI cannot be reached'),
    ('error: Failed to download `scipy`: No space left on device (os error 28)', 'the disk is full'),
])
def test_known_causes_are_reported_in_one_line(tmp_path, said, reported):
    done = shell(STEP + 'broken() { echo "$SAID"; false; }; step broken 1 "a step" broken', SCRATCH=str(tmp_path), SAID=said)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 2 and reported in done.stderr


def test_a_step_ends_at_its_first_command_that_fails(tmp_path):
    script = STEP + """
        broken() { false; touch "$SCRATCH/went_on"; }
        step broken 1 "a step" broken"""
    done = shell(script, SCRATCH=str(tmp_path))
    assert done.returncode == 1
    assert not (tmp_path / 'went_on').exists()
    assert not (tmp_path / 'stamps' / 'broken').exists()


PATH = pathlib.Path(__file__).resolve().parents[2] / 'environment' / 'fix_cmake_paths.py'


def test_both_include_folders_are_replaced():
    spec = importlib.util.spec_from_file_location('fix_cmake_paths', PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    prefix = '/opt/python/cp311-cp311'
    text = f'set(x "{prefix}/include/python3.11;{prefix}/lib/python3.11/site-packages/numpy/_core/include;/usr")'
    assert module.fix(text) == f'set(x "{sysconfig.get_paths()["include"]};{numpy.get_include()};/usr")'


FOLDER = pathlib.Path(__file__).resolve().parents[2] / 'environment'


def requirements(name):
    lines = (FOLDER / name).read_text().splitlines()
    return [Requirement(line) for line in lines if line.strip() and not line.startswith('#')]


@pytest.mark.parametrize('python', ['3.10', '3.11', '3.12', '3.13'])
def test_every_wanted_package_is_pinned_once(python):
    here = {'python_version': python, 'python_full_version': python + '.1', 'sys_platform': 'linux'}
    valid = [one for one in requirements('requirements.txt') if not one.marker or one.marker.evaluate(here)]
    pinned = {canonicalize_name(one.name): str(one.specifier).removeprefix('==') for one in valid}
    assert len(pinned) == len(valid)
    for one in requirements('requirements.in'):
        assert one.specifier.contains(pinned[canonicalize_name(one.name)]), one


LAUNCH_FILE = """
import sys
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration

def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument('code', default_value='0', description='What the process exits with'),
        DeclareLaunchArgument('seconds', default_value='0', description='How long it runs'),
        ExecuteProcess(cmd=[sys.executable, '-S', '-c', '''
import signal, sys, time
signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
print("at work", flush=True)
time.sleep(float(sys.argv[2]))
sys.exit(int(sys.argv[1]))
''', LaunchConfiguration('code'), LaunchConfiguration('seconds')], output='screen'),
    ])
"""


@pytest.fixture
def launch_file(tmp_path):
    path = tmp_path / 'one_process.launch.py'
    path.write_text(LAUNCH_FILE)
    return str(path)


def launch(*words):
    return subprocess.run(['ros2', 'launch', *words], capture_output=True, text=True, timeout=120)


def test_show_args_names_arguments_and_defaults(launch_file):
    done = launch(launch_file, '--show-args')
    assert done.returncode == 0
    assert "'code':" in done.stdout and 'How long it runs' in done.stdout and "(default: '0')" in done.stdout


@pytest.mark.skipif('TACTILE_FALLBACK' not in os.environ, reason="ROS 2's own ros2launch does not report failed processes by its exit code")
def test_ends_with_1_when_the_process_fails(launch_file):
    assert launch(launch_file, 'code:=3').returncode == 1


REFUSING = """
from launch import LaunchDescription
from launch.actions import OpaqueFunction

def refuse(context):
    raise ValueError('path:=x does not exist')

def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=refuse)])
"""


def test_ends_with_1_and_one_line_when_what_was_given_is_wrong(tmp_path):
    (tmp_path / 'refusing.launch.py').write_text(REFUSING)
    done = launch(str(tmp_path / 'refusing.launch.py'))
    assert done.returncode == 1
    assert (done.stdout + done.stderr).count('path:=x does not exist') == 1


def started(launch_file):
    process = subprocess.Popen(['ros2', 'launch', launch_file, 'seconds:=60'], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               start_new_session=True)
    while 'at work' not in process.stdout.readline():
        assert process.poll() is None
    return process


def check_clean_end(process):
    assert process.wait(timeout=120) == 0
    assert 'finished cleanly' in process.stdout.read()
    process.stdout.close()


def test_control_c_ends_it_with_0(launch_file):
    process = started(launch_file)
    os.killpg(process.pid, signal.SIGINT)
    check_clean_end(process)


@pytest.mark.skipif('TACTILE_FALLBACK' not in os.environ, reason="ROS 2's own ros2launch leaves its processes running")
def test_sigterm_ends_it_and_its_processes(launch_file):
    process = started(launch_file)
    process.terminate()
    check_clean_end(process)


@pytest.mark.parametrize('words, reported', [
    (('no_such_package', 'x.launch.py'), 'no_such_package'),
    (('tactile_bringup', 'no_such_file.launch.py'), 'no_such_file.launch.py'),
])
def test_what_is_not_there_is_named(words, reported):
    done = launch(*words)
    assert done.returncode != 0
    assert reported in done.stderr + done.stdout


def test_a_word_that_is_no_argument_is_refused(launch_file):
    done = launch(launch_file, 'code=3')
    assert done.returncode != 0
    assert 'code=3' in done.stderr + done.stdout
