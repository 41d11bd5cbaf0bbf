# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that are written as CDR bytes at once, without a Python object a field."""
from __future__ import annotations

import struct
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, DTypeLike
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

_ENCAPSULATION = b'\0\1\0\0'  # CDR, little-endian; alignment counts from its end


class WrittenMessage:
    """A message with a header as the CDR bytes that rclpy publishes and rosbag2 records.

    Its other fields are added in the order of their definition. A field that is read as an attribute is that of `message`.

    Parameters
    ----------
    kind : type
        Type of the message.
    header : Header
        Its header.

    Notes
    -----
    Plain CDR as Fast DDS writes it (OMG formal/2004-03-12, 15.3): a value is aligned to its size; padding is zero.
    """

    def __init__(self, kind: type, header: Header):
        frame = header.frame_id.encode() + b'\0'
        self.kind, self._data = kind, bytearray(_ENCAPSULATION)
        self._data += struct.pack(f'<iII{len(frame)}s', header.stamp.sec, header.stamp.nanosec, len(frame), frame)

    def __getattr__(self, name: str):
        if name.startswith('_'):  # copy and pickle ask for them before there is a message
            raise AttributeError(name)
        return getattr(self.message, name)

    @property
    def cdr(self) -> bytes:
        """The bytes."""
        return bytes(self._data)

    @cached_property
    def message(self):
        """The message, decoded when it is first asked for."""
        return deserialize_message(self.cdr, self.kind)

    def add(self, kind: DTypeLike, values: ArrayLike) -> None:
        """Add a number, or an array of fixed length.

        Parameters
        ----------
        kind : dtype
            Of one number.
        values : array_like
            The numbers, one at least.
        """
        numbers = np.ascontiguousarray(values, kind)
        self._align(numbers.itemsize)
        self._data += numbers.tobytes()

    def add_count(self, count: int) -> None:
        """Add the number of entries of a sequence, or another uint32."""
        self._align(4)
        self._data += struct.pack('<I', count)

    def add_sequence(self, kind: DTypeLike, values: ArrayLike) -> None:
        """Add a sequence.

        Parameters
        ----------
        kind : dtype
            Of one number.
        values : array_like, shape (N,) or (N, M)
            Numbers, or entries of M numbers.
        """
        self.add_count(len(values))
        if len(values):
            self.add(kind, values)

    def add_bytes(self, data: bytes) -> None:
        """Add what is written already, aligned to 4 bytes."""
        self._align(4)
        self._data += data

    def _align(self, size: int) -> None:
        self._data += bytes((len(_ENCAPSULATION) - len(self._data)) % size)
