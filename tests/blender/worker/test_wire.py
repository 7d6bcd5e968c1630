# SPDX-License-Identifier: GPL-3.0-or-later
"""What is sent arrives as it was."""

import threading
from multiprocessing.connection import Pipe

import numpy as np
import pytest


def through(wire, message):
    """Send a message through a pipe."""
    here, there = Pipe()
    with here, there:
        sender = threading.Thread(target=wire.send, args=(here, message))
        sender.start()
        result = wire.receive(there)
        sender.join()
        assert not there.poll()
    return result


@pytest.mark.parametrize(
    "array",
    [
        np.arange(300_000.0).reshape(-1, 3),  # several pieces
        np.arange(12, dtype=np.int32)[::2],
        np.array([[True, False], [False, True]]).T,
        np.empty((0, 3), dtype=np.float32),
        np.array(5, dtype=np.int64),
        np.array([np.nan, np.inf, -0.0]),
    ],
)
def test_arrays(module, array):
    (result,) = through(module("worker.wire"), [array])
    assert (result.dtype, result.shape) == (array.dtype, array.shape)
    assert result.tobytes() == array.tobytes()
    assert result.flags.writeable


def test_plain_values_and_nesting(module):
    message = {
        "numbers": [1, -2.5e-300, np.float64(0.1), np.int64(2**40)],
        "words": "Größe α",
        "none": None,
        "yes": np.bool_(True),
        "deeper": [{"a": np.arange(3), "b": []}, {}],
    }
    result = through(module("worker.wire"), message)
    assert result["deeper"][0].pop("a").tolist() == [0, 1, 2]
    del message["deeper"][0]["a"]
    assert result == message


def test_what_cannot_be_sent_is_an_error(module):
    here, there = Pipe()
    with here, there, pytest.raises(TypeError):
        module("worker.wire").send(here, object())
