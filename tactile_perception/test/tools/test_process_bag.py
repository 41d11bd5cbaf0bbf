# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag writes every estimate under the stamps that came in, the same bytes each time, interrupted or not, and says what it left;
evaluate judges them: a table, JSON and pictures."""
import json
import os
import signal

import numpy as np
import pytest
from taxel_bags import write_taxels

from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode, type_hash
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.bags.replay import Replay
from tactile_perception.core.errors import BadArgument
from tactile_perception.tools import evaluate, process_bag as module

RESULTS = ('dots', 'contact_region', 'contacts', 'slip', 'wrench', 'points')


def run(source, target, *more):
    return module.main([str(source), str(target), '--params', f'{source}.yaml', *more])


def decoded(bag):
    found = {}
    with BagReader(bag) as reader:
        for message in reader.messages():
            found.setdefault(message.topic.removeprefix('/touchpad/'), []).append(
                (message.stamp_ns, decode(message.data, message.type_name))
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


def files(bag):
    """Name -> bytes of all files of a bag."""
    return {file.name: file.read_bytes() for file in bag.rglob('*') if file.is_file()}


@pytest.mark.full
def test_two_runs_write_the_same_bytes(pressed_bag, processed, tmp_path):
    assert run(pressed_bag, tmp_path / 'out') == 0
    assert files(tmp_path / 'out') == files(processed)
    assert sorted(files(processed)) == ['metadata.yaml', 'out_0.mcap']


def cut(k, image):
    if k == 5:
        image.data = image.data[:100]
    return encode(image)[1]


def damaged(k, image):
    return encode(image)[1][:40 if k in (5, 6) else None]


def smaller(k, image):
    if k == 5:
        image.width, image.height, image.step, image.data = 12, 14, 12, bytes(12 * 14)
    return encode(image)[1]


def back(k, image):
    if k == 15:
        image.header.stamp.nanosec = 2000
    return encode(image)[1]


@pytest.mark.parametrize('change, count, reported', [
    (cut, 1, '1 of image_raw: taxel image: 16 rows'), (damaged, 2, '2 of image_raw: 40 bytes cannot be decoded as sensor_msgs/msg/Image'),
    (smaller, 1, '1 of image_raw: taxel image'), (back, 1, '1 of image_raw: stamps go back by 0.3 s')])
def test_bad_frames_are_named_and_counted_and_the_next_good_one_is_done(tmp_path, capsys, change, count, reported):
    assert run(write_taxels(tmp_path / 'bad', change=change), tmp_path / 'out') == module.INCOMPLETE
    out = capsys.readouterr().out
    assert reported in out and out.count('left out') == 1, out
    assert len(decoded(tmp_path / 'out')['/pad/contacts']) == 30 - count


def test_without_one_usable_frame_there_is_nothing(tmp_path, capsys):
    assert run(write_taxels(tmp_path / 'bad', change=lambda *_: b'none'), tmp_path / 'out') == module.FAILED
    said = capsys.readouterr().err
    assert '30 of image_raw: 4 bytes cannot be decoded' in said and said.startswith('process_bag: no result could be computed\n')


def test_a_bag_that_is_cut_off_is_done_as_far_as_it_goes(tmp_path, capsys):
    source = write_taxels(tmp_path / 'bag', frames=48, shape=(256, 256))
    data = (source / 'bag_0.mcap').read_bytes()
    (source / 'bag_0.mcap').write_bytes(data[:len(data) * 6 // 10])
    (source / 'metadata.yaml').unlink()
    assert run(source, tmp_path / 'out') == module.INCOMPLETE
    out = capsys.readouterr().out
    assert 'there is no metadata.yaml: the recording was cut off' in out
    assert len(decoded(tmp_path / 'out')['/pad/contacts']) == 16


@pytest.mark.parametrize('type_name, reported',
                         [('no_msgs/msg/None', 'is not installed'), ('tactile_msgs/msg/Slip', 'is defined otherwise')])
def test_what_is_kept_is_left_out_where_its_type_is_not_known(tmp_path, capsys, type_name, reported):
    plain, source = write_taxels(tmp_path / 'plain', 3), tmp_path / 'bag'
    with BagReader(plain) as reader, BagWriter(source) as writer:
        for message in reader.messages():
            writer.write(*message[:4])
        writer.write('/pad/ground_truth/slip', 'tactile_msgs/msg/Slip', 2_200_000_000, bytes(12))
    metadata = source / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace(type_hash('tactile_msgs/msg/Slip'), 'RIHS01_' + 64 * '1').replace(
        'tactile_msgs/msg/Slip', type_name))
    (tmp_path / 'bag.yaml').write_text((tmp_path / 'plain.yaml').read_text())
    assert run(source, tmp_path / 'out') == module.INCOMPLETE
    assert f'1 of ground_truth/slip: type {type_name} {reported}' in capsys.readouterr().out
    with BagReader(tmp_path / 'out') as reader:
        assert '/pad/ground_truth/slip' not in reader.topics and '/pad/slip' in reader.topics


def test_what_was_interrupted_can_be_read_and_is_not_overwritten(tmp_path):
    replay, target, asked = Replay(write_taxels(tmp_path / 'bag'), tmp_path / 'bag.yaml'), tmp_path / 'out', iter(range(1, 1000))
    module.process_bag(replay, target, stopped=lambda: next(asked) >= 12)
    assert replay.done == len(decoded(target)['/pad/contacts']) == 12
    with pytest.raises(BadArgument, match='exists'):
        module.process_bag(replay, target)


def test_what_failed_amid_the_work_can_be_read(tmp_path):
    replay, target, asked = Replay(write_taxels(tmp_path / 'bag'), tmp_path / 'bag.yaml'), tmp_path / 'out', iter(range(1000))

    def fail():
        raise MemoryError
    with pytest.raises(MemoryError):
        module.process_bag(replay, target, stopped=lambda: next(asked) >= 20 and fail())
    assert len(decoded(target)['/pad/contacts']) == 21


def test_a_signal_ends_it_with_its_number(tmp_path, capsys, monkeypatch):
    source, write, written = write_taxels(tmp_path / 'bag'), BagWriter.write, []

    def interrupting(self, topic, *message):
        write(self, topic, *message)
        written.append(topic)
        if written.count('/pad/contacts') == 4 and topic == '/pad/contacts':
            os.kill(os.getpid(), signal.SIGTERM)
    monkeypatch.setattr(BagWriter, 'write', interrupting)
    before = signal.getsignal(signal.SIGTERM)
    assert run(source, tmp_path / 'out') == 128 + signal.SIGTERM
    assert signal.getsignal(signal.SIGTERM) is before
    assert 'interrupted' in capsys.readouterr().err and len(decoded(tmp_path / 'out')['/pad/contacts']) == 4


@pytest.mark.parametrize('source, more, message', [
    ('none', (), 'no such file'), ('disc', ('--namespace', 'elsewhere'), 'no /elsewhere/image_raw'),
    ('disc', ('--calibration', 'none.yaml'), 'none.yaml')])
def test_what_cannot_be_processed_is_said_in_one_line(pressed_bag, tmp_path, capsys, source, more, message):
    given = [str(pressed_bag.parent / source), str(tmp_path / 'out'), '--params', f'{pressed_bag}.yaml', *more]
    assert module.main(given) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith('process_bag: ') and message in lines[0]


def test_a_video_is_no_bag_and_how_to_make_one_is_reported(tmp_path, capsys):
    (tmp_path / 'press.mp4').write_bytes(b'no bag')
    assert run(tmp_path / 'press.mp4', tmp_path / 'out') == module.FAILED
    assert 'record:=' in capsys.readouterr().err and not (tmp_path / 'out').exists()


@pytest.mark.full
def test_a_processed_bag_is_judged_by_the_truth_it_carries_as_if_computed_here(pressed_bag, tmp_path, capsys):
    assert module.main([str(pressed_bag), str(tmp_path / 'out'), '--params', f'{pressed_bag}.yaml']) == 0
    assert evaluate.main([str(tmp_path / 'out'), '--report', str(tmp_path / 'report')]) == 0
    out = capsys.readouterr().out
    assert '14 instants compared' in out and 'position of the contact' in out and 'states.png' in out
    report = json.loads((tmp_path / 'report/report.json').read_text())
    assert report['frames']['false'] == 0 and report['touches']['there'] == 1
    assert report['errors']['position']['median'] < 0.4 and report['errors']['depth']['median'] < 0.3
    assert report['errors']['region_overlap']['median'] > 0.85 and report['dot_states']['f1']['untouched'] > 0.97
    assert sum(map(sum, report['dot_states']['counts'])) == 14 * 529
    assert report['times']['stages_ms'] == report['times']['latency_ms'] == {}
    assert {path.name for path in (tmp_path / 'report').iterdir()} == {
        'report.json', 'report.txt', 'errors_over_time.png', 'errors_over_surface.png', 'states.png'}
    assert evaluate.main([str(pressed_bag), '--params', f'{pressed_bag}.yaml', '--report', str(tmp_path / 'again')]) == 0
    again = json.loads((tmp_path / 'again/report.json').read_text())
    assert again.pop('times')['stages_ms']['all']['median'] > 0
    report.pop('times')
    assert again == report


@pytest.mark.parametrize('arguments, message', [
    (['none'], 'no such file'), (['disc'], 'no estimates'), (['disc', '--namespace', 'elsewhere'], 'no /elsewhere/'),
    (['disc', '--calibration', 'x.yaml'], 'needs --params')])
def test_what_cannot_be_evaluated_is_said_in_one_line(pressed_bag, capsys, arguments, message):
    assert evaluate.main([str(pressed_bag.parent / arguments[0]), *arguments[1:]]) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith('evaluate: ') and message in lines[0]
