# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node as a user runs it: two files, one image with both views, two topics, a bag and the simulated sheet, watched over ROS."""
import re
from functools import partial

import cv2
import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import CameraInfo, Image
from stitchings import stitching, view
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.nodes.runtime.run import WRONG
from tactile_driver.recordings.writer import write_messages
from tactile_driver.stitching.methods import make_stitcher
from tactile_msgs.msg import Contacts
from watching import Watcher, ended, stamps

pytestmark = [pytest.mark.ros, pytest.mark.full]
WARN = b'\x01'


@pytest.fixture
def watcher():
    watcher = Watcher('dual_camera_node')
    yield watcher
    watcher.close()


@pytest.fixture
def cameras(start):
    """Starts the node with parameters."""
    return partial(start, 'dual_camera_node')


def views(k=0):
    """Left and right view of a sheet with a pattern that depends on k."""
    found = stitching()
    return [view(side, lambda x, y: 100 + 60 * np.sin(x / 4e-3 + k) + 30 * np.cos(y / 5e-3)) for side in (found.left, found.right)]


@pytest.fixture
def folders(tmp_path):
    """left, right and both (side by side): six images each; stitching.yaml."""
    (tmp_path / 'stitching.yaml').write_text(yaml.safe_dump({'fitted': {'stitching': stitching().to_dict()}}))
    for k in range(6):
        left, right = views(k)
        for name, image in (('left', left), ('right', right), ('both', np.hstack([left, right]))):
            (tmp_path / name).mkdir(exist_ok=True)
            cv2.imwrite(str(tmp_path / name / f'{k}.png'), image)
    return tmp_path


def picture_of(message):
    return np.frombuffer(bytes(message.data), np.uint8).reshape(message.height, message.width)


def collected(watcher):
    """Lists of (left, right, stitched) images and the stitched picture's camera_info, as they come."""
    topics = ('left/image_raw', 'right/image_raw', 'image_raw')
    return [watcher.collect(Image, topic, 100) for topic in topics] + [watcher.collect(CameraInfo, 'camera_info', 100)]


@pytest.mark.parametrize('layout', ['two', 'side_by_side'])
def test_files_come_as_two_views_and_as_one_picture(watcher, cameras, folders, layout):
    left, right, whole, infos = collected(watcher)
    path = {'path': folders / 'left', 'right_path': folders / 'right'} if layout == 'two' else {'path': folders / 'both'}
    process = cameras(source='file', layout=layout, rate=20, loop='true', stitching_path=folders / 'stitching.yaml', **path)
    watcher.until(lambda: min(map(len, (left, right, whole))) >= 8)
    expected = [make_stitcher('plane', stitching()).stitch(*views(k)) for k in range(6)]
    for message in whole:
        assert any((picture_of(message) == picture).all() for picture in expected)
    assert (whole[0].width, whole[0].height, whole[0].encoding, whole[0].header.frame_id) == (121, 61, 'mono8', 'areal_dual_camera_optical')
    assert set(stamps(whole)) <= set(stamps(left)) | {stamps(whole)[0], stamps(whole)[-1]}
    assert (left[0].width, left[0].height) == (96, 80) and (infos[0].width, infos[0].height, set(infos[0].k)) == (121, 61, {0.0})
    code, log = ended(process)
    assert (code, log) == (0, '')


def test_without_a_stitching_the_views_are_put_side_by_side_and_that_is_said(watcher, cameras, folders):
    whole, reports = watcher.collect(Image, 'image_raw', 100), watcher.collect(DiagnosticArray, '/diagnostics', 10)
    cameras(source='file', path=folders / 'left', right_path=folders / 'right', rate=20, loop='true', overlap=20)
    watcher.until(lambda: whole and any(s.level == WARN and 'stitching_path is empty' in s.message for m in reports for s in m.status))
    assert (whole[0].width, whole[0].height) == (2 * 96 - 20, 80)
    expected = [np.hstack([left[:, :86], right[:, 10:]]) for left, right in map(views, range(6))]
    assert any((picture_of(whole[0]) == picture).all() for picture in expected)


def write_bag(path, lost=()):
    """60 pairs at 60 Hz, the right camera 4 ms later; those right frames that are lost are left out."""
    views = [(10**9 + round(k * 1e9 / 60) + 4_000_000 * side, side, k) for k in range(60) for side in (0, 1) if not (side and k in lost)]
    write_messages(path, 'pad', ((stamp, ('left', 'right')[side] + '/image_raw', Image(
        header=header_of(stamp, 'pad'), height=80, width=96, encoding='mono8', step=96, data=bytes([k + 1]) * (80 * 96)))
        for stamp, side, k in views))
    return path


