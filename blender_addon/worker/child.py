# SPDX-License-Identifier: GPL-3.0-or-later
"""The worker's process: answers one request after another, and knows no Blender.

    python child.py ADDON FOLDERS ADDRESS      with the connection's key on standard input

ADDON is this extension's folder, FOLDERS are where numpy and scipy lie, joined as in PATH.
"""

import os
import sys
import threading
import time
import traceback
import types
from importlib import import_module
from multiprocessing.connection import Listener
from typing import Any

KEY_BYTES = 32
NICENESS = 5
"""Blender's window goes first where there are few processors."""
SECONDS_BETWEEN = 0.05
"""Between two progress messages of one stage."""


def end_with_parent() -> None:
    """Leave as soon as standard input is closed: Blender has ended, however it did."""
    sys.stdin.buffer.read()
    os._exit(0)


def import_addon(folder: str) -> None:
    """Let the modules of the add-on be imported without its ``__init__``, which needs Blender."""
    package = types.ModuleType("addon")
    package.__path__ = [folder]
    sys.modules["addon"] = package


def serve(connection: Any, wire: Any, requests: Any) -> None:
    """Answer requests until the other end closes the connection."""
    while True:
        kind, *arguments = wire.receive(connection)
        if kind == "run":
            wire.send(connection, answer(connection, wire, requests, *arguments))
        # A "cancel" that comes here came too late.


def answer(connection: Any, wire: Any, requests: Any, request: dict[str, Any]) -> list[Any]:
    """Run one request, tell its progress, and return its last message."""
    told, at = "", 0.0

    def progress(stage: str, share: float) -> bool:
        nonlocal told, at
        if connection.poll() and wire.receive(connection)[0] == "cancel":
            return False
        now = time.monotonic()
        if stage != told or now - at >= SECONDS_BETWEEN:
            told, at = stage, now
            wire.send(connection, ["progress", stage, share])
        return True

    try:
        return ["done", requests.run(request, progress)]
    except requests.Cancelled:
        return ["cancelled"]
    except (EOFError, OSError):
        raise  # Blender is gone
    except MemoryError as error:
        return ["failed", "MemoryError", str(error)]
    except requests.SalcoreError as error:
        return ["failed", "SalcoreError", str(error)]
    except Exception as error:
        return ["failed", type(error).__name__, traceback.format_exc()]


def main(addon: str, folders: str, address: str) -> None:
    """Import what takes long, listen, and serve the one who connects."""
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    key = sys.stdin.buffer.read(KEY_BYTES)
    threading.Thread(target=end_with_parent, daemon=True).start()
    sys.path += folders.split(os.pathsep)
    import_addon(addon)
    wire, requests = import_module("addon.worker.wire"), import_module("addon.worker.requests")
    with Listener(address, authkey=key) as listener, listener.accept() as connection:
        try:
            serve(connection, wire, requests)
        except (EOFError, OSError):
            return  # Blender has closed the connection


if __name__ == "__main__":
    main(*sys.argv[1:])
