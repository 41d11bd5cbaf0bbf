# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording's disk is full, or its process is killed: the fault is reported, raw data continue, and the data written can be read."""
import os
import signal
import subprocess
import time

import pytest
import yaml
from emulated import CountingFinger, samples
from fault_rig import ERROR, OK, PATIENCE

from tactile_driver.nodes.psd_node import PsdNode
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_msgs.msg import PsdVoltages

ROOM = 12 << 20  # bytes, size of the disk


@pytest.fixture
def disk(tmp_path):
    """A small file system of its own, where this user may make one."""
    folder = tmp_path / 'disk'
    folder.mkdir()
    made = subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={ROOM}', 'tmpfs', str(folder)], capture_output=True, check=False)
    if made.returncode:
        pytest.skip(f'no small file system can be made here: {made.stderr.decode().strip()}')
    yield folder
    subprocess.run(['umount', '-l', str(folder)], check=True)


@pytest.fixture
def finger(bench, bus, nodes):
    """(namespace, voltages as they come) of a finger that runs."""
    space = bench.fresh('finger')
    heard = bench.ear.hear(PsdVoltages, f'{space}/voltages')
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1, patient=True)
    nodes(PsdNode, space, source='device', device='A1', batch_period=0.02)
    return space, heard


def numbers_in(bag, topic):
    with BagReader(bag) as reader:
        return samples([decode(m.data, m.type_name) for m in reader.messages({topic})])[:, 0].tolist()


def count_of(bag):
    """Number of messages that a closed bag's metadata promise and that are in it."""
    promised = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']['message_count']
    with BagReader(bag) as reader:
        assert len(list(reader.messages())) == promised and not reader.left_out.total
    return promised


def fill(disk):
    """Take all the room that there is; the file that has it."""
    path = disk / 'others'
    with open(path, 'wb', buffering=0) as file:
        try:
            while True:
                file.write(b'x' * 4096)
        except OSError:
            return path


def record_more(bench, space):
    """Wait until the recorder has caught up: it has recorded a second's messages more."""
    count = bench.recorded(space)
    bench.until(lambda: bench.recorded(space) > count + 40)


def test_the_disk_is_full_for_a_while(bench, beside, finger, disk):
    space, heard = finger
    recorder = bench.start('tactile_bringup', 'record_node', space, bag=disk / 'bag', patience=0.0)
    bench.until(lambda: bench.recorded(space) > 50)
    before = time.monotonic()
    record_more(bench, space)
    others, begin = fill(disk), time.monotonic()
    reported = bench.reported(f'{space}/record_node', ERROR, 'No space left on device', begin)
    assert 'make room on the disk' in reported.values['what to do'] and len(heard) > 50
    others.unlink()
    free = time.monotonic()
    bench.reported(f'{space}/record_node', OK, 'messages recorded', free)
    line = bench.logged('recording continues', free)
    sure = time.monotonic()
    bench.until(lambda: heard[-1].at > sure + 0.8)
    record_more(bench, space)
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(PATIENCE) == 0, recorder.log
    got, kept = samples([h.message for h in heard])[:, 0].tolist(), numbers_in(disk / 'bag', f'{space}/voltages')
    assert got == list(range(got[0], got[-1] + 1)), 'raw data continue'
    early = set(samples([h.message for h in heard if h.at < before])[-100:, 0])
    late = set(samples([h.message for h in heard if sure < h.at < sure + 0.8])[:, 0])
    assert early | late <= set(kept) and kept == sorted(set(kept)) and len(kept) < kept[-1] - kept[0] + 1
    assert count_of(disk / 'bag') > 50, 'it has its metadata, as any bag'
    lost = int(line.split(';')[1].split()[0])
    first = next(number for number in kept if number > samples([h.message for h in heard if h.at < free])[-1, 0])
    back = next(h.at for h in heard if samples([h.message])[-1, 0] >= first)
    assert lost > 0
    bench.report('disk full', reported.text, back - free)


@pytest.mark.slow
def test_the_disk_stays_full_and_the_index_finds_its_room_all_the_same(bench, beside, finger, disk):
    space, _ = finger
    recorder = bench.start('tactile_bringup', 'record_node', space, bag=disk / 'bag', patience=0.0)
    bench.until(lambda: bench.recorded(space) > 20)
    fill(disk)
    bench.reported(f'{space}/record_node', ERROR, 'No space left on device')
    recorder.send_signal(signal.SIGTERM)
    assert recorder.wait(PATIENCE) == 0 and 'lost' in recorder.log
    assert count_of(disk / 'bag') > 20


@pytest.mark.slow
def test_the_recorder_is_killed(bench, beside, finger, tmp_path):
    space, heard = finger
    recorder = bench.start('tactile_bringup', 'record_node', space, bag=tmp_path / 'bag', patience=0.0)
    bench.until(lambda: bench.recorded(space) > 60)
    time.sleep(1.5)
    recorder.send_signal(signal.SIGKILL)
    assert recorder.wait(PATIENCE) == -9
    killed = time.monotonic()
    kept = numbers_in(tmp_path / 'bag', f'{space}/voltages')
    earlier = samples([h.message for h in heard if h.at < killed - 1.5])[:, 0]
    assert kept == list(range(kept[0], kept[-1] + 1)) and kept[-1] >= earlier[-1]
    assert sorted(os.listdir(tmp_path / 'bag')) == ['bag_0.mcap', 'reserve']