def test_a_bags_unpaired_frames_are_counted_and_never_paired_wrongly(watcher, cameras, tmp_path):
    whole, reports = watcher.collect(Image, 'image_raw', 100), watcher.collect(DiagnosticArray, '/diagnostics', 10)
    lost = {7, 8, 30}
    cameras(source='bag', path=write_bag(tmp_path / 'bag', lost), rate=0, max_skew=0.016)
    watcher.until(lambda: len(whole) >= 57)
    watcher.until(lambda: any(v.key == 'unpaired' and v.value == '3' for m in reports for s in m.status for v in s.values))
    kept = [k for k in range(60) if k not in lost]
    assert stamps(whole).tolist() == [10**9 + round(k * 1e9 / 60) for k in kept]
    for k, message in zip(kept, whole):
        assert set(message.data) == {k + 1}


def test_two_image_topics_are_stitched_and_not_published_again(watcher, cameras, folders):
    publishers = [watcher.node.create_publisher(Image, f'{name}/image_raw', 10) for name in ('left', 'right')]
    whole, reports = watcher.collect(Image, 'image_raw', 100), watcher.collect(DiagnosticArray, '/diagnostics', 10)
    cameras(source='topics', stitching_path=folders / 'stitching.yaml')
    watcher.until(lambda: all(p.get_subscription_count() for p in publishers))
    for k in range(40):
        for side, (publisher, image) in enumerate(zip(publishers, views(k))):
            stamp = 10**9 + k * 50_000_000 + side * 3_000_000
            if not (side == 0 and k >= 15):
                publisher.publish(image_to_message(Frame(image, stamp, 'mono8'), '', header_of(stamp, 'pad')))
        watcher.spin(0.05)
        assert all(watcher.node.count_publishers(f'/{name}/image_raw') == 1 for name in ('left', 'right'))
    watcher.until(lambda: any('no left camera' in s.message for m in reports for s in m.status))
    paired = [m for m in whole if (stamps([m])[0] - 10**9) % 50_000_000 == 0]
    alone = [m for m in whole if (stamps([m])[0] - 10**9) % 50_000_000 == 3_000_000]
    assert len(paired) >= 5 and len(alone) >= 1 and len(paired) + len(alone) == len(whole)
    k = int((stamps(paired)[0] - 10**9) // 50_000_000)
    assert (picture_of(paired[0]) == make_stitcher('plane', stitching()).stitch(*views(k))).all()
    assert all(not picture_of(m)[:, :61].any() and picture_of(m)[:, 70:].any() for m in alone)


def test_the_simulated_sheet_comes_with_its_truth(watcher, cameras):
    left, right, whole, _ = collected(watcher)
    truths, infos = watcher.collect(Contacts, 'ground_truth/contacts', 100), watcher.collect(CameraInfo, 'right/camera_info', 100)
    process = cameras(scene='areal_dual_rest', rate=5)
    watcher.until(lambda: min(map(len, (left, right, whole, truths, infos))) >= 3, 60.0)
    delays = {stamp: min(stamps(right) - stamp, key=abs) for stamp in stamps(left)[1:-1]}
    assert all(3e6 <= delay <= 4e6 for delay in delays.values())
    assert len(set(stamps(whole)) & set(stamps(left))) >= 2 and set(stamps(truths)) & set(stamps(whole))
    assert infos[0].k[0] > 100 and infos[0].distortion_model == 'plumb_bob'
    assert ended(process)[0] == 0


@pytest.mark.parametrize(('parameters', 'named'), [
    ({'stitching_path': '/nowhere.yaml'}, 'nowhere.yaml holds no stitching'), ({'scene': 'demo'}, 'one camera'),
    ({'source': 'file', 'path': '/nowhere', 'right_path': '/nowhere'}, 'nowhere')])
def test_what_is_missing_is_named_and_ends_it(cameras, parameters, named):
    process = cameras(**parameters)
    log = process.communicate(timeout=30)[1]
    assert process.returncode == WRONG and len(log.splitlines()) == 1 and re.search(named, log)


def test_cameras_that_are_missing_are_named_and_waited_for(cameras, watcher):
    process = cameras(source='device', device='a', right_device='b')
    assert watcher.state() == 'unconfigured'
    watcher.spin(0.5)
    code, log = ended(process)
    assert code == 0 and log.count('[ERROR]') == 1 and re.search("left: .*'a'.*right: .*'b'", log)
