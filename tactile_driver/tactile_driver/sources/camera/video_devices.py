# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Lists the video devices of Linux and finds one by name."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...errors import DeviceLost


@dataclass(frozen=True)
class VideoDevice:
    """One /dev/videoN. path; name: of the card; serial: USB serial number; by_id: name under /dev/v4l/by-id ('' where unknown); captures:
    whether it provides images."""

    path: str
    name: str
    serial: str
    by_id: str
    captures: bool

    def __str__(self):
        known = ', '.join(x for x in (self.name, f'serial {self.serial}' if self.serial else '', self.by_id) if x)
        return f'{self.path} ({known})' if known else self.path


def _text(path: Path) -> str:
    try:
        return path.read_text(errors='replace').strip()
    except OSError:
        return ''


def _serial(folder: Path) -> str:
    """USB serial number of a video node, from its interface or the next two parents; '' if unknown."""
    place = (folder / 'device').resolve()
    return next((text for text in (_text(p / 'serial') for p in (place, *list(place.parents)[:2])) if text), '')


def list_devices(root: str = '/') -> list[VideoDevice]:
    """All video devices under root/sys/class/video4linux, sorted by number. A node of index 1 or higher provides metadata, no images."""
    base = Path(root)
    links = {link.resolve().name: link.name for link in sorted((base / 'dev/v4l/by-id').glob('*'))}
    folders = sorted((base / 'sys/class/video4linux').glob('video*'), key=lambda p: int(p.name[5:]) if p.name[5:].isdigit() else 0)
    return [VideoDevice(f'/dev/{f.name}', _text(f / 'name'), _serial(f), links.get(f.name, ''), _text(f / 'index') in ('', '0'))
            for f in folders]


def _matches(device: VideoDevice, wanted: str) -> bool:
    return wanted in (device.path, device.path.removeprefix('/dev/video'), device.by_id, '/dev/v4l/by-id/' + device.by_id)


def find_device(wanted: str, root: str = '/') -> VideoDevice:
    """The video device wanted: an index, a /dev path, a name under /dev/v4l/by-id, or part of that name or of the serial number.

    Raises DeviceLost, listing the existing devices, if none or several match.
    """
    devices = list_devices(root)
    real = str(Path(wanted).resolve()) if wanted.startswith('/dev/') else wanted
    found = [d for d in devices if _matches(d, wanted) or _matches(d, real)]
    if not found and not wanted.isdigit() and not wanted.startswith('/dev/') and wanted:
        found = [d for d in devices if d.captures and (wanted in d.by_id or wanted in d.serial)]
    if len(found) == 1:
        return found[0]
    known = '; '.join(map(str, devices)) or 'none at all'
    what = 'fits several video devices' if found else 'is no video device'
    raise DeviceLost(f'device: {wanted!r} {what}; there are: {known}. Name one by index, path or serial number, and check the cable')
