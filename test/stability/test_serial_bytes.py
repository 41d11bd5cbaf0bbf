# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Any bytes from a serial port: no exception, no false sample, and the second frame after the damage is received."""
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from tactile_driver.serial.frames import MATRIX, SAMPLES, BinaryReader, CountFrame, LineReader, write_frame, write_line

FEW = settings(derandomize=True, database=None, deadline=None, max_examples=120, suppress_health_check=list(HealthCheck))
MANY = settings(FEW, max_examples=6000)
RNG = np.random.default_rng(2)
SENT = [CountFrame(RNG.integers(0, 4096, (5, 4)).astype(np.uint16), 1000 * k, 200_000, k, 12) for k in range(9)]
PICTURES = [CountFrame(RNG.integers(0, 256, (6, 7)).astype(np.uint8), 1000 * k, 0, k, 8) for k in range(9)]
CLEAN = 3  # undamaged frames at the end


class Binary:
    """Frames of samples, or pictures."""

    def __init__(self, sent, kind):
        self.sent, self.expected = sent, (kind, *((None, 4) if kind == SAMPLES else sent[0].values.shape))
        self.pieces = [write_frame(frame, kind) for frame in sent]

    def reader(self):
        return BinaryReader(*self.expected)

    def number(self, frame):
        """Which of those sent a frame is; fails where it is none."""
        true = self.sent[frame.sequence]
        assert np.array_equal(frame.values, true.values) and (frame.time_us, frame.bits) == (true.time_us, true.bits)
        return frame.sequence


class Lines:
    """Lines with a check sum."""

    def __init__(self, sent):
        self.rows = {tuple(frame.values[0].tolist()): k for k, frame in enumerate(sent)}
        self.pieces = [write_line(frame.values[0].tolist(), frame.time_us) for frame in sent]

    def reader(self):
        begun = LineReader(4, 12)
        assert len(begun.feed(b'\n' + write_line([1, 2, 3, 4], 0))) == 1
        return begun

    def number(self, frame):
        """As of Binary."""
        return self.rows[tuple(frame.values[0].tolist())]


FORMS = {'samples': Binary(SENT, SAMPLES), 'pictures': Binary(PICTURES, MATRIX), 'lines': Lines(SENT)}
position = st.integers(0, 10**6)
damage = st.one_of(
    st.tuples(st.just('change'), position, st.integers(1, 255)), st.tuples(st.just('swap'), position, st.just(0)),
    st.tuples(st.just('drop'), position, st.integers(1, 90)), st.tuples(st.just('insert'), position, st.binary(min_size=1, max_size=60)),
    st.tuples(st.just('repeat'), position, st.integers(1, 60)))


def damaged(data, kind, where, what):
    """Bytes with one thing wrong."""
    at = where % len(data) if data else 0
    if kind == 'change' and data:
        return data[:at] + bytes([data[at] ^ what]) + data[at + 1:]
    if kind == 'swap':
        return data[:at] + data[at:at + 2][::-1] + data[at + 2:]
    if kind == 'drop':
        return data[:at] + data[at + what:]
    return data[:at] + (what if kind == 'insert' else data[at:at + what]) + data[at:]


def check_stream(form, faults, step):
    """Damaged frames and then clean ones, read in portions; whether the second clean one and all after it are there. Bytes read."""
    form, count = FORMS[form], len(SENT) - CLEAN
    data = b''.join(form.pieces[:count])
    for fault in faults:
        data = damaged(data, *fault)
    data += b''.join(form.pieces[count:])
    reader = form.reader()
    seen = [form.number(frame) for k in range(0, len(data), step) for frame in reader.feed(data[k:k + step])]
    assert seen[-(CLEAN - 1):] == list(range(count + 1, len(SENT))), 'the second clean frame and those after it are there'
    assert len(seen) <= len(SENT) + 4 * sum(kind == 'repeat' for kind, *_ in faults), 'none comes of itself'
    return len(data)


@pytest.mark.parametrize('form', FORMS)
@FEW
@given(faults=st.lists(damage, max_size=12), step=st.integers(1, 400))
def test_no_false_sample_and_the_second_frame_is_there(form, faults, step):
    check_stream(form, faults, step)


@pytest.mark.parametrize('form', FORMS)
@FEW
@given(data=st.binary(max_size=3000), step=st.integers(1, 400))
def test_random_bytes_tell_nothing(form, data, step):
    reader = FORMS[form].reader()
    assert not [frame for k in range(0, len(data), step) for frame in reader.feed(data[k:k + step])]
    seen = [FORMS[form].number(frame) for piece in FORMS[form].pieces for frame in reader.feed(piece)]
    assert seen in (list(range(9)), list(range(1, 9)))


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize('form', FORMS)
def test_a_million_mutated_bytes(form):
    read = []

    @MANY
    @given(faults=st.lists(damage, max_size=12), step=st.integers(1, 400))
    def check(faults, step):
        read.append(check_stream(form, faults, step))

    check()
    assert sum(read) > 1e6
