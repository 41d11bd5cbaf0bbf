# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_driver.command import tells_errors
from tactile_driver.errors import BadArgument


def run_with(error, *more):
    @tells_errors('tool', *more)
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
    told = capsys.readouterr()
    assert told.err == 'tool: too much\n' and told.out == ''


def test_other_errors_are_not_hidden():
    with pytest.raises(OSError):
        run_with(OSError('not expected'))()
