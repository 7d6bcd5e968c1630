# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a mesh, their borders and handles, and what of them a simplification gives up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..arrays.edges import find_edges
from ..arrays.types import Indices, Integers, Mask


@dataclass(frozen=True, eq=False)
class Topology:
    """Figures of p parts.

    Attributes
    ----------
    faces : (p,) intp
    borders : (p,) intp
        Connected borders: holes, and the outlines of sheets.
    handles : (p,) intp
        Handles of a part of which no edge has more than two faces; else -1.
    """

    faces: Indices
    borders: Indices
    handles: Indices


def label_parts(faces: Integers, count: int) -> Indices:
    """Return the part (n,) of each of `count` vertices, numbered from 0; -1 where no face is.

    A part is a connected component of the faces.
    """
    label = _components(faces[:, [0, 0]].ravel(), faces[:, [1, 2]].ravel(), count)
    used = np.zeros(count, dtype=bool)
    used[faces] = True
    _, number = np.unique(label[used], return_inverse=True)
    part = np.full(count, -1, dtype=np.intp)
    part[used] = number.ravel()
    return part


def count_parts(faces: Integers, count: int) -> int:
    """Return the number of parts of faces over `count` vertices, in O(n + m)."""
    return int(label_parts(faces, count).max(initial=-1)) + 1


def measure_topology(faces: Integers, part: Indices, parts: int) -> Topology:
    """Return the figures of parts that vertices (n,) belong to, in O(m log m)."""
    edges = find_edges(faces, len(part))
    owner = part[edges.low]
    single = edges.uses == 1
    loop = _components(edges.low[single], edges.high[single], len(part))
    ends = np.unique(edges.low[single])
    _, first = np.unique(loop[ends], return_index=True)
    borders = np.bincount(part[ends[first]], minlength=parts)
    used = np.unique(faces)
    face_count = np.bincount(part[faces[:, 0]], minlength=parts)
    euler = np.bincount(part[used], minlength=parts) + face_count
    euler -= np.bincount(owner, minlength=parts)
    handles = (2 - euler - borders) // 2
    handles[owner[edges.uses > 2]] = -1
    return Topology(face_count, borders, np.where(face_count > 0, handles, -1))


def topology_given_up(before: Topology, after: Topology) -> list[str]:
    """Return what parts that are still there have lost, such as "2 handles closed"."""
    there = after.faces > 0
    known = there & (before.handles >= 0) & (after.handles >= 0)
    kept = before.borders[there], after.borders[there]
    losses = [
        (int((before.handles - after.handles)[known].clip(min=0).sum()), "handle", "closed"),
        (int((before.borders - after.borders)[there].clip(min=0).sum()), "hole", "closed"),
        (_number((kept[0] == 0) & (kept[1] > 0)), "closed part", "opened"),
        (_number(there & (before.handles >= 0) & (after.handles < 0)), "part", "no manifold now"),
    ]
    return [f"{number} {noun}{'s'[: number > 1]} {verb}" for number, noun, verb in losses if number]


def _number(chosen: Mask) -> int:
    return int(np.count_nonzero(chosen))


def _components(start: Integers, end: Integers, count: int) -> Indices:
    """Return the component (n,) of each vertex under edges."""
    links = coo_array((np.ones(len(start), dtype=bool), (start, end)), shape=(count, count))
    return connected_components(links, directed=False)[1].astype(np.intp)
