# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A monitor on another machine whose cable is unplugged and plugged in again, or loses packets: the sensor's machine is not affected."""
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

import psutil  # noqa: E402
from emulated import CountingFinger  # noqa: E402
from network import Cable, Machine, missing  # noqa: E402
from witness import written  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.skipif(missing() != '', reason=missing())]
NODES = ('tactile_driver.nodes.psd_node', 'tactile_perception.node:psd_contact_node', 'tactile_driver.nodes.camera_node')
STARTED = 30.0  # s, limit for a start
IMAGES, SIZE = 30.0, (160, 120)  # Hz, px: 1.7 MB/s
BACK = 3.0  # s, limit until the monitor receives again
LATE = 1.0  # s, limit of delay on a busy machine; a process blocked by a neighbour that does not answer would wait 3 s
GROWTH = 6 << 20  # bytes, limit of memory growth
LEASE = 20.0  # s, Fast DDS' default lease: it drops participants that are silent for longer


class Rig:
    """A finger and a camera with their nodes and a listener on one machine, a monitor on another."""

    def __init__(self, bench, folder):
        self.bench, space = bench, bench.fresh('net')
        (folder / 'monitor').mkdir()
        self._machines = Machine(folder, (*NODES, 'witness')), Machine(folder / 'monitor', ('witness',))
        self.cable, self._finger = Cable(*self._machines), CountingFinger(folder / 'port', patient=True)
        here, there = self._machines
        self._local, self._remote = here.start('witness', space), there.start('witness', space)
        finger = {'source': 'device', 'device': folder / 'port', 'batch_period': 0.02}
        given = finger, {}, {'source': 'file', 'path': film(folder), 'loop': 'true'}
        self._watched = [self._local, *(here.start(node, space, **each) for node, each in zip(NODES, given, strict=True))]
        bench.until(lambda: all(len(lines) > 60 for lines in self.remote.values()), STARTED)

    def room_to_send(self):
        """Bytes that may wait in each socket by which the nodes send through the cable."""
        return [room for process in self._watched for room in self._machines[0].room_to_send(process.pid)]

    @property
    def local(self):
        return written(self._local.log)

    @property
    def remote(self):
        return written(self._remote.log)

    def memory(self):
        """Bytes of each process on the sensor's machine."""
        return np.array([psutil.Process(process.pid).memory_info().rss for process in self._watched])

    def check_local(self, begin, end):
        """Between two times the local listener has missed nothing and has not waited; the largest age, s."""
        heard = {topic: [line for line in lines if begin < line.at < end] for topic, lines in self.local.items()}
        volts = heard['voltages']
        assert all(after.first == before.last + 1 for before, after in zip(volts, volts[1:], strict=False)), 'no sample is missing'
        blocks, contacts = (np.unique([line.stamp for line in heard[topic]]) for topic in ('voltages', 'contacts'))
        within = np.searchsorted(contacts, blocks[1:]) - np.searchsorted(contacts, blocks[:-1])
        assert np.count_nonzero(within != 1) <= 2, 'each block has its contacts, stamped amid its samples'
        assert len(heard['image_raw']) > 0.8 * IMAGES * (end - begin)
        for lines in heard.values():
            assert np.median([line.age for line in lines]) < 0.2
        latest = max(line.age for lines in heard.values() for line in lines)
        assert latest < LATE
        return latest

    def close(self):
        self.cable.close()
        self._finger.pull()
        for machine in self._machines:
            machine.close()


def film(folder):
    writer = cv2.VideoWriter(str(folder / 'pad.avi'), cv2.VideoWriter_fourcc(*'MJPG'), IMAGES, SIZE)
    for k in range(50):
        writer.write(np.full((SIZE[1], SIZE[0], 3), 4 * k, np.uint8))
    writer.release()
    return folder / 'pad.avi'


@pytest.fixture(scope='module')
def rig(bench, tmp_path_factory):
    made = Rig(bench, tmp_path_factory.mktemp('network'))
    yield made
    made.close()


@pytest.mark.parametrize('seconds', [4.0, pytest.param(LEASE + 5.0, marks=pytest.mark.slow)])
def test_the_cable_to_a_monitor_is_pulled_and_plugged_in_again(bench, beside, rig, seconds):
    before, begin = rig.memory(), time.monotonic()
    rig.cable.pull()
    time.sleep(seconds)
    grown = (rig.memory() - before).max()
    deaf = [line for lines in rig.remote.values() for line in lines if line.at > begin + 0.5]
    rig.cable.plug()
    plugged = time.monotonic()
    bench.until(lambda: all(lines[-1].at > plugged for lines in rig.remote.values()), STARTED)
    back = max(next(line.at for line in lines if line.at > plugged) for lines in rig.remote.values()) - plugged
    time.sleep(1.0)
    latest = rig.check_local(begin, time.monotonic() - 0.2)
    assert not deaf, 'the cable was pulled'
    assert grown < GROWTH, f'{grown / 1e6:.1f} MB more'
    bench.report(f'cable to a monitor on another machine pulled for {seconds:g} s ({grown / 1e6:.1f} MB more, '
                 f'{1e3 * latest:.0f} ms old at most what a local listener gets)', 'nothing', back, BACK)


def test_no_node_has_to_wait_for_a_neighbour_that_does_not_answer(rig):
    """Linux keeps so much for such a neighbour: who may have no more than that waiting is held up until it is given up, 3 s."""
    kept = int(Path('/proc/sys/net/ipv4/neigh/default/unres_qlen_bytes').read_text())
    room = rig.room_to_send()
    assert len(room) >= 4 and min(room) > kept


def test_a_link_to_a_monitor_loses_a_fifth_of_its_packets(bench, beside, rig):
    rig.cable.loss, begin = 0.2, time.monotonic()
    time.sleep(6.0)
    rig.cable.loss, end = 0.0, time.monotonic()
    bench.until(lambda: rig.remote['voltages'][-1].at > end + 1.0 and rig.remote['voltages'][-1].age < 0.5, STARTED)
    back = next(line.at for line in rig.remote['voltages'] if line.at > end and line.age < 0.5) - end
    latest = rig.check_local(begin, end)
    sent = {topic: {line.stamp for line in lines if begin < line.at < end} for topic, lines in rig.local.items()}
    got = {topic: [line for line in lines if line.stamp in sent[topic]] for topic, lines in rig.remote.items()}
    assert len(got['voltages']) > 0.85 * len(sent['voltages']), 'depth 100: what is lost is sent again'
    assert 0.6 * len(sent['contacts']) < len(got['contacts']), 'depth 1: what is lost is replaced by what is newer'
    assert np.median([line.age for line in got['contacts']]) < 0.2
    bench.report(f'a link to a monitor loses 20 % of its packets ({1e3 * latest:.0f} ms old at most what a local listener gets; the '
                 f'monitor gets {len(got["voltages"]) / len(sent["voltages"]):.0%} of the voltages, '
                 f'{max(line.age for line in got["voltages"]):.1f} s old at most, {len(got["contacts"]) / len(sent["contacts"]):.0%} '
                 f'of the contacts, {len(got["image_raw"]) / len(sent["image_raw"]):.0%} of the images)', 'nothing', back, 2 * BACK)
