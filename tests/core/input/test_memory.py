# SPDX-License-Identifier: GPL-3.0-or-later
"""The estimate of memory, and the refusal of what the machine cannot hold."""

import os

import numpy as np
import pytest
from shapes import bumpy

import salcore
from salcore.input import memory

P = salcore.Parameters


def test_an_input_that_is_too_large_is_refused_with_both_numbers(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 10**9)
    points = np.broadcast_to(np.zeros(3), (2_000_000, 3))
    with pytest.raises(salcore.MemoryLimitError) as caught:
        salcore.analyze(points)
    for part in ("2000000 points", "0 faces", "2.1 GB", "1.0 GB are free", "memory_check=False"):
        assert part in str(caught.value)
    assert isinstance(caught.value, salcore.SalcoreError)


def test_the_check_can_be_turned_off_and_lets_small_inputs_pass(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 1000)
    with pytest.raises(salcore.MemoryLimitError):
        salcore.analyze(bumpy(50))
    salcore.analyze(bumpy(50), parameters=P(memory_check=False))
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    salcore.analyze(bumpy(50))


def test_a_mistake_is_named_before_memory(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 0)
    with pytest.raises(salcore.GeometryError, match="points of type"):
        salcore.analyze(None)


def test_the_estimate_grows_with_all_that_takes_memory():
    count = salcore.estimated_memory
    assert count(0) == 0
    assert count(2000) == 2 * count(1000)
    assert count(1000, 4000) > count(1000, 2000)
    assert count(1000, parameters=P(neighbors=64)) > count(1000)
    assert count(1000, 2000, P(level=4)) > count(1000, 2000, P(level=2)) > count(1000, 2000)
    assert count(1000, parameters=P(graph="delaunay")) > 2 * count(1000)
    assert type(count(np.int64(5))) is int


@pytest.mark.parametrize("bad", [-1, 2.5, "3", None, True, bumpy(3)])
def test_the_estimate_refuses_what_is_no_number(bad):
    with pytest.raises(salcore.ParameterError, match="points="):
        salcore.estimated_memory(bad)
    with pytest.raises(salcore.ParameterError, match="faces="):
        salcore.estimated_memory(3, bad)


def test_what_is_free(monkeypatch, tmp_path):
    free = memory.available_memory()
    assert free is None or free > 10**6
    monkeypatch.setattr(memory, "Path", lambda _: tmp_path / "missing")
    assert memory.available_memory() is None or memory.available_memory() > 10**6
    monkeypatch.delattr(os, "sysconf", raising=False)
    assert memory.available_memory() is None
    (tmp_path / "meminfo").write_text("MemTotal: 9 kB\nMemAvailable:    2 kB\n")
    monkeypatch.setattr(memory, "Path", lambda _: tmp_path / "meminfo")
    assert memory.available_memory() == 2048
