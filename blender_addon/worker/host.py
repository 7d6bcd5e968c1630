# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's end of the worker: starts the child, sends it requests and reads its messages.

Nothing here waits for the child's work: `poll` looks whether there is news. A child that does not
start, is killed or does not stop becomes a message, never an exception.
"""

from __future__ import annotations

import atexit
import os
import secrets
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Client
from pathlib import Path
from typing import Any

from . import wire

START_SECONDS = 30.0
"""Time a child has to start: it needs one or two, on a busy machine ten; one that ends is seen."""
STOP_SECONDS = 5.0
"""Time a child has to stop after `cancel`, before it is killed and its analyses are lost."""

# On Windows no console may open, and Blender's window goes first.
_WINDOWS_FLAGS = getattr(subprocess, "CREATE_NO_WINDOW", 0) | getattr(
    subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0
)

OFF, STARTING, IDLE, BUSY, STOPPING, UNAVAILABLE = (
    "off", "starting", "idle", "busy", "stopping", "unavailable",
)  # fmt: skip


class Host:
    """A child process, and what it is doing.

    Parameters
    ----------
    command : sequence of str
        Starts the child; the address that it is to listen at is added. It reads a key for the
        connection from its standard input, and ends when that is closed.

    Attributes
    ----------
    state : str
        OFF: there is no child. STARTING. IDLE: ready for `send`. BUSY: with a request. STOPPING:
        a request was cancelled and the child has not answered yet. UNAVAILABLE: no child could be
        started; only `stop` forgets that.
    reason : str
        Why none could be started.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self.state, self.reason = OFF, ""
        self._command = list(command)
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Any = None
        self._folder = ""
        self._deadline = 0.0

    @property
    def pid(self) -> int | None:
        """Number of the child's process."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start a child, unless there is one or none can be started."""
        if self.state != OFF:
            return
        atexit.register(self.stop)
        self._key = secrets.token_bytes(32)
        self._deadline = time.monotonic() + START_SECONDS
        self.state = STARTING
        try:
            self._folder, self._address = _new_address()
            self._process = subprocess.Popen(
                [*self._command, self._address],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                # A key typed into Blender's console must not end the child.
                start_new_session=os.name == "posix",
                creationflags=_WINDOWS_FLAGS,
            )
            assert self._process.stdin is not None
            self._process.stdin.write(self._key)
            self._process.stdin.flush()
        except OSError as error:
            self._give_up(f"{self._command[0]} could not be started: {error}")

    def send(self, request: dict[str, Any]) -> None:
        """Have an idle child begin a request; `poll` tells how it goes."""
        assert self.state == IDLE
        self.state = BUSY
        with suppress(OSError):  # if it has died, the next `poll` finds out
            wire.send(self._connection, ["run", request])

    def poll(self) -> tuple[Any, ...] | None:
        """Return the next message, or None while there is none.

        Returns
        -------
        ("progress", stage, share), ("done", result), ("failed", type, text), ("cancelled",)
            From the child. After all but the first it is idle again.
        ("died", code)
            The child is gone with this exit status, a signal's number if negative.

        Notes
        -----
        What a child says after `cancel` is not returned. One that is silent for `STOP_SECONDS`
        then is killed, and another one started.
        """
        if self.state == STARTING:
            self._connect()
        if self.state not in (IDLE, BUSY, STOPPING):
            return None
        try:
            while self._connection.poll():
                message = wire.receive(self._connection)
                stopping = self.state == STOPPING
                if message[0] != "progress":
                    self.state = IDLE
                if not stopping:
                    return tuple(message)
        except (EOFError, OSError):
            return self._bury()
        if self.state == STOPPING and time.monotonic() > self._deadline:
            self.stop()
            self.start()
        return None

    def wait(self, seconds: float) -> None:
        """Wait until there may be news, at most for so long."""
        if self._connection is None:
            time.sleep(min(seconds, 0.02))
            return
        with suppress(EOFError, OSError):  # `poll` finds out
            self._connection.poll(seconds)

    def cancel(self) -> None:
        """Tell a busy child to stop; what it still says is not heard."""
        if self.state != BUSY:
            return
        self.state, self._deadline = STOPPING, time.monotonic() + STOP_SECONDS
        with suppress(OSError):  # if it has died, the next `poll` finds out
            wire.send(self._connection, ["cancel"])

    def stop(self) -> None:
        """End the child at once, and forget that none could be started."""
        atexit.unregister(self.stop)
        self._end_process()
        self.state, self.reason = OFF, ""

    def _connect(self) -> None:
        """Connect to a child that listens by now."""
        assert self._process is not None
        code = self._process.poll()
        if code is not None:
            self._give_up(f"{self._command[0]} ended with status {code}")
        elif time.monotonic() > self._deadline:
            self._give_up(f"{self._command[0]} did not answer within {START_SECONDS:g} s")
        else:
            try:
                self._connection = Client(self._address, authkey=self._key)
            except (FileNotFoundError, ConnectionRefusedError):
                return  # it does not listen yet
            except Exception as error:  # whatever the system has against it
                self._give_up(f"no connection to {self._command[0]}: {error}")
                return
            self.state = IDLE

    def _give_up(self, reason: str) -> None:
        self._end_process()
        self.state, self.reason = UNAVAILABLE, reason

    def _bury(self) -> tuple[Any, ...] | None:
        """Return the message of a child that has gone, if anybody waits for it."""
        assert self._process is not None
        busy = self.state == BUSY
        self._process.kill()  # unless it has ended, it has closed the connection for no reason
        code = self._process.wait()
        self._end_process()
        self.state = OFF
        return ("died", code) if busy else None

    def _end_process(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            if self._process.stdin is not None:
                self._process.stdin.close()
            self._process = None
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = ""


def _new_address() -> tuple[str, str]:
    """Return a folder to remove later, if there is one, and an address that nobody listens at."""
    if sys.platform == "win32":
        return "", rf"\\.\pipe\salient-{secrets.token_hex(16)}"
    folder = tempfile.mkdtemp(prefix="salient-")  # only this user may look into it
    return folder, str(Path(folder) / "socket")
