# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as data sets: steps on one clock, ages, padding, each format read back by its own library, errors that leave nothing."""
import errno
import json
import os
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, Wrench, WrenchStamped
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Bool, String
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerControl, InteractiveMarkerInit, Marker

from tactile_bringup.export import command
from tactile_bringup.export.constants import EXPORT
from tactile_bringup.export.fields import fields_of
from tactile_bringup.export.store import Columns
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_msgs.msg import Contact, ContactRegion, Contacts

EXTRA = 'an optional extra, is not installed: environment/extras.txt'


def stamped(message, seconds, frame='thumb'):
    message.header.stamp.sec, message.header.stamp.nanosec = int(seconds), round(seconds % 1 * 1e9)
    message.header.frame_id = frame
    return message


def write(bag, contact_s=np.arange(0, 2, 0.1), joint_s=np.arange(0, 2, 0.25), late_s=0.0, image=(4, 6)):
    """Contact k has depth 0.001 k; there are k % 3 of them. Joints are at 2 rad per second."""
    messages = []
    for k, at in enumerate(contact_s):
        found = [Contact(id=i, position=Point(x=0.1 * i), depth=0.001 * k, position_covariance=[float(i)] * 9) for i in range(k % 3)]
        picture = Image(height=image[0], width=image[1], encoding='mono8', step=image[1], data=bytes([10 * k] * image[0] * image[1]))
        messages += [(at, '/thumb/contacts', stamped(Contacts(contacts=found), at)), (at, '/thumb/image_raw', stamped(picture, at))]
    messages += [(at, '/joint_states', stamped(JointState(name=['a', 'b'], position=[2.0 * at, 0.0]), at + late_s)) for at in joint_s]
    messages += [(0.0, '/thumb/description', String(data='sensor_type: gel')),
                 *((at, '/busy', Bool(data=at == 0.3)) for at in (0.0, 0.3, 1.0))]
    with BagWriter(bag) as writer:
        for at, topic, message in sorted(messages, key=lambda each: each[0]):
            kind, data = encode(message)
            writer.write(topic, kind, int(1e9 * at), data)
    return str(bag)


@pytest.fixture
def bag(tmp_path):
    return write(tmp_path / 'bag')


@pytest.fixture
def h5py():
    return pytest.importorskip('h5py', reason=f'h5py, {EXTRA}')


def run(*words):
    return command.main([str(word) for word in words])


def test_a_message_becomes_arrays_by_name_with_the_units_of_its_definition():
    found = fields_of(Contacts(contacts=[Contact(depth=0.5), Contact(depth=0.25)]))
    assert found['contacts.depth'].values.tolist() == [0.5, 0.25] and found['contacts.depth'].is_variable
    assert found['contacts.depth'].note.startswith('indentation, m')
    assert found['contacts.position_covariance'].values.shape == (2, 9)
    empty = fields_of(Contacts())
    assert empty.keys() == found.keys() and empty['contacts.position_covariance'].values.shape == (0, 9)
    wrench = fields_of(WrenchStamped())
    assert wrench['wrench.force.x'].values.shape == () and not wrench['wrench.force.x'].is_variable


def test_sequences_in_sequences_say_to_which_entry_they_belong():
    rings = [Polygon(points=[Point32(x=float(k))] * count) for k, count in ((1, 2), (2, 3))]
    found = fields_of(ContactRegion(outlines=rings))
    assert found['outlines.points.x'].values.tolist() == [1, 1, 2, 2, 2]
    assert found['outlines.points.x.index'].values.tolist() == [0, 0, 1, 1, 1]


