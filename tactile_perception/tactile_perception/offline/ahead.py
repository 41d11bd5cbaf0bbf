# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the first part of a stream in another process, so that two cores work on it."""
from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection

from ..errors import BadArgument, BadCalibration, BadFrame, BadRecording, TactileError
from .bags import RawMessage

_TOLD = (BadArgument, BadCalibration, BadFrame, BadRecording)
_ENDING_S = 5.0


class _End:
    """The last thing that is sent; error: what ended the work, None where it is done."""

    def __init__(self, error: Exception | None = None):
        self.error = error


def ahead(make: Callable[[], Iterator]) -> Iterator:
    """The items of make(), a function of a module or a partial of one, made in another process while those before are worked on.

    Raises what make() raises. Ends the process when it is closed.
    """
    context = get_context('spawn')
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(sender, make), daemon=True)
    process.start()
    sender.close()
    try:
        while not isinstance(item := receiver.recv(), _End):
            yield item
        if item.error is not None:
            raise item.error
    except EOFError:
        raise RuntimeError('the process that works ahead has ended before its work was done') from None
    finally:
        receiver.close()
        process.join(_ENDING_S)
        if process.is_alive():
            process.terminate()


def _send(sender: Connection, make: Callable[[], Iterator]) -> None:
    """The other process: whoever reads decides when it ends."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    with suppress(BrokenPipeError):
        try:
            for item in make():
                sender.send(item._replace(message=None) if isinstance(item, RawMessage) else item)
            sender.send(_End())
        except TactileError as error:
            sender.send(_End(error if isinstance(error, _TOLD) else TactileError(str(error))))
