# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A machine in QEMU with this host's kernel and files, which it cannot change, two vivid cameras, and USB adapters with our emulators."""
from __future__ import annotations

import gzip
import json
import os
import shlex
import shutil
import socket
import subprocess
import termios
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from emulated import CountingArray, CountingFinger

from tactile_driver.emulators import CORRUPTIONS

HERE = Path(__file__).resolve().parent
TOP = HERE.parents[1]
#: of the emulated sensors; QEMU sets what the guest's driver asks for on the pseudo-terminal
_SPEED = termios.B921600
_FIRST_MODULES = ('virtio_pci', '9pnet_virtio', '9p', 'overlay')
_VARIABLES = ('PATH', 'PYTHONPATH', 'LD_LIBRARY_PATH', 'AMENT_PREFIX_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE', 'ROS_DISTRO', 'ROS_VERSION',
              'ROS_PYTHON_VERSION', 'VIRTUAL_ENV')
#: from package.tool of Debian or Ubuntu: name of a program -> package that has it
_PROGRAMS = {'qemu-system-x86_64': 'qemu-system-x86', 'busybox': 'busybox-static', 'cpio': 'cpio', 'modprobe': 'kmod', 'udevadm': 'udev'}

_INIT = """#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
for module in $(cat /modules/order); do insmod /modules/$module; done
mount -t 9p -o trans=virtio,version=9p2000.L,ro,msize=262144,cache=loose host /host
mount -t tmpfs top /top; mkdir /top/upper /top/work
mount -t overlay -o lowerdir=/host,upperdir=/top/upper,workdir=/top/work root /root
for folder in tmp run; do mount -t tmpfs $folder /root/$folder; done
mount -t proc proc /root/proc; mount -t sysfs sys /root/sys; mount -t devtmpfs dev /root/dev
mkdir -p /root/dev/pts /root/dev/shm; mount -t devpts pts /root/dev/pts; mount -t tmpfs shm /root/dev/shm
ip link set lo up
chroot /root /bin/sh -c '/usr/lib/systemd/systemd-udevd --daemon
modprobe vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0,0; modprobe xhci_pci; modprobe ftdi_sio
udevadm trigger --subsystem-match=usb --subsystem-match=tty --subsystem-match=video4linux --action=add; udevadm settle'
. /environment
chroot /root $PYTHON $PROGRAM
poweroff -f
"""


def kernel() -> tuple[Path, str] | None:
    """(path, release) of the newest kernel of this host that has vivid; None without one."""
    for path in sorted(Path('/boot').glob('vmlinuz-*'), key=lambda p: p.stat().st_mtime, reverse=True):
        release = path.name.removeprefix('vmlinuz-')
        if any(Path('/lib/modules', release).rglob('vivid.ko*')):
            return path, release
    return None


def missing() -> str:
    """What has to be installed, as a command; '' if nothing is missing."""
    packages = [package for program, package in _PROGRAMS.items() if shutil.which(program, path='/usr/bin:/usr/sbin:/bin:/sbin') is None]
    packages += [] if kernel() else ['linux-image-amd64']
    return f'apt install --no-install-recommends {" ".join(packages)}' if packages else ''


