# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_array_node: a taxel array on a serial port, a recording or a simulated one on image_raw, as a lifecycle node."""
from __future__ import annotations

import sys

from .driver_node import DriverNode
from ..parameters.taxel import TAXEL_DRIVER_PARAMETERS, check_together
from .runtime.host import Host
from .runtime.run import run_node
from ..sources.taxel.registry import make_taxel_source
from .streams.taxel import TaxelStream, taxel_publishers


class TaxelArrayNode(DriverNode):
    """One array."""

    def __init__(self, host: Host | None = None):
        super().__init__('taxel_array_node', TAXEL_DRIVER_PARAMETERS, frozenset(), self._opened, 'taxel array', host)
        self._outputs = taxel_publishers(self)

    def _opened(self, values: dict) -> TaxelStream:
        check_together(values)
        source = make_taxel_source(values, self.now_ns)
        source.open()
        return TaxelStream(self, self._outputs, source, values)


def main(args: list[str] | None = None) -> None:
    """The process taxel_array_node."""
    sys.exit(run_node(TaxelArrayNode, args))


if __name__ == '__main__':
    main()
