# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Our drivers on devices of a real kernel, in a machine of QEMU: what each case of guest.py found."""
import json
import os
from pathlib import Path

import pytest
from guest import CASES
from machine import Machine, missing

pytestmark = [pytest.mark.hardware, pytest.mark.timeout(1800)]
HERE = Path(__file__).resolve().parent
_LONGEST_S = 1500.0  # for all cases; on two idle cores they take a third of it


@pytest.fixture(scope='module')
def reported(tmp_path_factory):
    """case -> its line; all of them are in out/hardware.jsonl."""
    if missing():
        pytest.skip(f'needs: {missing()}')
    machine, found = Machine(tmp_path_factory.mktemp('machine'), HERE / 'guest.py', os.environ.get('CASES', '').split()), {}
    out = HERE.parents[1] / 'out'
    out.mkdir(exist_ok=True)
    try:
        with (out / 'hardware.jsonl').open('w') as log:
            for line in machine.lines(_LONGEST_S):
                log.write(json.dumps(line, ensure_ascii=False) + '\n')
                log.flush()
                found[line['case']] = line
    finally:
        machine.close()
    assert 'boot' in found, f'the machine did not come up: {machine.console.read_text()[-3000:]}'
    return found


@pytest.mark.parametrize('case', CASES)
def test_on_a_real_kernel(reported, case):
    assert case in reported, f'not run; the last case that ended: {list(reported)[-1]}'
    assert not reported[case]['failure'], reported[case]
