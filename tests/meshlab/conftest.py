# SPDX-License-Identifier: GPL-3.0-or-later
"""What several tests of the command use."""

from pathlib import Path

import pytest

import meshlab_filter
from meshlab_filter.cli.command import main


@pytest.fixture(autouse=True)
def same_code(monkeypatch):
    """Let processes import the code that the tests import, whatever copy is installed."""
    monkeypatch.setenv("PYTHONPATH", str(Path(meshlab_filter.__file__).parents[1]))


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
