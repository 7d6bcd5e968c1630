# SPDX-License-Identifier: GPL-3.0-or-later
"""A look at the process table, and at what a worker is doing."""

import os
import subprocess
import time


def children():
    """Return the numbers of the workers that this process has started and that are not over."""
    listed = subprocess.run(
        ["ps", "-wweo", "pid=,ppid=,stat=,args="], capture_output=True, text=True, check=True
    )
    rows = [line.split(None, 3) for line in listed.stdout.splitlines()]
    return [
        int(pid)
        for pid, parent, state, arguments in rows
        if int(parent) == os.getpid() and "child.py" in arguments and state[0] != "Z"
    ]


def wait_for(host, state, seconds=10.0):
    """Poll a host until it is in a state; return how long that took."""
    begun = time.monotonic()
    while host.state != state:
        assert time.monotonic() - begun < seconds, (host.state, host.reason)
        host.poll()
        time.sleep(0.005)
    return time.monotonic() - begun
