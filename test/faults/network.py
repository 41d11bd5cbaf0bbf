# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Emulated machines on this machine: each has its own network and shared memory, and an Ethernet cable joins two of them."""
from __future__ import annotations

import fcntl
import os
import random
import re
import selectors
import shutil
import struct
import subprocess
import threading
from pathlib import Path

from zygote import Zygote

_TUN = Path('/dev/net/tun')
_TUNSETIFF, _TUNSETCARRIER, _TAP = 0x400454ca, 0x400454e2, 0x1002  # from linux/if_tun.h; _TAP: IFF_TAP | IFF_NO_PI, bare frames
_LARGEST_FRAME = 2048
_ADDRESSES = '10.77.0.1', '10.77.0.2'
_ALONE = ('unshare', '--net', '--mount', 'sh', '-c', 'ip link set lo up && mount -t tmpfs none /dev/shm && exec "$@"', 'alone')


def missing() -> str:
    """Why there can be no such machine here; empty where there can."""
    if os.geteuid() != 0:
        return 'network namespaces need root'
    absent = [tool for tool in ('ip', 'ss', 'unshare', 'nsenter') if not shutil.which(tool)] + [str(_TUN)] * (not _TUN.exists())
    if absent:
        return f'there is no {", ".join(absent)}'
    tried = subprocess.run([*_ALONE, 'true'], capture_output=True, text=True)
    return tried.stderr.strip() and f'namespaces are refused: {tried.stderr.strip()}'


class Machine(Zygote):
    """Starts nodes that are alone with each other until a cable is plugged in; it is gone when they are."""

    def __init__(self, folder: Path, modules: tuple[str, ...]):
        super().__init__(folder, modules, _ALONE, 'SUBNET')
        self.ask(ready=True)  # its network is there

    def run(self, *command: str) -> str:
        """What a command in its network prints."""
        return subprocess.run(['nsenter', '--target', str(self.pid), '--net', *command], check=True, capture_output=True, text=True).stdout

    def room_to_send(self, pid: int) -> list[int]:
        """Bytes that may wait in each socket by which a process sends through the cable."""
        sockets = self.run('ss', '--udp', '--all', '--numeric', '--memory', '--processes', '--oneline', 'src', _ADDRESSES[0]).splitlines()
        return [int(re.search(r',tb(\d+),', line).group(1)) for line in sockets if f'pid={pid},' in line]


class _Plug:
    """An end of a cable: the machine's eth0."""

    def __init__(self, machine: Machine, address: str):
        self.file = os.open(_TUN, os.O_RDWR | os.O_NONBLOCK)
        made = fcntl.ioctl(self.file, _TUNSETIFF, struct.pack('16sH22x', b'cable%d', _TAP))
        name = made[:16].rstrip(b'\0').decode()
        subprocess.run(['ip', 'link', 'set', name, 'netns', str(machine.pid), 'name', 'eth0'], check=True)
        machine.run('ip', 'address', 'add', f'{address}/24', 'dev', 'eth0')
        machine.run('ip', 'link', 'set', 'eth0', 'up')

    def carry(self, whether: bool) -> None:
        """Whether the machine's light of the link is on."""
        fcntl.ioctl(self.file, _TUNSETCARRIER, struct.pack('i', whether))


class Cable:
    """Carries Ethernet frames between two machines in a thread of its own, plugged in at first; loss: the part that it loses."""

    def __init__(self, one: Machine, other: Machine):
        self.loss, self.carried, self._plugged, self._closed, self._random = 0.0, 0, True, False, random.Random(1)
        self._plugs = _Plug(one, _ADDRESSES[0]), _Plug(other, _ADDRESSES[1])
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        one, other = (plug.file for plug in self._plugs)
        with selectors.DefaultSelector() as selector:
            selector.register(one, selectors.EVENT_READ, other)
            selector.register(other, selectors.EVENT_READ, one)
            while not self._closed:
                for key, _ in selector.select(0.05):
                    self._pass_on(key.fd, key.data)

    def _pass_on(self, source: int, target: int) -> None:
        frame = os.read(source, _LARGEST_FRAME)
        if self._plugged and self._random.random() >= self.loss:
            try:
                os.write(target, frame)
                self.carried += 1
            except OSError:
                pass  # the other end is down: frames are lost, as in a cable

    def pull(self) -> None:
        """Both machines lose the link."""
        self._plugged = False
        for plug in self._plugs:
            plug.carry(False)

    def plug(self) -> None:
        """The link is there again."""
        self._plugged = True
        for plug in self._plugs:
            plug.carry(True)

    def close(self) -> None:
        self._closed = True
        self._thread.join(timeout=5)
        for plug in self._plugs:
            os.close(plug.file)
