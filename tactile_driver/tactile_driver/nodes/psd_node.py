# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node: publishes the voltages of a PSD finger from a serial port, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

import sys
from functools import partial

from .driver_node import DriverNode
from ..parameters.psd import PSD_DRIVER_PARAMETERS
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.registry import PSD_SOURCES, make_source
from .streams.voltage import VoltageStream, voltage_publishers


class PsdNode(DriverNode):
    """One PSD finger."""

    def __init__(self, host: Host | None = None):
        super().__init__('psd_node', PSD_DRIVER_PARAMETERS, 'psd finger', host)
        self._outputs = voltage_publishers(self)

    def open_stream(self, values: dict) -> VoltageStream:
        """See DriverNode."""
        return VoltageStream(self, self._outputs, self.opened(partial(make_source, PSD_SOURCES), values), values)


def main(args: list[str] | None = None) -> None:
    """Entry point of psd_node."""
    sys.exit(run_node(PsdNode, args))


if __name__ == '__main__':
    main()
