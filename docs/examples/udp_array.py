# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_array_node for an array that sends its matrices by UDP."""
import socket

import numpy as np

from tactile_driver.errors import BadFrame, DeviceLost
from tactile_driver.frame import matrix_frame
from tactile_driver.sources.registry import TAXEL_SOURCES
from tactile_driver.sources.source import NothingYet, Source


class UdpSource(Source):
    """A datagram a frame. values: the node's parameters; device: the UDP port."""

    live = True

    def __init__(self, values, clock):
        self._port, self._shape, self._clock = int(values['device']), (values['rows'], values['columns']), clock

    def open(self):
        """Bind the port. Raises DeviceLost."""
        try:
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.bind(('', self._port))
            self._socket.settimeout(0.1)
        except OSError as error:
            raise DeviceLost(f'UDP port {self._port} cannot be opened: {error}') from error

    def read(self, wanted=True):
        """Return the next frame. Raises NothingYet, BadFrame."""
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            raise NothingYet from None
        rows, columns = self._shape
        if len(data) != rows * columns:
            raise BadFrame(f'a datagram of {len(data)} bytes is no frame of {rows} x {columns}; it is skipped')
        return matrix_frame(np.frombuffer(data, np.uint8).reshape(self._shape), self._shape, self._clock(), 'the datagram')

    def close(self):
        """Close the port."""
        self._socket.close()

    def describe(self):
        """What the topic description says."""
        return {'device': f'UDP port {self._port}', 'rate': 0.0}


TAXEL_SOURCES['udp'] = UdpSource

from tactile_driver.nodes.taxel_array_node import main  # noqa: E402  after the table: parameters list its names

if __name__ == '__main__':
    main()
