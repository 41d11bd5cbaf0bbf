# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag writes every estimate under the stamps that came in, the same each time, and says what it refused."""
import hashlib

import numpy as np
import pytest
from tactile_perception.nodes.serialization import MessageCodec
from tactile_perception.offline import process_bag as module
from tactile_perception.offline.bags import BagReader, BagWriter

RESULTS = ('dots', 'contact_region', 'contacts', 'slip', 'wrench')


def run(source, target, *more):
    return module.main([str(source), str(target), '--params', f'{source}.yaml', *more])


def decoded(bag):
    codec, found = MessageCodec(), {}
    with BagReader(bag) as reader:
        for message in reader.messages():
            found.setdefault(message.topic.removeprefix('/touchpad/'), []).append(
                (message.stamp_ns, codec.decode(message.data, message.type_name))
            )
    return found


@pytest.fixture(scope='module')
def processed(pressed_bag, tmp_path_factory):
    target = tmp_path_factory.mktemp('out') / 'out'
    assert run(pressed_bag, target) == 0
    return target


def test_every_image_has_every_estimate_under_its_own_stamp(pressed_bag, processed):
    raw, found = decoded(pressed_bag), decoded(processed)
    stamps = [stamp for stamp, _ in raw['image_raw']]
    for topic in RESULTS:
        assert [stamp for stamp, _ in found[topic]] == stamps
        assert all(m.header == image.header for (_, m), (_, image) in zip(found[topic], raw['image_raw']))
    assert 'image_raw' not in found and len(found['ground_truth/contacts']) == len(stamps)


def test_the_press_is_found_where_it_is(processed):
    found = decoded(processed)
    pairs = [(truth, estimate) for (_, truth), (_, estimate) in zip(found['ground_truth/contacts'], found['contacts'])]
    assert not any(estimate.contacts for truth, estimate in pairs if not truth.contacts)
    deep = [(t.contacts[0], e.contacts[0]) for t, e in pairs if t.contacts and t.contacts[0].depth > 1e-3]
    assert len(deep) >= 4
    off = [np.hypot(t.position.x - e.position.x, t.position.y - e.position.y) for t, e in deep]
    assert np.median(off) < 0.4e-3
    assert np.median([abs(t.depth - e.depth) for t, e in deep]) < 0.3e-3


def test_two_runs_write_the_same_bytes(pressed_bag, processed, tmp_path):
    assert run(pressed_bag, tmp_path / 'again') == 0

    def digest(bag):
        with BagReader(bag) as reader:
            return hashlib.sha256(b''.join(m.topic.encode() + m.data for m in reader.messages())).hexdigest()
    assert digest(tmp_path / 'again') == digest(processed)


def test_a_bad_frame_is_counted_and_the_next_good_one_is_done(pressed_bag, tmp_path, capsys):
    codec = MessageCodec()
    with BagReader(pressed_bag) as reader, BagWriter(tmp_path / 'bad', codec.store) as writer:
        for k, m in enumerate(reader.messages({'/touchpad/image_raw', '/touchpad/camera_info'})):
            data = m.data
            if m.topic.endswith('image_raw') and k // 2 == 5:
                image = codec.decode(data, m.type_name)
                image.data = image.data[:1000]
                data = codec.encode(image)[1]
            writer.write(m.topic, m.type_name, m.stamp_ns, data)
    (tmp_path / 'bad.yaml').write_text((pressed_bag.parent / 'disc.yaml').read_text())
    assert run(tmp_path / 'bad', tmp_path / 'out') == 0
    assert 'refused 1 frames: image: 480 rows' in capsys.readouterr().out
    assert len(decoded(tmp_path / 'out')['dots']) == 13


@pytest.mark.parametrize('source, more, message', [
    ('none', (), 'no such file'), ('disc', ('--namespace', 'elsewhere'), 'no /elsewhere/image_raw'),
    ('disc', ('--calibration', 'none.yaml'), 'none.yaml')])
def test_what_cannot_be_processed_is_said_in_one_line(pressed_bag, tmp_path, capsys, source, more, message):
    given = [str(pressed_bag.parent / source), str(tmp_path / 'out'), '--params', f'{pressed_bag}.yaml', *more]
    assert module.main(given) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith('process_bag: ') and message in lines[0]
