# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags of simulated touchpads, made once a session, and the parameter file that describes the specimen."""
import cv2
import pytest
import yaml
from tactile_driver.frame import Frame
from tactile_driver.nodes.conversions import header_of, image_to_message
from tactile_driver.nodes.ground_truth import TouchNumbers, contacts_message, region_message
from tactile_driver.simulation.scenes import open_scene
from tactile_perception.nodes.conversions import camera_info_message
from tactile_perception.nodes.serialization import MessageCodec
from tactile_perception.offline.bags import BagWriter


def write_scene(path, name, times, rate):
    """A bag of the scene's frames at the given times (s), and the parameter file beside it (path + .yaml)."""
    scene, codec, numbers = open_scene(name, rate=rate, seed=1), MessageCodec(), TouchNumbers()
    camera = scene.camera
    info = {'width': camera.width, 'height': camera.height, 'K': camera.matrix, 'dist_k1_k2_p1_p2_k3': camera.distortion}
    with BagWriter(path, codec.store) as writer:
        for time in times:
            seen, stamp = scene.render(time), round((time + 1) * 1e9)
            header = header_of(stamp, 'touchpad')
            for topic, message in {
                'camera_info': camera_info_message(info, header),
                'image_raw': image_to_message(Frame(seen.image, stamp, 'bgr8'), '', header),
                'ground_truth/contacts': contacts_message(seen.truth.contacts, numbers.assign(seen.truth.contacts), header),
                'ground_truth/contact_region': region_message(seen.truth, 1 / rate, header),
            }.items():
                type_name, data = codec.encode(message)
                writer.write(f'/touchpad/{topic}', type_name, stamp, data)
    values = {
        'camera.rotation': cv2.Rodrigues(camera.rotation)[0].ravel().tolist(),
        'camera.translation': camera.translation.ravel().tolist(),
    }
    path.with_name(path.name + '.yaml').write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))


@pytest.fixture(scope='session')
def pressed_bag(tmp_path_factory):
    """A disc pressed: two untouched frames, then the press, ten frames a second."""
    path = tmp_path_factory.mktemp('bags') / 'disc'
    write_scene(path, 'disc_twist', [0.1 * k for k in range(12, 26)], 10.0)
    return path