class Machine:
    """Runs a Python program as the only one of a machine; both speak JSON, a line each. The finger and the array are USB adapters; what
    the host does to them, the program asks for by lines with `ask` (finger or array) and `do`, a name of _do."""

    def __init__(self, folder: Path, program: Path, words: Sequence[str] = ()):
        self._folder, self._rng = folder, np.random.default_rng(1)
        self._sensors = {'finger': CountingFinger(folder / 'finger', mark=1), 'array': CountingArray(folder / 'array', mark=2)}
        self._ports = {name: os.open(folder / name, os.O_RDWR | os.O_NOCTTY) for name in self._sensors}
        for name, sensor in self._sensors.items():
            sensor.spoil = self._at_its_speed(name)
        sockets = {name: folder / f'{name}.socket' for name in ('talk', 'qmp')}
        self.console = folder / 'console'
        self._log = (folder / 'qemu').open('wb')
        path, release = kernel()
        words = ['-accel', 'tcg', '-cpu', 'max', '-smp', '1', '-m', '3G', '-nodefaults', '-no-user-config', '-display', 'none',
                 '-no-reboot', '-kernel', str(path), '-initrd', str(self._initrd(release, [str(program), *words])),
                 '-append', 'console=ttyS0 quiet panic=-1', '-serial', f'file:{self.console}',
                 '-chardev', f'socket,id=talk,path={sockets["talk"]},server=on,wait=on', '-serial', 'chardev:talk',
                 '-qmp', f'unix:{sockets["qmp"]},server=on,wait=off', '-device', 'qemu-xhci,id=usb',
                 '-fsdev', 'local,id=host,path=/,security_model=none,readonly=on,multidevs=remap',
                 '-device', 'virtio-9p-pci,fsdev=host,mount_tag=host']
        for name in self._sensors:
            words += ['-chardev', f'serial,id={name},path={folder / name}', '-device', f'usb-serial,{_adapter(name)}']
        self._qemu = subprocess.Popen(['qemu-system-x86_64', *words], stdout=self._log, stderr=self._log)
        self._talk, self._qmp = self._connected(sockets['talk']), None
        self._qmp = self._connected(sockets['qmp'])
        self._command('qmp_capabilities')

    def _connected(self, path: Path):
        line = socket.socket(socket.AF_UNIX)
        end = time.monotonic() + 30
        while True:
            try:
                line.connect(str(path))
                return line.makefile('rw', encoding='utf-8', errors='replace')
            except OSError:
                if self._qemu.poll() is not None or time.monotonic() > end:
                    raise RuntimeError(f'QEMU does not start: {(self._folder / "qemu").read_text()}') from None
                time.sleep(0.1)

    def _initrd(self, release: str, program: list[str]) -> Path:
        """The first root file system: busybox, the modules that mount the host's files, and the script that does it."""
        root = self._folder / 'initrd'
        for name in ('bin', 'modules', 'proc', 'sys', 'dev', 'host', 'top', 'root'):
            (root / name).mkdir(parents=True)
        shutil.copy(shutil.which('busybox'), root / 'bin/busybox')
        listed = subprocess.run(['modprobe', '--set-version', release, '--show-depends', '--all', *_FIRST_MODULES], check=True,
                                capture_output=True, text=True).stdout
        paths = [line.split()[1] for line in listed.splitlines() if line.startswith('insmod')]
        for path in dict.fromkeys(paths):
            shutil.copy(path, root / 'modules')
        (root / 'modules/order').write_text('\n'.join(dict.fromkeys(Path(path).name for path in paths)))
        variables = {**{name: os.environ[name] for name in _VARIABLES if name in os.environ}, 'HOME': '/tmp',
                     'PYTHONDONTWRITEBYTECODE': '1', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'PYTHON': shutil.which('python3'),
                     'PROGRAM': shlex.join(program)}
        (root / 'environment').write_text(''.join(f'export {name}={shlex.quote(value)}\n' for name, value in variables.items()))
        (root / 'init').write_text(_INIT)
        (root / 'init').chmod(0o755)
        names = '\n'.join(str(path.relative_to(root)) for path in sorted(root.rglob('*')))
        packed = subprocess.run(['cpio', '--create', '--format=newc', '--quiet'], cwd=root, input=names.encode(), capture_output=True,
                                check=True).stdout
        made = self._folder / 'initrd.gz'
        made.write_bytes(gzip.compress(packed, 1))
        return made

    def _command(self, name: str, **arguments) -> None:
        """Do a command of QEMU's machine protocol, and skip the events that it sends by itself."""
        self._qmp.write(json.dumps({'execute': name, 'arguments': arguments}) + '\n')
        self._qmp.flush()
        while True:
            answer = json.loads(self._qmp.readline())
            if 'error' in answer:
                raise RuntimeError(f'QEMU refuses {name}: {answer["error"]}')
            if 'return' in answer:
                return

    def _at_its_speed(self, name: str):
        """What arrives of a sensor's bytes: nothing right where the driver has another baud rate than the sensor."""
        def spoil(data: bytes) -> bytes:
            return data if termios.tcgetattr(self._ports[name])[5] == _SPEED else CORRUPTIONS['wrong_baud'](data, self._rng) * 40
        return spoil

    def _do(self, name: str, what: str) -> None:
        sensor, rng = self._sensors[name], self._rng
        if what == 'pull':
            self._command('device_del', id=name)
        elif what == 'plug':
            termios.tcflush(self._ports[name], termios.TCIFLUSH)  # what was sent to nobody
            self._command('device_add', driver='usb-serial', bus='usb.0', **dict(part.split('=') for part in _adapter(name).split(',')))
        else:
            sensor.spoil = {'well': self._at_its_speed(name), 'double': lambda data: data[:10] + data,
                            'drop': lambda data: CORRUPTIONS['drop'](data, rng) if rng.random() < 0.3 else data,
                            'flood': lambda data: rng.bytes(20000) + data}[what]

    def lines(self, seconds: float) -> Iterator[dict]:
        """What the program says, until the machine is off, or for so many s."""
        end = threading.Timer(seconds, self._qemu.kill)
        end.start()
        for line in self._talk:
            try:
                said = json.loads(line)
            except ValueError:  # of the firmware
                continue
            if 'ask' in said:
                self._do(said['ask'], said['do'])
                self._talk.write('done\n')
                self._talk.flush()
            else:
                yield said
        end.cancel()

    def close(self) -> None:
        """Switch it off."""
        self._qemu.kill()
        self._qemu.wait()
        self._log.close()
        for name, sensor in self._sensors.items():
            sensor.pull()
            os.close(self._ports[name])


def _adapter(name: str) -> str:
    return f'id={name},chardev={name},serial={name.upper()}1'
