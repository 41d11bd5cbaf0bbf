# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time in sources: stamps, paces, and scenes in real time; every source is made from its node's parameters; the thread that reads one."""
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fake_source import FakeSource, frame
from waiting import until

from tactile_driver.camera.file import TwoFilesSource
from tactile_driver.camera.pairs import PairedSource
from tactile_driver.camera.simulated import DualSimulatedSource
from tactile_driver.errors import BadArgument, BadFrame, BadRecording, DeviceLost
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS, DUAL_CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources import capture as capture_module, source as pacing
from tactile_driver.sources.capture import Capture, FrameQueue
from tactile_driver.sources.registry import CAMERA_SOURCES, DUAL_CAMERA_SOURCES, PSD_SOURCES, TAXEL_SOURCES, make_source
from tactile_driver.sources.source import NS, EndOfSource, EvenPace, PlayedSource, SceneSource, stamp_of


@pytest.fixture
def now(monkeypatch):
    """The monotonic clock, in a list of one entry, ns."""
    clock = [1_000_000_000_000]

    def sleep(seconds):
        clock[0] += round(seconds * NS)
    monkeypatch.setattr(pacing, 'time', SimpleNamespace(monotonic_ns=lambda: clock[0], sleep=sleep))
    return clock


def test_a_stamp_is_carried_over_to_the_other_clock(now):
    assert stamp_of(now[0] - 3_000_000, lambda: 77 * NS) == 77 * NS - 3_000_000
    assert stamp_of(now[0] - 3_000_000, lambda: 0) == 0


def test_deadlines_do_not_drift(now):
    pace = EvenPace(60.0)
    start = now[0]
    for k in range(600):
        due = pace.next()
        assert due == pytest.approx(start + k * NS / 60, abs=2)
        now[0] = due + 900_000  # whoever is a little late stays only a little late
    assert pace.skipped == 0


def test_a_camera_goes_on_while_its_reader_is_late(now):
    pace = EvenPace(10.0)
    first = pace.next()
    now[0] = first + int(0.35 * NS)
    assert pace.next() == first + int(0.3 * NS)
    assert pace.skipped == 2


class Played(PlayedSource):
    """Frames that are their recorded time, s, and their stamp."""

    def __init__(self, recorded, rate=-1.0, loop=False, clock=lambda: pacing.time.monotonic_ns()):
        super().__init__({'path': 'film', 'rate': rate, 'loop': loop}, clock)
        self.recorded = recorded
        self.open()

    def _items(self):
        return iter(self.recorded)

    def _recorded(self, item):
        return round(item * NS), item

    def _frame(self, content, stamp_ns):
        return content, stamp_ns


def test_a_recording_waits_for_its_reader(now):
    film = Played([0.0] * 4, rate=10.0)
    first = film.read()[1]
    now[0] = first + int(5.02 * NS)
    second = film.read()[1]
    assert 0 <= now[0] - second < NS // 10
    assert film.read()[1] == second + NS // 10


def test_as_fast_as_consumed_stamps_advance_by_the_recorded_intervals():
    film = Played([10.0, 10.5, 12.0], rate=0.0, loop=True, clock=lambda: 7 * NS)
    assert [film.read()[1] / NS for _ in range(5)] == [7.0, 7.5, 9.0, 10.5, 11.0], 'a restart repeats the last interval'
    film = Played([0.0] * 3, rate=0.0, clock=lambda: 7 * NS)
    assert [film.read()[1] - 7 * NS for _ in range(3)] == [0, 1, 2], 'a recording without times is stamped by the clock'


@pytest.mark.parametrize('stamp', [90, 200])
def test_stamps_that_jump_do_not_stop_the_recording(now, stamp):
    film = Played([100, stamp])
    assert film.read() == (100, now[0]) and film.read() == (stamp, now[0])


