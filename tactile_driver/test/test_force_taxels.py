# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels as the driver reads them: layout files, tables, the serial protocol, bags, point clouds; and the simulated devices."""
import time

import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2, PointField

from tactile_driver.errors import BadArgument, BadFrame, BadRecording
from tactile_driver.force_taxels import TaxelFrame, read_layout, taxel_frame
from tactile_driver.force_taxels.bag import VectorBagSource
from tactile_driver.force_taxels.emulator import VectorEmulator
from tactile_driver.force_taxels.messages import taxels_of_message, taxels_to_message
from tactile_driver.force_taxels.sources import VectorFileSource, VectorSerialSource, VectorSimulatedSource
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.recordings.writer import write_messages
from tactile_driver.serial.frames import MATRIX, VECTORS, BinaryReader, CountFrame, write_frame
from tactile_driver.simulation.force_taxels.device import DEVICES
from tactile_driver.simulation.force_taxels.scene import open_vector_scene
from tactile_driver.sources.array_file import read_vector_file
from tactile_driver.sources.source import EndOfSource, NothingYet

PLAYED = {'rate': 0.0, 'loop': False, 'topic': '', 'columns': ''}


@pytest.fixture
def layout(tmp_path):
    path = tmp_path / 'layout.yaml'
    path.write_text('''
patches:
  - {rows: 2, columns: 2, pitch: 0.004}
  - positions: [[0.0, 0.0, 0.0], [0.0, 0.004, 0.0]]
    normals: [[0.0, 0.0, 1.0], [0.0, 3.0, 4.0]]
    translation: [0.02, 0.0, 0.0]
    rotation: [0.0, 1.5707963267948966, 0.0]
    signs: [1, -1, 1]
''')
    return path


def test_a_layout_places_patches_and_their_axes(layout):
    found = read_layout(layout)
    assert found.positions[:4, :2].tolist() == [[-0.002, -0.002], [0.002, -0.002], [-0.002, 0.002], [0.002, 0.002]]
    assert np.allclose(found.positions[5], [0.02, 0.004, 0.0]) and np.allclose(found.normals[4], [1, 0, 0])
    assert np.allclose(np.linalg.norm(found.normals, axis=1), 1)
    frame = taxel_frame(found, np.tile([1.0, 2.0, 3.0], 6), 5, 'a frame')
    assert np.allclose(frame.forces[0], [1, 2, -3]), 'a press is positive'
    assert np.allclose(frame.forces[4], [3, -2, -1]), 'turned by 90 degrees about y, with signs of its own'
    with pytest.raises(BadFrame, match='17 numbers; the layout has 6 taxels'):
        taxel_frame(found, np.zeros(17), 0, 'a frame')


@pytest.mark.parametrize('text', ['', 'patches: []', 'patches: [{rows: 2}]', 'patches: [{positions: [[0, 0]]}]', '[1', 'patches: 3',
                                  'patches: [{positions: [[0, 0, 0]], normals: [[0, 0, 0]]}]',
                                  'patches: [{positions: [[0, 0, 0]], signs: [1, 0, 1]}]',
                                  'patches: [{positions: [[0, 0, 0]], x_axes: [[0, 0, 1]]}]', 'patches: [{positions: [[0, 0, .nan]]}]'])
def test_a_wrong_layout_is_refused_with_its_name(tmp_path, text):
    path = tmp_path / 'layout.yaml'
    path.write_text(text)
    with np.errstate(invalid='ignore'), pytest.raises(BadArgument, match='layout.yaml'):
        read_layout(path)


