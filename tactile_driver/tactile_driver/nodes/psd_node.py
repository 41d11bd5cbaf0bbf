# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_node: a PSD finger on a serial port, a recording or a simulated one on voltages, as a lifecycle node."""
from __future__ import annotations

import sys

from .driver_node import DriverNode
from ..parameters.psd import PSD_DRIVER_PARAMETERS, check_together
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.psd.registry import make_psd_source
from .streams.voltage import VoltageStream, voltage_publishers


class PsdNode(DriverNode):
    """One finger."""

    def __init__(self, host: Host | None = None):
        super().__init__('psd_node', PSD_DRIVER_PARAMETERS, frozenset(), self._opened, 'psd finger', host)
        self._outputs = voltage_publishers(self)

    def _opened(self, values: dict) -> VoltageStream:
        check_together(values)
        source = make_psd_source(values, self.now_ns)
        source.open()
        return VoltageStream(self, self._outputs, source, values)


def main(args: list[str] | None = None) -> None:
    """The process psd_node."""
    sys.exit(run_node(PsdNode, args))


if __name__ == '__main__':
    main()
