# SPDX-License-Identifier: GPL-3.0-or-later
"""What several tests of the command use."""

import pytest

from meshlab_filter.cli.command import main


@pytest.fixture
def run(capsys):
    """Run the command in this process, which saves starting one; return its standard error."""

    def call(*arguments, status=0):
        found = main([str(argument) for argument in arguments])
        said = capsys.readouterr().err
        assert found == status, said
        if status:
            assert len(said.splitlines()) == 1
        return said

    return call
