# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of triangles, and rows of corners in order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from salcore.arrays import edges
from salcore.arrays.edges import contains, edge_key, find_edges, sort_rows

ROWS = arrays(np.int32, st.tuples(st.integers(0, 40), st.just(3)), elements=st.integers(0, 4))


@pytest.mark.parametrize("largest", [0, edges.LARGEST_KEY])
@given(rows=ROWS)
def test_sorting_rows(largest, rows):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(edges, "LARGEST_KEY", largest)
        order, equal = sort_rows(rows, 5)
    assert (order == np.lexsort(rows.T[::-1])).all()
    ordered = rows[order]
    assert (equal == (ordered[1:] == ordered[:-1]).all(axis=1)).all()


@given(faces=ROWS)
def test_edges_against_a_list_of_sides(faces):
    found = find_edges(faces, 5)
    start, end = faces.T.ravel(), np.roll(faces.T, -1, axis=0).ravel()
    sides = list(zip(np.minimum(start, end), np.maximum(start, end), strict=True))
    assert list(zip(found.low, found.high, strict=True)) == sorted(set(sides))
    assert found.uses.tolist() == [sides.count(edge) for edge in sorted(set(sides))]
    assert [sides[side] for side in found.sides] == sorted(sides)
    assert (found.forward == (start < end)).all()


def test_edges_among_pairs():
    found = find_edges(np.array([[0, 1, 2], [2, 1, 3]]), 4)
    assert found.among(np.array([[2, 1], [3, 2], [0, 3]]), 4).tolist() == [
        False, False, True, False, True,
    ]  # fmt: skip
    assert not found.among(np.empty((0, 2), dtype=np.int32), 4).any()


def test_keys_of_large_numbers():
    a, b = np.array([0, 2**31 - 2], dtype=np.int32), np.array([2**31 - 1, 1], dtype=np.int32)
    keys = edge_key(a, b, 2**31)
    assert keys.tolist() == [2**31 - 1, 2**31 + 2**31 - 2]
    assert contains(np.sort(keys), keys[::-1].copy()).all()
    assert not contains(np.sort(keys), keys + 1).any()
    assert not contains(np.empty(0, dtype=np.int64), keys).any()
