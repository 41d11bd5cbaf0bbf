# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Keeps a node running whatever it receives: an exception that no input check foresaw is logged and counted, and does not end the node."""
from __future__ import annotations

import traceback
from collections.abc import Callable

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node


class DefectGuard:
    """Catches what a callback raises and no input check foresaw: a defect of this software. caught: number of defects met."""

    #: Set by tests: defects are raised again, so that none stays hidden.
    strict = False

    def __init__(self, node: Node):
        self.caught = 0
        self._logger, self._places = node.get_logger(), set()

    def catch(self, error: Exception, topic: str) -> str:
        """Count an error raised by a message of topic, log it once for each line of code, and return its description."""
        if self.strict:
            raise error
        self.caught += 1
        last = traceback.extract_tb(error.__traceback__)[-1]
        text = f'a message of {topic} met a defect of this software: {error!r} in {last.name}; please report it with the log'
        if (last.filename, last.lineno) not in self._places:
            self._places.add((last.filename, last.lineno))
            self._logger.error(text + '\n' + ''.join(traceback.format_exception(error)))
        return text


def guard_services(node: Node) -> None:
    """Answer requests that fail instead of ending the node: rclpy raises for a parameter of an unknown type and for a transition that the
    state does not allow. Call this once all services exist.
    """
    for service in node.services:
        service.callback = _answered(node, service.srv_name, service.callback)


def _answered(node: Node, name: str, callback: Callable) -> Callable:
    def called(request, response):
        """Call callback; a failure is answered too."""
        try:
            return callback(request, response)
        except Exception as error:
            reason = f'{name}: the request was refused: {error}'
            node.get_logger().warning(reason)
            return _refusal(request, type(response)(), reason)
    return called


def _refusal(request, response, reason: str):
    refused = SetParametersResult(successful=False, reason=reason)
    if isinstance(request, SetParameters.Request):
        response.results = [refused] * len(request.parameters)
    elif isinstance(request, SetParametersAtomically.Request):
        response.result = refused
    return response
