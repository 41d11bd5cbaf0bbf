# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that are killed: perception alone, and a sensor of a hand whose launch file restarts it."""
import os
import signal
import subprocess
import time

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

import psutil  # noqa: E402
import yaml  # noqa: E402
from emulated import CountingFinger, samples  # noqa: E402
from tactile_driver.nodes.psd_node import PsdNode  # noqa: E402
from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_msgs.msg import Contacts, PsdVoltages  # noqa: E402

pytestmark = pytest.mark.ros
PERCEPTION = 'tactile_perception.node:psd_contact_node'
STARTED = 30.0  # s, limit for a process to import its modules and be discovered
JOINED = 3.0  # s, limit for the discovery of each topic of a recorder


def test_perception_is_killed_and_started_again_beside_a_driver_that_goes_on(bench, beside, bus, nodes):
    bus.plug('A1', CountingFinger, 'ttyUSB0', mark=1)
    space = bench.fresh('finger')
    volts, contacts = bench.ear.hear(PsdVoltages, f'{space}/voltages'), bench.ear.hear(Contacts, f'{space}/contacts')
    nodes(PsdNode, space, source='device', device='A1', batch_period=0.02)
    first = bench.zygote.start(PERCEPTION, space)
    bench.until(lambda: len(contacts) > 10, STARTED)
    first.send(signal.SIGKILL)
    assert first.wait() == -9
    seen, begin = len(contacts), time.monotonic()
    bench.zygote.start(PERCEPTION, space)
    bench.until(lambda: len(contacts) > seen + 10, STARTED)
    numbers = samples([h.message for h in volts])[:, 0]
    assert (numbers[1:] == numbers[:-1] + 1).all(), 'the driver misses nothing'
    bench.report('perception killed, started again', 'its launch file says so', contacts[seen].at - begin, STARTED)


class Hand:
    """hand.launch.py with two fingers on ports, as a user starts it."""

    def __init__(self, folder, ports, *words):
        page = {'sensors': [{'name': name, 'type': 'psd_finger', 'device': str(port)} for name, port in ports.items()]}
        (folder / 'hand.yaml').write_text(yaml.safe_dump(page))
        self._log = folder / 'hand.log'
        environment = {**os.environ, 'OMP_NUM_THREADS': '1'}
        with open(self._log, 'w') as log:
            command = ['ros2', 'launch', 'tactile_bringup', 'hand.launch.py', 'hand:=hand.yaml', 'source:=device', *words]
            self.process = subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=subprocess.STDOUT,
                                            start_new_session=True)

    @property
    def log(self):
        return self._log.read_text()

    def child(self, namespace, executable):
        """The process that runs an executable in a namespace."""
        children = psutil.Process(self.process.pid).children(recursive=True)
        return next(child for child in children
                    if f'__ns:=/{namespace}' in child.cmdline() and any(word.endswith(f'/{executable}') for word in child.cmdline()))

    def end(self):
        """Ctrl-C; launch's own exit code tells of the process that was killed."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
        self.process.wait(timeout=30)


def recorded(bag, topic):
    with BagReader(bag) as reader:
        return samples([decode(m.data, m.type_name) for m in reader.messages({topic})])[:, 0]


@pytest.mark.slow
@pytest.mark.parametrize('composed', ['true', 'false'])
def test_a_sensor_of_a_hand_is_killed_and_the_launch_file_starts_it_again(bench, beside, tmp_path, composed):
    index, thumb = (bench.fresh(name).strip('/') for name in ('index', 'thumb'))
    fingers = {name: CountingFinger(tmp_path / name, mark=mark, rate=100.0, patient=True) for mark, name in enumerate((index, thumb))}
    heard = {name: bench.ear.hear(PsdVoltages, f'/{name}/voltages') for name in fingers}
    hand = Hand(tmp_path, {name: tmp_path / name for name in fingers}, 'record:=rec', f'composed:={composed}')
    try:
        bench.until(lambda: all(len(each) > 20 for each in heard.values()), 60.0)
        bench.until(lambda: all(bench.recorded(f'/{name}') > 20 for name in fingers), 60.0)
        begun = time.monotonic() + JOINED
        time.sleep(JOINED + 1.0)
        victim = hand.child(index, {'true': 'sensor_nodes', 'false': 'psd_node'}[composed])
        before, killed = len(heard[index]), time.monotonic()
        victim.kill()
        bench.until(lambda: 'exit code -9' in hand.log)
        bench.until(lambda: len(heard[index]) > before + 20, STARTED)
        back = next(h.at for h in heard[index][before:] if h.at > killed + 0.2)
        count = bench.recorded(f'/{index}')
        joined = bench.until(lambda: bench.recorded(f'/{index}') > count + 5, STARTED)  # the recorder receives from the new driver too
        bench.until(lambda: heard[index][-1].at > joined + JOINED + 0.5)
        beside_it = samples([h.message for h in heard[thumb]])[:, 0]
        assert (beside_it[1:] == beside_it[:-1] + 1).all(), 'the other sensor misses nothing'
    finally:
        hand.end()
        for finger in fingers.values():
            finger.pull()
    assert 'Traceback' not in hand.log, hand.log
    for name, messages in heard.items():
        kept = set(recorded(tmp_path / 'rec' / name, f'/{name}/voltages'))
        sure = [h.message for h in messages if begun < h.at < killed - 0.2 or h.at > joined + JOINED]
        assert len(sure) > 10 and set(samples(sure)[:, 0]) <= kept, f'{name}: what was published is recorded'
    bench.report(f'{"a sensor" if composed == "true" else "a driver"} of a hand killed',
                 'launch: `process has died [pid ..., exit code -9 ...]', back - killed, STARTED)
