# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The measurement over a network: namespaces that hear each other, and a relay that delays and loses."""
import os
import subprocess
import time

import pytest
from network import DESK, HAND, network, own, within

pytestmark = pytest.mark.skipif(os.geteuid() != 0 or subprocess.run(['unshare', '-n', 'true'], check=False).returncode != 0,
                                reason='network namespaces need root')
ANSWER = '''
import socket
s = socket.socket(type=socket.SOCK_DGRAM)
s.bind(("10.77.0.2", 9))
while True:
    s.sendto(*s.recvfrom(9))
'''
ASK = '''
import socket, time
s = socket.socket(type=socket.SOCK_DGRAM)
s.settimeout(0.5)
late = []
for _ in range(100):
    begin = time.monotonic()
    s.sendto(b"ask", ("10.77.0.2", 9))
    try:
        s.recvfrom(9)
        late.append(time.monotonic() - begin)
    except OSError:
        pass
print(len(late), sorted(late)[len(late) // 2])
'''


@pytest.mark.parametrize('delay_ms, loss, answers, late_s', [(0.0, 0.0, (100, 100), (0.0, 0.02)), (20.0, 0.1, (60, 96), (0.04, 0.08))])
def test_packets_come_late_and_some_are_lost(delay_ms, loss, answers, late_s):
    python = own()[0]
    with network(delay_ms, loss) as start:
        start(DESK, python, '-c', ANSWER)
        time.sleep(2.0)
        said = within(HAND, python, '-c', ASK, stdout=subprocess.PIPE, text=True).communicate(timeout=90)[0].split()
    assert answers[0] <= int(said[0]) <= answers[1] and late_s[0] <= float(said[1]) <= late_s[1]
