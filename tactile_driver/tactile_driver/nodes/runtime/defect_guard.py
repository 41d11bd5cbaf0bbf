# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What keeps a node running whatever it is sent: beyond the checks at the border, nothing that a callback raises ends it."""
from __future__ import annotations

import traceback
from collections.abc import Callable

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node


class DefectGuard:
    """Takes what a callback raises and no check foresaw: a defect of this software, that must not end the node. caught: how often."""

    #: Set by tests: what is caught is raised again, so that no defect hides here.
    strict = False

    def __init__(self, node: Node):
        self.caught = 0
        self._logger, self._places = node.get_logger(), set()

    def catch(self, error: Exception, topic: str) -> str:
        """Count an error while a message of topic was worked on, and log it, once for each line of code; what to say of it."""
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
    """Let no request end the node: rclpy raises for a parameter of an unknown type, and for a transition that the state does not allow.

    The caller is answered that it failed. Call it when all services are made.
    """
    for service in node.services:
        service.callback = _answered(node, service.srv_name, service.callback)


def _answered(node: Node, name: str, callback: Callable) -> Callable:
    def called(request, response):
        """As callback, with an answer in any case."""
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
