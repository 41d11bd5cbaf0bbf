# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""
Write requirements.txt, the pinned list, from requirements.in for every Python that the project supports.

Usage: python3 environment/lock.py python3.10 python3.11 python3.12 python3.13

Each interpreter's pip resolves the list on its own; a package whose version differs between them gets one line with an
environment marker for each version. Nothing is installed. All four interpreters have to be given.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent
HEADER = '# Made by lock.py from requirements.in: edit that one. Pinned for CPython 3.10 to 3.13 on Linux x86-64.\n'


def resolve(interpreter):
    """Return (python version such as '3.12', {package name: version}) as the interpreter's own pip resolves the list."""
    with tempfile.TemporaryDirectory() as scratch:
        report = pathlib.Path(scratch, 'report.json')
        subprocess.run([interpreter, '-m', 'venv', scratch + '/venv'], check=True)
        subprocess.run([scratch + '/venv/bin/python', '-m', 'pip', 'install', '--quiet', '--dry-run', '--ignore-installed',
                        '--report', str(report), '--requirement', str(FOLDER / 'requirements.in')], check=True)
        answer = json.loads(report.read_text())
    pins = {item['metadata']['name'].lower().replace('_', '-'): item['metadata']['version'] for item in answer['install']}
    return answer['environment']['python_version'], pins


def merge(resolved):
    """Return the lines of the pinned list from {python version: {package name: version}}."""
    lines = []
    for name in sorted(set().union(*resolved.values())):
        versions = {python: pins.get(name) for python, pins in resolved.items()}
        if len(set(versions.values())) == 1:
            lines.append(f'{name}=={versions[next(iter(versions))]}')
            continue
        for version in sorted(set(versions.values()) - {None}):
            pythons = sorted((python for python, found in versions.items() if found == version), key=lambda text: int(text[2:]))
            marker = ' or '.join(f'python_version == "{python}"' for python in pythons)
            lines.append(f'{name}=={version} ; {marker}')
    return lines


def main():
    """Resolve with every interpreter on the command line and write requirements.txt."""
    resolved = dict(resolve(interpreter) for interpreter in sys.argv[1:])
    if sorted(resolved) != ['3.10', '3.11', '3.12', '3.13']:
        sys.exit(f'lock.py needs Python 3.10, 3.11, 3.12 and 3.13, got {sorted(resolved)}')
    (FOLDER / 'requirements.txt').write_text(HEADER + '\n'.join(merge(resolved)) + '\n')


if __name__ == '__main__':
    main()