def test_a_frame_survives_the_message():
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(7, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frame = TaxelFrame(rng.normal(size=(7, 3)), normals, rng.normal(size=(7, 3)), 3)
    message = taxels_to_message(frame, header_of(3, 'skin'))
    for given, found in zip((frame.positions, frame.forces, frame.normals), taxels_of_message(message)):
        assert np.allclose(given, found, atol=1e-6)
    message.fields = [field for field in message.fields if not field.name.startswith('normal')]
    assert taxels_of_message(message)[2] is None
    message.width = 6
    with pytest.raises(BadFrame, match='bytes for 6 points'):
        taxels_of_message(message)


def cloud(rows, names=('x', 'y', 'z', 'fx', 'fy', 'fz'), kind='<f4'):
    """A message of points (N, K) with these fields."""
    rows = np.asarray(rows, kind)
    fields = [PointField(name=name, offset=k * rows.itemsize, count=1, datatype={'f4': 7, 'f8': 8, 'i2': 3}[kind[1:]])
              for k, name in enumerate(names)]
    return PointCloud2(height=1, width=len(rows), fields=fields, point_step=rows.shape[1] * rows.itemsize, row_step=rows.nbytes,
                       is_bigendian=kind[0] == '>', data=rows.tobytes())


@pytest.mark.parametrize('kind', ['<f4', '>f4', '<f8', '>f8'])
def test_a_cloud_of_any_floats_is_read(kind):
    positions, forces, normals = taxels_of_message(cloud([[0.25, 0.5, 0, 1, 2, np.nan], [0.5, 0.5, 0, -4, 5, 6]], kind=kind))
    assert positions.tolist() == [[0.25, 0.5, 0], [0.5, 0.5, 0]] and normals is None
    assert forces[1].tolist() == [-4, 5, 6] and np.isnan(forces[0, 2]), 'a taxel without a reading'


@pytest.mark.parametrize(('message', 'text'), [
    (cloud([[np.nan, 0, 0, 1, 2, 3]]), 'a position is not finite'), (cloud([[1e3, 0, 0, 1, 2, 3]]), 'beyond 100 m'),
    (cloud([[0, 0, 0, 1, 2, 1e12]]), 'a force beyond'), (cloud(np.zeros((0, 6))), '1 to 10000 points'),
    (cloud([[0] * 6], kind='<i2'), 'field x has to be float32 or float64'),
    (cloud([[0] * 5], ('x', 'y', 'z', 'fx', 'fy')), 'field fz is missing'),
    (cloud([[0] * 9], ('x', 'y', 'z', 'fx', 'fy', 'fz', 'normal_x', 'normal_y', 'normal_z')), 'a normal does not have length 1')])
def test_a_wrong_cloud_is_refused_with_its_fault(message, text):
    with pytest.raises(BadFrame, match=text):
        taxels_of_message(message)


def test_a_table_of_a_papillarray_is_read_by_the_names_of_its_columns(tmp_path):
    names = ['timestamp'] + [f'pil{k}_{name}' for k in range(9) for name in ('fx', 'fy', 'fz', 'contact')] + ['position']
    rows = np.arange(2 * len(names), dtype=float).reshape(2, -1)
    path = tmp_path / 'log.csv'
    path.write_text('\n'.join([','.join(names), *(','.join(map(str, row)) for row in rows)]))
    frames, times = read_vector_file(path, 9, r'pil\d_f[xyz]')
    assert frames.shape == (2, 27) and frames[0, :4].tolist() == [1, 2, 3, 5] and times.tolist() == rows[:, 0].tolist()
    with pytest.raises(BadRecording, match='set layout to the file of this device, or columns'):
        read_vector_file(path, 9)


def test_a_table_with_other_columns_and_times_of_day(tmp_path):
    path = tmp_path / 'log.csv'
    path.write_text('Timestamp,total Z,a X,a Y,a Z,b X,b Y,b Z\n23:15:05.90,9,1,2,3,4,5,6\n23:15:06.00,9,7,8,9,10,11,12\n')
    frames, times = read_vector_file(path, 2, r'[ab] [XYZ]')
    assert frames.tolist() == [[1, 2, 3, 4, 5, 6], [7, 8, 9, 10, 11, 12]] and np.isclose(np.diff(times), 0.1)
    with pytest.raises(BadRecording, match='7 numbers, 2 taxels have 6'):
        read_vector_file(path, 2)
    with pytest.raises(BadRecording, match=r"'\[ab\]' as a whole; the names are: Timestamp, total Z, a X"):
        read_vector_file(path, 2, '[ab]')
    np.savez(tmp_path / 'log.npz', forces=np.zeros((4, 2, 3)), t=np.arange(4.0))
    assert read_vector_file(tmp_path / 'log.npz', 2)[0].shape == (4, 6)
    (tmp_path / 'plain.csv').write_text('0.5,1,2,3\n0.6,4,5,6\n')
    frames, times = read_vector_file(tmp_path / 'plain.csv', 1)
    assert frames.tolist() == [[1, 2, 3], [4, 5, 6]] and times.tolist() == [0.5, 0.6]


def test_a_file_is_played_with_its_layout(tmp_path, layout):
    path = tmp_path / 'log.csv'
    np.savetxt(path, np.arange(36.0).reshape(2, 18), delimiter=',')
    source = VectorFileSource(PLAYED | {'path': str(path), 'layout': str(layout)}, time.time_ns)
    source.open()
    assert np.allclose(source.read().forces[1], [3, 4, -5])
    source.read()
    with pytest.raises(EndOfSource):
        source.read()


@pytest.mark.parametrize(('values', 'bits'), [(np.array([[1, -2, 300], [-32768, 32767, 0]]), 16), (np.array([[0.5, -1e6, 1e-3]]), 32)])
def test_signed_vectors_survive_the_protocol(values, bits):
    reader = BinaryReader(VECTORS, None, 3)
    data = write_frame(CountFrame(values, 7, 0, 0, bits), VECTORS)
    frame, = reader.feed(b'\x00' + data + write_frame(CountFrame(np.ones((1, 3), int), 7, 0, 1, 16), MATRIX))
    assert np.array_equal(frame.values, values.astype(frame.values.dtype)) and reader.counts.refused == 1
    with pytest.raises(BadArgument, match='vectors 16 or 32'):
        write_frame(CountFrame(values, 7, 0, 0, 12), VECTORS)


def test_an_emulated_device_is_read_in_spite_of_faults(tmp_path):
    import threading
    path = tmp_path / 'layout.yaml'
    path.write_text('patches: [{rows: 4, columns: 4, pitch: 0.0047}]')
    emulator, stop = VectorEmulator(tmp_path / 'port', 'uskin_demo', 200.0), threading.Event()
    emulator.sent = []
    source = VectorSerialSource({'device': str(tmp_path / 'port'), 'baud': 921600, 'layout': str(path)}, time.time_ns)
    source.open()
    sender = threading.Thread(target=emulator.run, args=(stop.is_set,))
    sender.start()
    found, end = [], time.monotonic() + 20
    try:
        while len(found) < 60 and time.monotonic() < end:
            try:
                found.append(source.read())
            except NothingYet:
                continue
            if len(found) == 20:
                emulator.fault('swap')
    finally:
        stop.set()
        sender.join()
        source.close()
    sent = np.array([counts[3] for counts in emulator.sent])
    assert len(found) == 60
    for frame in found:
        assert (np.abs(sent * [1, 1, -1] - frame.forces[3]) < 1e-3).all(axis=1).any(), 'a frame that was not sent'
    assert np.all(np.diff([frame.stamp_ns for frame in found]) > 0)


def test_a_bag_of_clouds_and_one_of_arrays_are_played(tmp_path, layout):
    from std_msgs.msg import Float32MultiArray
    frame = taxel_frame(read_layout(layout), np.arange(18.0), 10**9, 'a frame')
    write_messages(tmp_path / 'clouds', '/skin', [(10**9, 'taxels', taxels_to_message(frame, header_of(10**9, 'skin')))])
    write_messages(tmp_path / 'arrays', '/skin', [(2 * 10**9, 'raw', Float32MultiArray(data=[float(k) for k in range(18)]))])
    for name, stamp in (('clouds', 10**9), ('arrays', 2 * 10**9)):
        source = VectorBagSource(PLAYED | {'path': str(tmp_path / name), 'layout': str(layout)}, time.time_ns)
        source.open()
        played = source.read()
        assert played.stamp_ns == stamp and np.allclose(played.forces, frame.forces) and np.allclose(played.positions, frame.positions)
        source.close()


def test_arrays_of_another_layout_in_a_bag_are_refused_with_both_numbers(tmp_path, layout):
    from std_msgs.msg import Float32MultiArray
    write_messages(tmp_path / 'bag', '/skin', [(10**9, 'raw', Float32MultiArray(data=[0.0] * 15))])
    source = VectorBagSource(PLAYED | {'path': str(tmp_path / 'bag'), 'layout': str(layout)}, time.time_ns)
    source.open()
    with pytest.raises(BadFrame, match='15 numbers; the layout has 6 taxels'):
        source.read()
    source.close()
    with pytest.raises(BadArgument, match='no_such.yaml'):
        VectorBagSource(PLAYED | {'path': str(tmp_path / 'bag'), 'layout': str(tmp_path / 'no_such.yaml')}, time.time_ns).open()


def test_frames_of_another_number_of_taxels_on_a_port_are_refused():
    reader = BinaryReader(VECTORS, 4, 3)
    frames = list(reader.feed(write_frame(CountFrame(np.zeros((5, 3)), 7, 0, 0, 32), VECTORS)
                              + write_frame(CountFrame(np.ones((4, 3)), 8, 0, 1, 32), VECTORS)))
    assert [frame.values.shape for frame in frames] == [(4, 3)] and reader.counts.refused == 1


@pytest.mark.parametrize('device', DEVICES)
def test_a_simulated_device_obeys_coulomb_and_adds_up(device):
    scene, slid = open_vector_scene(f'{device}_demo', 50.0, 1), []
    for number in range(scene.frames):
        _, truth = scene.render(number / 50.0)
        pulled = np.linalg.norm(scene.bed.forces + scene.bed.pressed[:, None] * scene.shape.facing, axis=1)
        assert (pulled <= 0.6 * 1.6 * scene.bed.pressed + 1e-9).all()
        assert np.allclose(truth.wrench[:3], scene.bed.forces.sum(axis=0))
        slid.append(truth.slipping_fraction)
    assert max(slid) > 0.9 and slid[round(2.4 * 50)] == 0 and 0.05 < np.mean(np.array(slid) > 0.5) < 0.6


def test_the_simulated_source_has_truth():
    source = VectorSimulatedSource({'scene': 'demo', 'rate': 200.0, 'seed': 1}, time.time_ns)
    source.open()
    frame = source.read()
    assert frame.forces.shape == (16, 3) and frame.truth.wrench.shape == (6,)
    with pytest.raises(BadArgument, match='uskin_demo'):
        VectorSimulatedSource({'scene': 'nowhere', 'rate': 200.0, 'seed': 1}, time.time_ns).open()
