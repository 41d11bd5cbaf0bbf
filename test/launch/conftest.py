# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Launch files as a user starts them, and a listener, in a ROS domain of their own."""
import itertools
import os
import re
import signal
import subprocess
import time

import pytest
import rclpy
from fault_rig import Runner
from ros_domain import claimed
from waiting import until

_NUMBERS = itertools.count()


@pytest.fixture
def domain(monkeypatch):
    """A ROS domain for one test and the processes that it starts: what another test leaves running is not heard."""
    number, claim = claimed()
    monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
    with claim:
        yield number


class Launched:
    """A process that runs ros2; its output is gathered in `log`."""

    def __init__(self, words, folder):
        self._path = folder / f'log_{next(_NUMBERS)}.txt'
        self._file = open(self._path, 'w')
        self.process = subprocess.Popen(['ros2', *words], stdout=self._file, stderr=subprocess.STDOUT, cwd=folder, start_new_session=True)

    @property
    def log(self):
        return self._path.read_text()

    @property
    def complaints(self):
        """Lines of warnings and errors, and of tracebacks, but for launch's own word of the interrupt."""
        found = [line for line in self.log.splitlines() if re.search(r'WARN|ERROR|FATAL|Traceback', line)]
        return [line for line in found if 'user interrupted' not in line]

    def wait_for_line(self, pattern, seconds):
        """Wait until a line of the log matches."""
        end = time.monotonic() + seconds
        while not re.search(pattern, self.log):
            assert time.monotonic() < end and self.process.poll() is None, self.log
            time.sleep(0.2)

    def wait(self, seconds):
        """The exit code once it has ended by itself."""
        code = self.process.wait(timeout=seconds)
        self._file.close()
        return code

    def interrupt(self):
        """Ctrl-C, as a terminal sends it to all processes; the exit code."""
        os.killpg(self.process.pid, signal.SIGINT)
        return self.wait(90)

    def kill(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.wait(10)


@pytest.fixture
def ros2(tmp_path, domain):
    """Starts ros2 with the words given; what still runs at the end of the test is killed."""
    started = []

    def start(*words):
        started.append(Launched(words, tmp_path))
        return started[-1]

    yield start
    for launched in started:
        launched.kill()


class Listener:
    """Subscribes to topics: topic -> type; `heard` holds their messages, as they come."""

    def __init__(self, topics):
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node('listener', context=self._context)
        self.heard = {topic: [] for topic in topics}
        for topic, kind in topics.items():
            self.node.create_subscription(kind, topic, self.heard[topic].append, 50)
        self._runner = Runner(self.node, self._context)

    def wait_for(self, condition, seconds):
        """Whether condition() came true within so many s."""
        return until(condition, patience_s=seconds)

    def stamps(self, topic):
        """ns of the messages heard on a topic; one of stamp 0, as of a warning among the markers, is left out."""
        return [stamp for stamp in map(stamp_of, list(self.heard[topic])) if stamp]

    def close(self):
        self._runner.end()
        self._context.try_shutdown()


def stamp_of(message):
    header = message.header if hasattr(message, 'header') else message.markers[0].header
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


@pytest.fixture
def listen(domain):
    """Makes a Listener in the test's domain."""
    made = []

    def make(topics):
        made.append(Listener(topics))
        return made[-1]

    yield make
    for listener in made:
        listener.close()
