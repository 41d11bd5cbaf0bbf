# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_array_node: publishes the images of a taxel array from a serial port, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

import sys
from functools import partial

from .driver_node import DriverNode
from ..parameters.taxel import TAXEL_DRIVER_PARAMETERS
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.registry import TAXEL_SOURCES, make_source
from .streams.taxel import TaxelStream, taxel_publishers


class TaxelArrayNode(DriverNode):
    """One taxel array."""

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_array_node', TAXEL_DRIVER_PARAMETERS, 'taxel array', host)
        self._outputs = taxel_publishers(self)

    def open_stream(self, values: dict) -> TaxelStream:
        """See DriverNode."""
        return TaxelStream(self, self._outputs, self.opened(partial(make_source, TAXEL_SOURCES), values), values)


def main(args: list[str] | None = None) -> None:
    """Entry point of taxel_array_node."""
    sys.exit(run_node(TaxelArrayNode, args))


if __name__ == '__main__':
    main()