def test_held_values_are_the_last_before_a_step_and_say_their_age(h5py, tmp_path, bag):
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5', '--rate', 20) == 0
    with h5py.File(tmp_path / 'out.h5') as data:
        one = data['episode_000000']
        time = one['time'][:]
        assert np.allclose(time, np.arange(39) / 20)  # to the last message, at 1.9 s
        assert np.allclose(one['joint_states/position'][:, 0], 2 * np.floor(time / 0.25 + 1e-6) * 0.25)
        assert np.allclose(one['joint_states/age'][:], time - np.floor(time / 0.25 + 1e-6) * 0.25)
        assert one['thumb/contacts/age'][:].min() >= 0 and one['thumb/contacts/age'][:].max() == pytest.approx(0.05)
        assert one['thumb/contacts/contacts.depth'].attrs['frame_id'] == 'thumb'
        assert one['joint_states/position'].attrs['names'] == 'a, b'
        assert 'sensor_type: gel' in json.loads(one.attrs['said once'])['/thumb/description'] and one.attrs['begin_ns'] == 0


def test_nearest_values_may_come_after_a_step(h5py, tmp_path, bag):
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5', '--rate', 20, '--sample', 'nearest') == 0
    with h5py.File(tmp_path / 'out.h5') as data:
        age = data['episode_000000/joint_states/age'][:]
    assert age.min() == pytest.approx(-0.1) and age[:36].max() == pytest.approx(0.1)


def test_entries_of_unequal_number_are_padded_with_a_mask_alike_in_both_formats(h5py, tmp_path, bag):
    zarr = pytest.importorskip('zarr', reason=f'zarr, {EXTRA}')
    for kind in ('hdf5', 'zarr'):
        assert run(bag, '--to', kind, tmp_path / f'out.{kind}', '--rate', 10) == 0
    with h5py.File(tmp_path / 'out.hdf5') as data:
        for one in (data['episode_000000'], zarr.open(tmp_path / 'out.zarr')['episode_000000']):
            depth, mask = one['thumb/contacts/contacts.depth'][:], one['thumb/contacts/contacts.depth.mask'][:]
            assert depth.shape == mask.shape == (20, 2)
            assert mask.sum(axis=1).tolist() == [k % 3 for k in range(20)] and np.isnan(depth[~mask]).all()
            assert depth[5].tolist() == [0.005, 0.005] and one['thumb/contacts/contacts.position_covariance'].shape == (20, 2, 9)
            assert one['thumb/image_raw/image'][7].tolist() == [[70] * 6] * 4


def test_columns_grow_whatever_is_written_at_a_time(h5py, tmp_path, bag, monkeypatch):
    whole, small = tmp_path / 'whole.h5', tmp_path / 'small.h5'
    run(bag, '--to', 'hdf5', whole, '--rate', 10)
    monkeypatch.setattr('tactile_bringup.export.store.EXPORT', replace(EXPORT, buffered_bytes=0))
    run(bag, '--to', 'hdf5', small, '--rate', 10)
    with h5py.File(whole) as one, h5py.File(small) as other:
        for name in ('contacts.depth', 'contacts.depth.mask', 'contacts.position_covariance', 'age'):
            path = f'episode_000000/thumb/contacts/{name}'
            assert np.array_equal(one[path][:], other[path][:], equal_nan=name != 'contacts.depth.mask')


def test_episodes_are_bags_or_the_times_in_which_a_topic_is_true(h5py, tmp_path, bag):
    other = write(tmp_path / 'other', contact_s=np.arange(0, 1, 0.1))
    assert run(bag, other, '--to', 'hdf5', tmp_path / 'bags.h5', '--rate', 10) == 0
    assert run(bag, '--to', 'hdf5', tmp_path / 'marks.h5', '--rate', 10, '--episodes', '/busy') == 0
    with h5py.File(tmp_path / 'bags.h5') as data, h5py.File(tmp_path / 'marks.h5') as marked:
        assert [len(data[name]['time']) for name in sorted(data)] == [20, 18]
        assert [len(marked[name]['time']) for name in marked] == [8] and marked['episode_000000'].attrs['begin_ns'] == 300_000_000


