# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch` as this repository's users type it: file and package form, arguments, exit codes, Ctrl-C."""

import os
import signal
import subprocess

import pytest

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


@pytest.mark.skipif('TACTILE_FALLBACK' not in os.environ, reason="ROS 2's own ros2launch does not tell failed processes by its exit code")
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
