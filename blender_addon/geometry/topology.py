# SPDX-License-Identifier: GPL-3.0-or-later
"""Polygons, corners and edges of a simplified mesh, and which of the original each comes from.

Triangles that a simplification leaves become polygons. A quad or n-gon that lost nothing comes
back as it was; loose edges follow their ends. Arrays in, arrays out: the worker's process, which
has no bpy, imports this module.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..salcore import Simplification
from ..salcore.decimation.attribute_transfer import corner_sources

Ints = NDArray[np.int64]
Ints32 = NDArray[np.int32]


class MeshArrays(NamedTuple):
    """What of a mesh of C corners, P polygons and E edges has to be known to simplify it.

    Attributes
    ----------
    first : (P,) int32
        First corner of each polygon.
    vertices : (C,) int32
        Vertex of each corner.
    triangles : (t, 3) int32 or None
        Corners of the triangles; None where all polygons are triangles.
    polygon_of : (t,) int32 or None
        Polygon of each triangle.
    loose_edges : (e, 2) int32
        Edges of no polygon.
    edges : (E, 2) int32 or None
        All edges; None where they carry no attribute.
    corner_values : bool
        Whether corners carry attributes.
    uv_maps : list of (C, 2) float32
    active_uv : int
        Position in `uv_maps` of the one that tells corners of one vertex apart; -1 for none.
    corner_colors : list of (C, 4) float32
    point_colors : list of (N, 4) float32
    custom_normals : (C, 3) float32 or None
        Of the corners, where they are not those that follow from the polygons.
    materials : (P,) int32 or None
    marked_seams, sharp : (s, 2) int32 or None
        Edges marked as seams, and those that are sharp, creased, bevelled or marked for Freestyle.
    """

    first: Ints32
    vertices: Ints32
    triangles: Ints32 | None
    polygon_of: Ints32 | None
    loose_edges: Ints32
    edges: Ints32 | None
    corner_values: bool
    uv_maps: list[NDArray[np.float32]]
    active_uv: int
    corner_colors: list[NDArray[np.float32]]
    point_colors: list[NDArray[np.float32]]
    custom_normals: NDArray[np.float32] | None
    materials: Ints32 | None
    marked_seams: Ints32 | None
    sharp: Ints32 | None

    @property
    def sizes(self) -> Ints:
        """(P,) corners of each polygon."""
        return np.diff(np.append(self.first.astype(np.int64), len(self.vertices)))

    @property
    def corners(self) -> Ints32:
        """(t, 3) corners of the triangles."""
        if self.triangles is not None:
            return self.triangles
        return np.arange(len(self.vertices), dtype=np.int32).reshape(-1, 3)

    @property
    def faces(self) -> Ints32:
        """(t, 3) vertices of the triangles."""
        if self.triangles is not None:
            return self.vertices[self.triangles]
        return self.vertices.reshape(-1, 3)

    @property
    def all_edges(self) -> Ints32:
        """(e, 2) ends of all edges, those between polygons once or more."""
        if self.edges is not None:
            return self.edges
        after = self.vertices[_following(self.first.astype(np.int64), len(self.vertices))]
        return np.concatenate([np.column_stack([self.vertices, after]), self.loose_edges])

    @property
    def polygons(self) -> Ints32:
        """(t,) polygon of each triangle."""
        if self.polygon_of is not None:
            return self.polygon_of
        return np.arange(len(self.vertices) // 3, dtype=np.int32)

    def layers(self, split: bool) -> list[NDArray[Any]]:
        """Return values of the triangles' corners (t, 3, d) that seams are told by.

        Parameters
        ----------
        split : bool
            Whether vertices are split where values differ: their own colours count then, too.
        """
        found: list[NDArray[Any]] = [
            values[self.corners] for values in (*self.uv_maps, *self.corner_colors)
        ]
        if split:
            found += [values[self.faces] for values in self.point_colors]
        if self.materials is not None:
            found.append(np.repeat(self.materials[self.polygons][:, None, None], 3, axis=1))
        return found


class Topology(NamedTuple):
    """A mesh over M kept vertices, and the element of the original that each element comes from.

    Attributes
    ----------
    starts : (P,) int32
        First corner of each polygon.
    polygons : (P,) int32
        Original polygon.
    vertices, corners : (C,) int32
        Vertex of each corner, and its original corner.
    edge_of : (C,) int32 or None
        Edge from each corner to the next. None, as the next two, where edges carry nothing and all
        are sides of polygons: Blender finds those faster.
    edges : (E, 2) int32 or None
        Vertices of the edges.
    edge_source : (E,) int32 or None
        Original edge; -1 where there is none.
    triangle_corners : (C,) int32
        A corner of the simplification's triangles that each corner is: corner c of triangle f is
        ``3 f + c``.
    """

    starts: Ints32
    polygons: Ints32
    vertices: Ints32
    corners: Ints32
    edge_of: Ints32 | None
    edges: Ints32 | None
    edge_source: Ints32 | None
    triangle_corners: Ints32


class Reduced(NamedTuple):
    """What a simplification leaves of a mesh or point cloud.

    Attributes
    ----------
    indices : (M,) int64
        Kept points, ascending.
    positions : (M, 3) float64 or None
        Where they move to; None where they stay.
    topology : Topology or None
        None for a point cloud.
    triangles : int
        Number of triangles left.
    normals : (C, 3) float64 or None
        Of the corners, where they are to be others than the polygons'.
    notes : list of str
        What had to be given up, a sentence each.
    blends : dict of str to ((n, 3) int, (n, 3) float64)
        For the domains "POINT" and "CORNER" of a mesh whose points have moved: the old elements
        that each new one lies between, and their weights.
    """

    indices: Ints
    positions: NDArray[np.float64] | None
    topology: Topology | None
    triangles: int
    normals: NDArray[np.float64] | None
    notes: list[str]
    blends: dict[str, tuple[Ints, NDArray[np.float64]]]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values and arrays."""
        shape = self.topology
        return self._asdict() | {"topology": None if shape is None else shape._asdict()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Reduced:
        """Return what `as_dict` was made from."""
        shape = values["topology"]
        return cls(**values | {"topology": None if shape is None else Topology(**shape)})


def simplified(mesh: MeshArrays, result: Simplification) -> Topology:
    """Return the topology that `result` leaves of a mesh."""
    starts, polygons, vertices, corners, of_triangles = (
        values.astype(np.int32) for values in _polygons(mesh, result)
    )
    loose = _loose_edges(mesh, result)
    if mesh.edges is None and not len(loose):
        return Topology(starts, polygons, vertices, corners, None, None, None, of_triangles)
    start = np.concatenate([vertices, loose[:, 0]])
    after = _following(starts.astype(np.int64), len(vertices))
    end = np.concatenate([vertices[after], loose[:, 1]])
    count = max(len(result.indices), 1)
    keys, edge_of = np.unique(
        np.minimum(start, end).astype(np.int64) * count + np.maximum(start, end),
        return_inverse=True,
    )
    edges = np.column_stack(np.divmod(keys, count)).astype(np.int32)
    edge_source = np.full(len(edges), -1, dtype=np.int32)
    if mesh.edges is not None:
        edge_source = result.edge_source(mesh.edges, edges).astype(np.int32)
    of_corner = edge_of.ravel()[: len(vertices)].astype(np.int32)
    return Topology(
        starts, polygons, vertices, corners, of_corner, edges, edge_source, of_triangles
    )


def blends(
    mesh: MeshArrays, result: Simplification, shape: Topology | None
) -> dict[str, tuple[Ints, NDArray[np.float64]]]:
    """Return between which old points and corners the new ones lie; nothing where all stay."""
    if shape is None or result.positions is None or result.faces is None or not len(result.faces):
        return {}
    face, weights = result.place_source()
    between = np.where((face >= 0)[:, None], mesh.faces[face], result.indices[:, None])
    of_face, of_corners = (array.reshape(-1, *array.shape[2:]) for array in result.corner_places())
    corner = shape.triangle_corners
    return {
        "POINT": (between, weights),
        "CORNER": (mesh.corners[of_face[corner]], of_corners[corner]),
    }


def kept_lines(mesh: MeshArrays, seams: bool, sharp: bool) -> Ints | None:
    """Return marked edges (s, 2) that stay as lines, or None: seams, sharp ones, or both."""
    marked = [mesh.marked_seams if seams else None, mesh.sharp if sharp else None]
    found = [lines.astype(np.int64) for lines in marked if lines is not None]
    return np.concatenate(found) if found else None


def parent_corners(mesh: MeshArrays, parent: Ints) -> Ints:
    """Return the corner (C,) at each corner's parent vertex, in the same chart.

    Parameters
    ----------
    mesh : MeshArrays
    parent : (N,) int64
        Vertex that each goes into; -1 for none: its corners are their own parents.
    """
    vertices = np.where(parent < 0, np.arange(len(parent)), parent)
    corners, faces = mesh.corners, mesh.faces
    charts = None
    if mesh.active_uv >= 0:
        charts = mesh.uv_maps[mesh.active_uv].astype(np.float64)[corners]
    found = corner_sources(faces, vertices[faces], np.arange(faces.size).reshape(-1, 3), charts)
    result = np.arange(len(mesh.vertices), dtype=np.int64)
    result[corners.ravel()] = corners.ravel()[found.ravel()]
    return result


def apart(edges: Ints32, rank: Ints, parent: Ints) -> NDArray[np.bool_]:
    """Return which vertices (N,) may be in one cluster with others that no edges join to them.

    Parameters
    ----------
    edges : (E, 2) int32
    rank, parent : (N,) int64
        The order of removal; parents have lower ranks, and rank 0 has none.

    Notes
    -----
    Ends of an edge climb to the first ancestor that they share. The last step of the climb is the
    removal by which the edge comes to lie inside a cluster, and joins it. Other steps, and that
    one, are removals of vertices from whose clusters the edge leads away: where none does, the
    cluster is a part of its own. O(E) steps, times the generations.
    """
    joined, leaves = np.zeros((2, len(rank)), dtype=bool)
    low, high = edges[rank[edges[:, 0]] != rank[edges[:, 1]]].T.astype(np.int64)
    while len(low):
        swap = rank[low] > rank[high]
        low, high = np.where(swap, high, low), np.where(swap, low, high)
        leaves[high] = True
        above = parent[high]
        met = above == low
        joined[high[met]] = True
        low, high = low[~met], above[~met]
    result: NDArray[np.bool_] = leaves & ~joined
    ancestors = np.flatnonzero(result)
    while len(ancestors):
        ancestors = np.unique(parent[ancestors])
        ancestors = ancestors[(ancestors >= 0) & ~result[ancestors]]
        result[ancestors] = True
    return result


def _polygons(mesh: MeshArrays, result: Simplification) -> tuple[Ints, Ints, Ints, Ints, Ints]:
    """Return first corners and original polygons, and three numbers of each corner.

    They are its vertex, its original corner, and its corner among those of the triangles.
    """
    if result.faces is None or result.face_source is None or not len(result.faces):
        return (np.empty(0, dtype=np.int64),) * 5
    if mesh.triangles is None:
        return _triangles(mesh, result)
    polygon_of, origin = mesh.polygons, result.face_source
    first, size = mesh.first.astype(np.int64), mesh.sizes
    # A triangle lies in a polygon, divided as it was or otherwise, whose corners it has.
    assert result.corner_origin is not None
    here = mesh.corners.ravel()[result.corner_origin]
    of_corners = polygon_of[result.corner_origin // 3]
    unchanged = (result.indices[result.faces] == mesh.vertices[here]).all(axis=1)
    unchanged &= (of_corners == of_corners[:, :1]).all(axis=1)
    polygon = np.where(unchanged, of_corners[:, 0], polygon_of[origin])
    left = np.bincount(polygon[unchanged], minlength=len(size))
    whole = left == size - 2
    rest = np.flatnonzero(~(unchanged & whole[polygon]))
    source = _corner_source(mesh, result)[rest]
    place = np.full(len(result.source), -1, dtype=np.int64)
    place[result.indices] = np.arange(len(result.indices))
    intact = np.flatnonzero(whole)
    whole_corners = _ranges(first[intact], size[intact])
    polygons = np.concatenate([intact, polygon[rest]])
    sizes = np.concatenate([size[intact], np.full(len(rest), 3)])
    vertices = np.concatenate([place[mesh.vertices[whole_corners]], result.faces[rest].ravel()])
    corners = np.concatenate([whole_corners, mesh.corners.ravel()[source.ravel()]])
    of_triangle = np.arange(result.faces.size).reshape(-1, 3)
    there = np.zeros(len(mesh.vertices), dtype=np.int64)
    there[here[unchanged]] = of_triangle[unchanged]
    of_triangles = np.concatenate([there[whole_corners], of_triangle[rest].ravel()])
    # Polygons keep the order of the original.
    order = np.argsort(polygons, kind="stable")
    moved = _ranges((np.cumsum(sizes) - sizes)[order], sizes[order])
    starts = np.cumsum(sizes[order]) - sizes[order]
    return starts, polygons[order], vertices[moved], corners[moved], of_triangles[moved]


def _triangles(mesh: MeshArrays, result: Simplification) -> tuple[Ints, Ints, Ints, Ints, Ints]:
    """Return what `_polygons` does, of a mesh of triangles."""
    assert result.faces is not None
    assert result.face_source is not None
    starts, of_triangle = np.arange(0, result.faces.size, 3), np.arange(result.faces.size)
    polygons, vertices = result.face_source, result.faces
    corners = _corner_source(mesh, result)
    if (polygons[1:] < polygons[:-1]).any():
        order = np.argsort(polygons, kind="stable")
        polygons, vertices, corners = polygons[order], vertices[order], corners[order]
        of_triangle = of_triangle.reshape(-1, 3)[order].ravel()
    return starts, polygons, vertices.ravel(), corners.ravel(), of_triangle


def _corner_source(mesh: MeshArrays, result: Simplification) -> Ints:
    """Return the old corner (k, 3), among those of the triangles, for each new one."""
    if mesh.corner_values and result.face_corners is not None:
        return result.face_corners
    assert result.corner_origin is not None
    return result.corner_origin


def _ranges(starts: Ints, sizes: Ints) -> Ints:
    """Return the concatenated ranges ``start, start + 1, ...`` of these sizes."""
    offset = starts - (np.cumsum(sizes) - sizes)
    return np.repeat(offset, sizes) + np.arange(int(sizes.sum()))


def _following(starts: Ints, count: int) -> Ints:
    """Return the next corner of the same polygon, for `count` corners."""
    after = np.arange(1, count + 1)
    if len(starts):
        after[np.append(starts[1:], count) - 1] = starts
    return after


def _loose_edges(mesh: MeshArrays, result: Simplification) -> Ints:
    """Return the edges (e, 2) of no polygon, between what stands for their ends."""
    ends = result.source[mesh.loose_edges]
    return ends[(ends[:, 0] != ends[:, 1]) & (ends >= 0).all(axis=1)]