def test_recordings_that_a_hand_made_at_one_time_are_one_episode_on_one_clock(h5py, tmp_path):
    write(tmp_path / 'hand' / 'thumb')
    with BagWriter(tmp_path / 'hand' / 'tip') as writer:
        for at in np.arange(0.5, 2.5, 0.05):
            kind, data = encode(stamped(WrenchStamped(wrench=Wrench(force=Vector3(z=at))), at))
            writer.write('/tip/wrench', kind, int(1e9 * at), data)
    assert run(tmp_path / 'hand', '--to', 'hdf5', tmp_path / 'out.h5', '--rate', 20) == 0
    with h5py.File(tmp_path / 'out.h5') as data:
        assert list(data) == ['episode_000000']
        one = data['episode_000000']
        assert one.attrs['begin_ns'] == 500_000_000
        assert np.allclose(one['tip/wrench/wrench.force.z'][:], 0.5 + one['time'][:] - one['tip/wrench/age'][:])
        assert np.allclose(one['joint_states/position'][:30, 0], 2 * np.floor(0.5 / 0.25 + one['time'][:30] / 0.25 + 1e-6) * 0.25)


def test_recordings_of_the_same_topics_or_of_different_times_are_episodes_of_their_own(h5py, tmp_path):
    write(tmp_path / 'same' / 'a'), write(tmp_path / 'same' / 'b')
    assert run(tmp_path / 'same', '--to', 'hdf5', tmp_path / 'same.h5') == 0
    write(tmp_path / 'later' / 'a')
    with BagWriter(tmp_path / 'later' / 'b') as writer:
        for at in (5.0, 6.0):
            kind, data = encode(stamped(WrenchStamped(), at))
            writer.write('/tip/wrench', kind, int(1e9 * at), data)
    assert run(tmp_path / 'later', '--to', 'hdf5', tmp_path / 'later.h5') == 0
    for name in ('same', 'later'):
        with h5py.File(tmp_path / f'{name}.h5') as data:
            assert len(data) == 2


def test_recordings_that_are_named_alone_leave_the_others_of_their_folder_out(h5py, tmp_path):
    for name in ('thumb', 'tip', 'palm'):
        with BagWriter(tmp_path / 'hand' / name) as writer:
            for at in (1.0, 1.5, 2.0):
                kind, data = encode(stamped(WrenchStamped(), at))
                writer.write(f'/{name}/wrench', kind, int(1e9 * at), data)
    assert run(tmp_path / 'hand' / 'thumb', tmp_path / 'hand' / 'tip', '--to', 'hdf5', tmp_path / 'out.h5') == 0
    with h5py.File(tmp_path / 'out.h5') as data:
        assert [[name for name in episode if name != 'time'] for episode in data.values()] == [['thumb'], ['tip']]


def test_lerobot_has_its_published_layout(h5py, tmp_path):
    pq = pytest.importorskip('pyarrow.parquet', reason=f'pyarrow, {EXTRA}')
    bags = [write(tmp_path / 'a', image=(64, 96)), write(tmp_path / 'b', contact_s=np.arange(0, 1, 0.1), image=(64, 96))]
    out = tmp_path / 'set'
    assert run(*bags, '--to', 'lerobot', out, '--rate', 10, '--task', 'press it') == 0
    info = json.loads((out / 'meta/info.json').read_text())
    assert (info['codebase_version'], info['fps'], info['total_episodes'], info['total_frames']) == ('v3.0', 10, 2, 38)
    rows = pq.read_table(out / info['data_path'].format(chunk_index=0, file_index=0))
    numbers = {name: kind for name, kind in info['features'].items() if kind['dtype'] != 'video'}
    assert set(rows.column_names) == set(numbers)
    for name, feature in numbers.items():  # as LeRobot maps them: one value, or lists of one length
        kind = rows.schema.field(name).type
        shape = [1] if not hasattr(kind, 'list_size') else [kind.list_size]
        assert [shape, str(kind.value_type if hasattr(kind, 'list_size') else kind)] == [feature['shape'], {
            'float64': 'double', 'float32': 'float'}.get(feature['dtype'], feature['dtype'])], name
    assert rows['index'].to_pylist() == list(range(38)) and rows['episode_index'].to_pylist() == [0] * 20 + [1] * 18
    assert np.allclose(rows['timestamp'].to_pylist()[20:], np.arange(18) / 10)
    episodes = pq.read_table(out / 'meta/episodes/chunk-000/file-000.parquet').to_pylist()
    key = 'observation.images.thumb.image_raw'
    assert [(one['dataset_from_index'], one['dataset_to_index'], one['length']) for one in episodes] == [(0, 20, 20), (20, 38, 18)]
    assert [one[f'videos/{key}/from_timestamp'] for one in episodes] == [0.0, 2.0] and episodes[0]['tasks'] == ['press it']
    assert pq.read_table(out / 'meta/tasks.parquet').to_pylist() == [{'task_index': 0, 'task': 'press it'}]
    video = cv2.VideoCapture(str(out / info['video_path'].format(video_key=key, chunk_index=0, file_index=0)))
    means = [picture.mean() for _ in range(38) if (picture := video.read()[1]) is not None]
    assert np.allclose(means, 10 * np.array([*range(20), *range(10), *[9] * 8]), atol=4)
    stats = json.loads((out / 'meta/stats.json').read_text())['observation.joint_states.position']
    assert stats['max'] == [3.5, 0.0] and stats['count'] == [38]
    assert not (out / 'rows.h5').exists()