def test_a_paused_recording_does_not_rush(now):
    film = Played([100, 100.04, 100.08])
    film.read()
    now[0] += 30 * NS
    assert film.read()[1] == now[0] and film.read()[1] == pytest.approx(now[0], abs=NS // 1000)
    with pytest.raises(EndOfSource, match='film'):
        film.read()


class Counting(SceneSource):
    """Hands over the number of the first step and when that was due."""

    usual_rate = 200.0

    def _open_scene(self, name, rate, seed):
        return name

    def _make(self, number):
        return number

    def _handed_over(self, made, due_ns):
        return made, due_ns


def opened(rate=-1.0, count=1):
    source = Counting({'scene': 'any', 'rate': rate, 'seed': 0}, time.time_ns)
    source.count = count
    source.open()
    return source


def test_steps_come_in_order_at_their_pace(now):
    source = opened(count=4)
    numbers, due = zip(*(source.read() for _ in range(5)))
    assert numbers == (0, 4, 8, 12, 16)
    assert np.diff(due).tolist() == [NS // 50] * 4
    assert source.rate == 200.0 and source.describe()['scene'] == 'any' and source.calibrations() == (None, None)


def test_a_scene_stands_still_while_nobody_wants_it_and_begins_anew_when_opened_again(now):
    source = opened()
    assert source.read()[0] == 0
    assert [source.read(wanted=False) for _ in range(5)] == [None] * 5
    assert source.read()[0] == 1
    source.close()
    source.open()
    assert source.read()[0] == 0


def test_after_a_stall_only_a_few_steps_are_leapt_over_and_all_are_counted(now):
    source = opened()
    source.read()
    now[0] += NS // 10
    assert source.read()[0] == 1 + source.max_catch_up and source.skipped == 19


def test_no_rate_is_refused():
    with pytest.raises(BadArgument, match='real time.*200 Hz'):
        Counting({'rate': 0.0}, time.time_ns)


KINDS = [(CAMERA_SOURCES, CAMERA_PARAMETERS), (PSD_SOURCES, PSD_DRIVER_PARAMETERS), (TAXEL_SOURCES, TAXEL_DRIVER_PARAMETERS)]
TWO = {**defaults(DUAL_CAMERA_PARAMETERS), 'path': 'a', 'right_path': 'b', 'device': 'A1', 'right_device': 'B2'}


@pytest.mark.parametrize(('sources', 'table', 'name'), [(*kind, name) for kind in KINDS for name in kind[0]])
def test_every_source_is_made_from_the_nodes_parameters(sources, table, name):
    source = make_source(sources, {**defaults(table), 'source': name, 'path': 'somewhere', 'device': '/dev/x'}, time.time_ns)
    assert source.live == (name in ('sim', 'device')) and not source.on_demand
    source.close()


@pytest.mark.parametrize('sources', [kind[0] for kind in KINDS])
def test_an_unknown_source_is_answered_with_the_known_ones(sources):
    with pytest.raises(BadArgument, match=', '.join(sources)):
        make_source(sources, {'source': 'nix'}, time.time_ns)


def made(**values):
    return make_source(DUAL_CAMERA_SOURCES, {**TWO, **values}, time.time_ns)


@pytest.mark.parametrize(('name', 'kind', 'live'), [('sim', DualSimulatedSource, True), ('device', PairedSource, True),
                                                    ('file', TwoFilesSource, False), ('bag', PairedSource, False)])
def test_each_kind_of_two_cameras(name, kind, live):
    source = made(source=name)
    assert isinstance(source, kind) and source.live == live
    source.close()


def test_left_and_right_are_what_was_asked_for():
    assert made(source='device').describe()['path'] == 'A1 + B2'
    about = made(source='bag', right_path='').describe()
    assert (about['left']['path'], about['right']['path']) == ('a', 'a')
    assert made(source='file').describe()['path'] == 'a + b'


def recording(script):
    """It is read as fast as it is consumed."""
    return FakeSource(script, live=False, on_demand=True, period=0.0)


class Captured:
    """A capture of a script, with what it reported."""

    def __init__(self, source, subscribers=lambda: 1, settle=0.0):
        self.reports = []
        self.capture = Capture(source, subscribers, lambda level, text: self.reports.append((level, text)), settle=settle)

    def take_all(self, count):
        self.capture.resume()
        return [f.stamp_ns for f in (self.capture.take(20.0) for _ in range(count)) if f is not None]


@pytest.fixture
def captured():
    """Makes captures and stops them at the end."""
    made = []

    def make(source, **options):
        made.append(Captured(source, **options))
        return made[-1]
    yield make
    for each in made:
        each.capture.stop()


def test_a_recording_loses_nothing_however_slow_its_reader(captured):
    it = captured(recording(range(20)))
    it.capture.resume()
    seen = []
    for _ in range(20):
        seen.append(it.capture.take(20.0).stamp_ns)
        time.sleep(0.002)
    assert seen == list(range(20))
    assert until(lambda: it.capture.status.state == 'ended')
    assert it.reports == [('info', 'over')]
    assert it.capture.status.dropped == 0 and it.capture.status.received == 20


def test_of_a_camera_only_the_newest_frame_is_kept(captured):
    it = captured(FakeSource(period=0.002))
    it.capture.resume()
    it.capture.take(20.0)
    assert until(lambda: it.capture.status.dropped > 5)
    received = it.capture.status.received
    assert it.capture.take(20.0).stamp_ns >= received


def test_a_recording_waits_until_it_is_resumed_and_holds_when_paused(captured):
    source = recording(range(100))
    it = captured(source)
    time.sleep(0.05)
    assert source.asked == [] and it.capture.status.state == 'paused'
    assert it.take_all(3) == [0, 1, 2]
    it.capture.pause()
    assert until(lambda: it.capture.status.state == 'paused')
    read = len(source.asked)
    time.sleep(0.1)
    assert len(source.asked) == read


def test_a_camera_is_drained_but_not_decoded_while_nobody_wants_it(captured):
    source = FakeSource(period=0.002)
    it = captured(source, subscribers=lambda: 0)
    it.capture.resume()
    assert until(lambda: len(source.asked) > 10)
    assert not any(source.asked)
    assert it.capture.take(0.05) is None
    assert it.capture.status.received > 5


def test_as_fast_as_consumed_stands_still_without_a_consumer(captured):
    wanted = threading.Event()
    source = recording(range(5))
    it = captured(source, subscribers=wanted.is_set)
    it.capture.resume()
    time.sleep(0.1)
    assert source.asked == []
    wanted.set()
    assert it.take_all(5) == [0, 1, 2, 3, 4]


def test_a_recording_starts_once_no_more_subscribers_come(captured):
    names = ['first']
    it = captured(recording(range(3)), subscribers=lambda: len(names), settle=0.3)
    it.capture.resume()
    for name in ('second', 'third', 'fourth', 'fifth'):
        assert it.capture.take(0.1) is None
        names.append(name)
    last = time.monotonic()
    assert it.take_all(3) == [0, 1, 2] and time.monotonic() - last >= 0.25


def test_at_its_own_pace_a_recording_begins_with_its_first_consumer_and_goes_on_without(captured):
    wanted = threading.Event()
    source = FakeSource(range(5), live=False, period=0.0)
    source.read = paused_after(source.read, 1)
    it = captured(source, subscribers=wanted.is_set)
    it.capture.resume()
    time.sleep(0.1)
    assert source.asked == []
    wanted.set()
    assert it.take_all(1) == [0]
    wanted.clear()
    source.read.go_on.set()
    assert until(lambda: it.capture.take(0.01) is None and it.capture.status.state == 'ended')
    assert len(source.asked) == 6 and source.asked[-1] is False


def test_bad_frames_are_counted_said_once_and_skipped(captured):
    it = captured(recording([1, BadFrame('torn'), BadFrame('torn'), 2, BadFrame('torn'), 3]))
    assert it.take_all(3) == [1, 2, 3]
    assert it.capture.status.corrupt == 3
    assert it.capture.status.error == 'torn'
    assert [r for r in it.reports if r[0] == 'error'] == [('error', 'torn')]


def test_a_frame_of_another_size_is_skipped(captured):
    it = captured(recording([1, frame(2, (8, 8)), 3]))
    assert it.take_all(2) == [1, 3]
    assert it.capture.status.corrupt == 1
    assert '8 x 8' in it.capture.status.error


def test_the_newest_frame_s_failure_is_reported_until_a_good_one_comes(captured):
    source = FakeSource([1, BadFrame('torn')], period=0.0)
    source.read = paused_after(source.read, 2)
    it = captured(source)
    it.capture.resume()
    assert until(lambda: it.capture.status.failing)
    source.read.go_on.set()
    assert until(lambda: not it.capture.status.failing)
    assert it.capture.status.error == 'torn' and it.capture.status.corrupt == 1


def paused_after(read, count):
    """read, that waits for go_on after so many calls."""
    def paused(wanted=True):
        if paused.left == 0:
            paused.go_on.wait(60.0)
        paused.left -= 1
        return read(wanted)
    paused.left, paused.go_on = count, threading.Event()
    return paused


def test_a_camera_that_gives_another_size_for_good_is_set_up_anew(captured, monkeypatch):
    monkeypatch.setattr(capture_module, 'SOURCES', replace(capture_module.SOURCES, other_size_s=0.05))
    size, source = [(4, 6)], FakeSource()
    numbered = source.read
    source.read = lambda wanted=True: numbered(wanted) and frame(len(source.asked), size[0])
    it = captured(source)
    assert it.take_all(1)
    size[0] = (8, 8)
    assert until(lambda: len(it.reports) == 3 and it.capture.status.received > 3)
    (_, skipped), (_, lost), (_, back) = it.reports
    assert 'skipped' in skipped and '8 x 8 px among frames of 6 x 4 px, and no others any more' in lost and 'back' in back
    assert until(lambda: it.capture.take(20.0).image.shape == (8, 8, 3) and not it.capture.status.failing)


def test_a_lost_camera_is_opened_again(captured):
    source = FakeSource([1, DeviceLost('pulled out'), 7], period=0.002)
    source.open_errors = [DeviceLost('not there'), DeviceLost('still not there')]
    it = captured(source)
    it.capture.resume()
    assert until(lambda: len(it.reports) == 2)
    assert source.calls == ['open'] * 3
    assert until(lambda: it.capture.status.state == 'running')
    assert until(lambda: it.take_all(1)[0] >= 3)
    assert it.reports[0] == ('error', 'pulled out')
    assert it.reports[-1][0] == 'info' and 'back' in it.reports[-1][1]


@pytest.mark.parametrize(('error', 'said'), [(BadRecording('gone'), 'gone'), (RuntimeError('surprise'), 'surprise')])
def test_what_cannot_be_tried_again_ends_the_reading_with_a_word(captured, error, said):
    it = captured(recording([1, error]))
    assert it.take_all(1) == [1]
    assert until(lambda: it.capture.status.state == 'failed')
    assert said in it.capture.status.error
    assert len(it.reports) == 1


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand, s."""
    now = [100.0]
    monkeypatch.setattr(capture_module.time, 'monotonic', lambda: now[0])
    return now


def taken_of(clock, keep, rate, work_s, count=600):
    """(queue, [(number, s waited)]) of count frames at rate Hz, where each one that is taken takes work_s."""
    queue, taken, begin, number = FrameQueue(keep), [], clock[0], 0
    while number < count:
        while number < count and begin + number / rate <= clock[0]:
            queue.add(number)
            number += 1
        frame = queue.take()
        if frame is None:
            clock[0] = begin + number / rate
            continue
        taken.append((frame, clock[0] - begin - frame / rate))
        clock[0] += work_s
    return queue, taken


@pytest.mark.parametrize('work_s', [0.025, 0.05])
def test_too_slow_it_leaves_out_evenly_and_nothing_gets_old(clock, work_s):
    rate, count = 60, 480
    queue, taken = taken_of(clock, 1, rate, work_s, count)
    steady = [(number, waited) for number, waited in taken if number > 2 * rate]
    steps = np.diff([number for number, _ in steady])
    assert max(waited for _, waited in steady) < 0.06 + work_s
    assert steps.mean() == pytest.approx(rate * work_s, rel=0.1) and steps.max() <= np.ceil(rate * work_s) + 1
    assert 0 <= count - len(taken) - queue.left_out <= 0.06 * rate, 'but for those that still wait'
    assert queue.share_left_out == pytest.approx(1 - 1 / (rate * work_s), abs=0.05)


def test_fast_enough_it_leaves_nothing_out(clock):
    queue, taken = taken_of(clock, 1, 60, 0.015)
    assert [number for number, _ in taken] == list(range(600)) and (queue.left_out, queue.share_left_out) == (0, 0.0)
