# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What another process makes comes in order, its errors too; it ends with whoever reads."""
import multiprocessing
import os
from functools import partial

import pytest
from tactile_perception.errors import BadCalibration, DegenerateFit
from tactile_perception.offline import ahead as module
from tactile_perception.offline.bags import RawMessage


def counted(count, error=None):
    """Numbers, then an error; this module is imported by the other process too."""
    yield from range(count)
    if error is not None:
        raise error


class Sent(list):
    """A connection's sending end."""

    send = list.append


def test_items_and_errors_are_sent_in_order_messages_without_their_decoded_form(monkeypatch):
    monkeypatch.setattr(module.signal, 'signal', lambda *_: None)
    sent = Sent()
    module._send(sent, lambda: iter([1, RawMessage('/a', 'T', 3, b'x', object())]))
    assert sent[:2] == [1, RawMessage('/a', 'T', 3, b'x')] and sent[2].error is None
    for error, kind in ((BadCalibration('no'), BadCalibration), (DegenerateFit('too_few', 'two'), module.TactileError)):
        sent = Sent()
        module._send(sent, partial(counted, 2, error))
        assert sent[:2] == [0, 1] and type(sent[2].error) is kind and str(sent[2].error) == str(error)


def test_a_process_makes_them_and_ends():
    items = module.ahead(partial(range, 100_000))
    assert [next(items) for _ in range(3)] == [0, 1, 2]
    items.close()
    assert list(module.ahead(partial(range, 5))) == [0, 1, 2, 3, 4]
    assert multiprocessing.active_children() == []


def test_a_process_that_dies_is_told():
    with pytest.raises(RuntimeError, match='has ended before'):
        list(module.ahead(partial(os._exit, 3)))
