# SPDX-License-Identifier: GPL-3.0-or-later
"""Children that do not start, do not answer, or lose their parent."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from workers import wait_for

ADDRESS_IN_A_FOLDER = sys.platform != "win32"

DEAF = """
import sys, time
from multiprocessing.connection import Listener
key = sys.stdin.buffer.read(32)
with Listener(sys.argv[-1], authkey=key) as listener, listener.accept() as connection:
    time.sleep(60)
"""
ORPHAN = """
import importlib.util, sys, time, types
package = types.ModuleType("addon")
package.__path__ = [sys.argv[1]]
sys.modules["addon"] = package
import importlib
host = importlib.import_module("addon.worker.host").Host(sys.argv[2:])
host.start()
while host.state == "starting" and sys.argv[2] == sys.executable:
    host.poll()
    time.sleep(0.01)
print(host.pid, host.state, flush=True)
time.sleep(60)
"""


@pytest.fixture
def make(module):
    hosts = []

    def of(*command):
        hosts.append(module("worker.host").Host(command))
        return hosts[-1]

    yield of
    for host in hosts:
        host.stop()


def test_no_such_interpreter(make):
    host = make("/no/such/python", "child.py")
    host.start()
    assert host.state == "unavailable"
    assert "/no/such/python" in host.reason
    host.start()
    assert host.state == "unavailable"
    host.stop()
    assert (host.state, host.reason) == ("off", "")


def test_a_child_that_ends_at_once(make):
    host = make(sys.executable, "-c", "import sys; sys.exit(3)")
    host.start()
    wait_for(host, "unavailable")
    assert "status 3" in host.reason


def test_a_child_that_never_listens(make, module, monkeypatch):
    monkeypatch.setattr(module("worker.host"), "START_SECONDS", 0.3)
    host = make(sys.executable, "-c", "import time; time.sleep(60)")
    host.start()
    pid = host.pid
    wait_for(host, "unavailable")
    assert "0.3 s" in host.reason
    assert not alive(pid)


def test_a_child_that_does_not_stop_is_killed_and_another_one_started(make, module, monkeypatch):
    monkeypatch.setattr(module("worker.host"), "STOP_SECONDS", 0.3)
    host = make(sys.executable, "-c", DEAF)
    host.start()
    wait_for(host, "idle")
    first = host.pid
    host.send({"task": "anything"})
    host.cancel()
    assert host.state == "stopping"
    assert 0.2 < wait_for(host, "idle") < 5.0
    assert host.pid != first
    assert not alive(first)


def test_nobody_without_the_key_gets_in(make):
    host = make(sys.executable, "-c", DEAF)
    host.start()
    host._key = b"wrong"
    wait_for(host, "unavailable")
    assert "no connection" in host.reason


def test_the_socket_is_removed(make):
    host = make(sys.executable, "-c", DEAF)
    host.start()
    wait_for(host, "idle")
    folder = Path(host._address).parent
    assert folder.is_dir() == ADDRESS_IN_A_FOLDER
    assert folder.stat().st_mode & 0o077 == 0
    host.stop()
    assert not folder.exists()


@pytest.mark.parametrize("signal", ["KILL", "TERM"])
def test_a_child_ends_with_its_parent(work, signal):
    addon = str(work.ADDON)
    parent = subprocess.Popen(
        [sys.executable, "-c", ORPHAN, addon, *work.host._command],
        stdout=subprocess.PIPE,
        text=True,
    )
    pid, state = parent.stdout.readline().split()
    assert state == "idle"
    assert alive(int(pid))
    if signal == "KILL":
        parent.kill()
    else:
        parent.terminate()
    parent.wait()
    parent.stdout.close()
    end = time.monotonic() + 5.0
    while alive(int(pid)) and time.monotonic() < end:
        time.sleep(0.02)
    assert not alive(int(pid))


def alive(pid):
    """Return whether a process is there and not over."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return bool(state.stdout.strip()) and state.stdout.strip()[0] != "Z"
