# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import signal
import subprocess
import sys

import pytest

from tactile_driver.errors import BadArgument, reports_errors


def run_with(error, *more):
    @reports_errors('tool', *more)
    def main(code=3):
        """What it does."""
        if error is not None:
            raise error
        return code
    return main


def test_the_exit_code_is_the_commands_own():
    main = run_with(None)
    assert main() == 3 and main(code=0) == 0 and main.__doc__ == 'What it does.'


@pytest.mark.parametrize('error, more', [(BadArgument('too much'), ()), (OSError('too much'), (OSError,))])
def test_what_is_wrong_is_one_line_and_exit_code_1(error, more, capsys):
    assert run_with(error, *more)() == 1
    reported = capsys.readouterr()
    assert reported.err == 'tool: too much\n' and reported.out == ''


@pytest.mark.parametrize('package', ['tactile_driver', 'tactile_perception', 'tactile_bringup'])
def test_an_interrupt_while_a_command_is_imported_ends_it_without_a_word(package, tmp_path):
    (tmp_path / package).mkdir()
    script = tmp_path / package / 'command'  # as it is installed, in lib/PACKAGE
    script.write_text(f'import {package}, time; print("begun", flush=True); time.sleep(60)')
    process = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == 'begun\n'
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60) == ('', '') and process.returncode == -signal.SIGINT, 'of which a shell makes 130'


def test_other_errors_are_not_hidden():
    with pytest.raises(OSError):
        run_with(OSError('not expected'))()
