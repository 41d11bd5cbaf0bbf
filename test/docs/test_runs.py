# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Every command of README, CONTRIBUTING, the Makefile's help and the pages is run, or `runs.py` says why not; it ends with exit code 0 and
with its result. Those of the pages' sh blocks are run by test_pages.py. `make test` runs those that take seconds."""
import os
import re
import shutil
import subprocess
import time

import cv2
import numpy as np
import pytest
import yaml
from pages import ALL_PAGES, ROOT, helped_commands, listed_commands
from runs import ANSWERED, ENDS, LASTS, NOT_RUN, RUNS, reason_of, run_of
from session import Session

from tactile_bringup.simulate.bags import write_psd_scene, write_scene, write_taxel_scene
from tactile_driver.simulation.sensors.scenes import open_scene

COMMANDS = list(dict.fromkeys([command for page in ALL_PAGES for command in listed_commands(page)] + helped_commands()))
LIMIT_S, NODES_S = 1500.0, 60.0


def test_each_command_is_run_or_has_a_reason_why_not():
    wrong = [command for command in COMMANDS if bool(run_of(command)) == bool(reason_of(command))]
    assert not wrong, 'a row of RUNS or of NOT_RUN in test/docs/runs.py is missing, or both are there'


def test_each_row_names_its_result():
    without = [run.expression for run in RUNS if run.how != ANSWERED and not (run.prints or run.writes)]
    assert not without, 'name what it prints or writes; session.py names what those of ANSWERED print'


def test_every_row_belongs_to_a_command():
    assert not [run.expression for run in RUNS if not any(run_of(command) is run for command in COMMANDS)]
    assert not [expression for expression in NOT_RUN if not any(re.match(expression, command) for command in COMMANDS)]


def test_the_makefiles_help_names_every_target():
    targets = re.search(r'^\.PHONY: (.*)$', (ROOT / 'Makefile').read_text(), re.MULTILINE)[1].split()
    assert {command.split()[1] for command in helped_commands()} == set(targets) - {'help', 'setup'}


@pytest.fixture(scope='module')
def files(tmp_path_factory):
    """Folder of what stands for the reader's own files."""
    folder = tmp_path_factory.mktemp('files')
    share = ROOT / 'tactile_bringup'
    for name, source in {'my_video.yaml': 'params/marker_video.yaml', 'my_array.yaml': 'params/pressure_array_14x6.yaml',
                         'PARAMS.yaml': 'params/touchpad_sim.yaml',
                         'FINGER.yaml': 'params/psd_finger_sim.yaml'}.items():
        shutil.copy(share / source, folder / name)
    hand = [{'name': 'thumb', 'type': 'touchpad', 'device': 'SERIAL'}, {'name': 'tip', 'type': 'psd_finger', 'device': 'usb-if00'}]
    (folder / 'my_hand.yaml').write_text(yaml.safe_dump({'frame': 'hand', 'sensors': hand}))
    return folder


def make_video(folder):
    scene = open_scene('areal_single_demo', 10.0)
    video = cv2.VideoWriter(str(folder / 'press.avi'), cv2.VideoWriter_fourcc(*'MJPG'), 10.0, (640, 480))
    for number in range(20):
        video.write(np.ascontiguousarray(scene.render(number / 10.0).image))
    video.release()


def make_pin_images(folder):
    scene = open_scene('pins_demo', 5.0)
    (folder / 'pin_images').mkdir()
    for number in range(10):
        cv2.imwrite(str(folder / 'pin_images' / f'{number:03d}.png'), scene.render(number / 5.0).image)


def grasp():
    values = np.zeros((30, 14, 6))
    values[10:, 5:9, 2:4] = 900.0
    return values, np.arange(30) * 0.02


def make_grasp(folder):
    np.savez(folder / 'grasp.npz', pad4=grasp()[0], t_ms=1e3 * grasp()[1])


def make_table(folder):
    values, times = grasp()
    lines = [','.join(f'{value:g}' for value in (1e3 * time, *frame.ravel())) for time, frame in zip(times, values)]
    names = ','.join(['time (ms)', *(f'cell{k}' for k in range(values[0].size))])
    (folder / 'grasp.csv').write_text('\n'.join([names, *lines]) + '\n')


#: What takes time to make -> how, when a command names it.
MADE = {'press.avi': make_video, 'pin_images': make_pin_images, 'grasp.npz': make_grasp, 'grasp.csv': make_table,
        'recorded_bag': lambda folder: write_taxel_scene(folder / 'recorded_bag', 'drag', 50.0),
        'short_bag': lambda folder: write_scene(folder / 'short_bag', 'disc_twist', 2.0),
        'recordings': lambda folder: [write_psd_scene(folder / 'recordings' / name, 'calibration', 1000.0) for name in 'ab'],
        'finger_bag': lambda folder: write_psd_scene(folder / 'finger_bag', 'calibration', 1000.0)}


@pytest.fixture
def reader(files, tmp_path):
    """(a folder that looks like a checkout in which a reader works, a session in it)."""
    for name in ('docs', 'tactile_bringup', 'tactile_perception'):
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / 'test/benchmark', tmp_path / 'test/benchmark')
    for path in files.iterdir():
        (tmp_path / path.name).symlink_to(path)
    session = Session(tmp_path)
    yield tmp_path, session
    session.end_block()


def commands_that_run():
    for command in COMMANDS:
        run = run_of(command)
        if run and not reason_of(command):
            yield pytest.param(command, run, id=command[:90], marks=() if run.is_quick else pytest.mark.slow)


@pytest.mark.timeout(1800)
@pytest.mark.parametrize('command, run', commands_that_run())
def test_the_command_runs(command, run, files, reader):
    folder, session = reader
    if run.extra:
        pytest.importorskip(run.extra, reason=f'{run.extra} is an optional extra, which is not installed')
    shown = run.command(command).replace('@', str(files))
    if 'RECORDINGS' in shown + command or re.search(r'--recorded|judged.py \w+ (?!scene:)', shown):
        if 'TACTILE_RECORDINGS' not in os.environ:
            pytest.skip('TACTILE_RECORDINGS is not set')
    for name in (name for name in MADE if name in shown):
        if not (files / name).exists():
            MADE[name](files)
        if not (folder / name).exists():
            (folder / name).symlink_to(files / name)
    if run.beside:
        session.begin(run.beside)
    if run.how == ENDS:
        done = subprocess.run(['bash', '-c', shown], cwd=ROOT if run.is_in_checkout else folder, capture_output=True, text=True,
                              timeout=LIMIT_S)
        assert done.returncode == 0, f'{shown}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}'
        check_result(run, files, folder, done.stdout + done.stderr)
    elif run.how == LASTS:
        session.begin(shown)
        end = time.monotonic() + NODES_S
        while not re.search(run.prints, said := session.called(run.asks, NODES_S).stdout, re.MULTILINE):
            assert time.monotonic() < end, f'{shown}: {run.asks} prints no {run.prints!r}, but\n{said[-2000:]}'
    else:
        assert run.how == ANSWERED
        session.run(shown)


def check_result(run, files, folder, said):
    """What it writes is there, what it prints was printed, and there is no traceback."""
    assert 'Traceback' not in said, said[-3000:]
    if run.writes:
        path = folder / run.writes.replace('@', str(files))
        assert path.is_file() and path.stat().st_size, f'{path} is not there\n{said[-2000:]}'
        said += path.read_text() if path.suffix == '.yaml' else ''
    assert re.search(run.prints, said, re.MULTILINE), f'{run.prints!r} is not in\n{said[-3000:]}'