LOADS = """import sys
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset
data = LeRobotDataset('local/touches', root=sys.argv[1], video_backend='pyav')
key = 'observation.images.thumb.image_raw'
print(len(data), data.num_episodes, data.fps, *data[7][key].shape, round(255 * float(data[7][key].mean())))
print(next(iter(torch.utils.data.DataLoader(data, batch_size=4)))['observation.joint_states.position'].shape)
"""


@pytest.mark.slow
def test_lerobots_own_library_loads_it(h5py, tmp_path):
    """LEROBOT_PYTHON names a Python that has lerobot, which brings torch: an environment of its own, away from that of ROS."""
    pytest.importorskip('pyarrow', reason=f'pyarrow, {EXTRA}')
    python = os.environ.get('LEROBOT_PYTHON') or sys.executable
    clean = {name: value for name, value in os.environ.items() if not name.startswith('PYTHON')} | {'HF_HUB_OFFLINE': '1'}
    if subprocess.run([python, '-c', 'import lerobot'], env=clean, capture_output=True).returncode:
        pytest.skip('no lerobot: python3 -m pip install lerobot==0.4.4 in a new environment, and name its Python in LEROBOT_PYTHON')
    assert run(write(tmp_path / 'a', image=(64, 96)), '--to', 'lerobot', tmp_path / 'set', '--rate', 10) == 0
    done = subprocess.run([python, '-c', LOADS, str(tmp_path / 'set')], env=clean, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    frames, batch = done.stdout.splitlines()
    *sizes, mean = map(int, frames.split())
    assert sizes == [20, 1, 10, 3, 64, 96] and mean == pytest.approx(70, abs=4) and batch == 'torch.Size([4, 2])'


@pytest.mark.parametrize('words, output', [
    (['--topics', '/nowhere'], 'no topic /nowhere; it has'), (['--rate', '0'], '--rate 0'), (['--episodes', '/thumb/nowhere'], 'no topic')])
def test_what_cannot_be_done_is_said_and_nothing_is_written(h5py, tmp_path, bag, capsys, words, output):
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5', *words) == 1
    assert output in capsys.readouterr().err and [path.name for path in tmp_path.iterdir()] == ['bag']


def test_clocks_that_disagree_are_named(h5py, tmp_path, capsys):
    assert run(write(tmp_path / 'bag', late_s=3600.0), '--to', 'hdf5', tmp_path / 'out.h5') == 1
    output = capsys.readouterr().err
    assert 'the clock of /joint_states is 3600.0 s ahead' in output and not (tmp_path / 'out.h5').exists()


def test_topics_of_unknown_type_are_left_out_and_named_when_wanted(h5py, tmp_path, capsys, monkeypatch):
    bag = write(tmp_path / 'bag')
    monkeypatch.setattr(command, 'unusable', lambda kind, _hash: 'its type is not installed' if kind == 'std_msgs/msg/Bool' else '')
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5', '--topics', '/busy') == 1
    assert '/busy: its type is not installed' in capsys.readouterr().err
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5') == 0
    assert 'left out: /busy: its type is not installed' in capsys.readouterr().out


def test_a_full_disk_leaves_nothing(h5py, tmp_path, bag, capsys, monkeypatch):
    def full(*_args):
        raise OSError(errno.ENOSPC, 'No space left on device')
    monkeypatch.setattr(Columns, 'close', full)
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5') == 1
    assert 'No space left' in capsys.readouterr().err and [path.name for path in tmp_path.iterdir()] == ['bag']
    (tmp_path / 'out.h5').write_text('mine')
    assert run(bag, '--to', 'hdf5', tmp_path / 'out.h5') == 1 and (tmp_path / 'out.h5').read_text() == 'mine'


def test_what_is_missing_is_named(tmp_path, bag, capsys, monkeypatch):
    monkeypatch.setattr(command, 'find_spec', lambda name: None)
    assert run(bag, '--to', 'lerobot', tmp_path / 'out') == 1
    assert 'python3 -m pip install h5py pyarrow' in capsys.readouterr().err


@pytest.mark.parametrize('kind', ['hdf5', 'zarr', 'lerobot'])
def test_a_folder_of_recordings_is_the_same_data_set_by_several_processes_and_continues_after_a_failure(h5py, tmp_path, capsys, kind):
    for name in {'hdf5': (), 'zarr': ('zarr',), 'lerobot': ('pyarrow',)}[kind]:
        pytest.importorskip(name, reason=f'{name}, {EXTRA}')
    bags = [write(tmp_path / f'bags/{name}', contact_s=np.arange(0, last, 0.1), image=(64, 96)) for name, last in (('a', 2), ('b', 1))]
    bad = tmp_path / 'bags/c'
    bad.mkdir()
    (bad / 'c_0.mcap').write_bytes(b'none')
    words, out = ('--to', kind, tmp_path / 'out', '--rate', 10), tmp_path / 'out'
    assert run(bad.parent, *words, '--jobs', 2) == 1 and not out.exists()
    output = capsys.readouterr()
    assert output.out.splitlines()[-1] == '3 recordings: 2 done, 1 failed' and 'the same command continues' in output.err
    assert run(bad.parent, '--to', kind, out, '--rate', 20) == 1 and 'other options' in capsys.readouterr().err
    (bad / 'c_0.mcap').unlink()
    bad.rmdir()
    assert run(bad.parent, *words) == 0 and '2 recordings: 2 done before' in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bags', 'out']
    if kind == 'lerobot':
        assert json.loads((out / 'meta/info.json').read_text())['total_frames'] == 38
        return
    opened = h5py.File(out) if kind == 'hdf5' else pytest.importorskip('zarr').open(out)
    assert [opened[name]['time'].shape[0] for name in sorted(opened)] == [20, 18]
    assert [opened[name].attrs['bag'] for name in sorted(opened)] == [str(bag) for bag in bags]


def test_entries_of_entries_of_entries_name_their_owners_level_by_level():
    def control(*ids):
        return InteractiveMarkerControl(markers=[Marker(id=number) for number in ids])
    first, second = InteractiveMarker(controls=[control(1), control(2, 3)]), InteractiveMarker(controls=[control(), control(4)])
    found = {name.removeprefix('markers.controls.markers.id'): field.values.tolist() for name, field in fields_of(
        InteractiveMarkerInit(markers=[first, second])).items() if name.startswith('markers.controls.markers.id')}
    assert found == {'': [1, 2, 3, 4], '.index': [0, 1, 1, 1], '.index.index': [0, 0, 0, 1]}
