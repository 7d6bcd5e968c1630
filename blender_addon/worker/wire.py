# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages between two processes: plain values as JSON, followed by the bytes of the arrays.

Nothing that comes in can run code, and arrays are neither copied nor converted on the way.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

ARRAY = "__array__"
PIECE = 1 << 20
"""Bytes to send or receive at once: `Connection` allocates all it waits for at every read."""


def send(connection: Any, message: Any) -> None:
    """Send a message: lists, dicts with str keys, str, numbers, None, and arrays of numbers."""
    arrays: list[Any] = []
    connection.send_bytes(json.dumps(_describe(message, arrays)).encode())
    for array in arrays:
        if array.size:
            view = memoryview(array).cast("B")
            for start in range(0, len(view), PIECE):
                connection.send_bytes(view[start : start + PIECE])


def receive(connection: Any) -> Any:
    """Wait for a message and return it; tuples arrive as lists, numpy's numbers as Python's.

    Raises
    ------
    EOFError, OSError
        If the other process is gone.
    """
    return _restore(connection, json.loads(connection.recv_bytes()))


def _describe(value: Any, arrays: list[Any]) -> Any:
    """Return a value as JSON can hold it, with each array replaced by its type and shape."""
    if isinstance(value, np.ndarray):
        arrays.append(np.ascontiguousarray(value))
        return {ARRAY: value.dtype.str, "shape": value.shape}
    if isinstance(value, dict):
        return {key: _describe(item, arrays) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_describe(item, arrays) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def _restore(connection: Any, value: Any) -> Any:
    """Return a value with the arrays put back, which follow in the order of their mention."""
    if isinstance(value, list):
        return [_restore(connection, item) for item in value]
    if not isinstance(value, dict):
        return value
    if ARRAY not in value:
        return {key: _restore(connection, item) for key, item in value.items()}
    array: Any = np.empty(value["shape"], dtype=value[ARRAY])
    if array.size:
        view = memoryview(array).cast("B")
        for start in range(0, len(view), PIECE):
            connection.recv_bytes_into(view[start : start + PIECE])
    return array
