# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh in tiles stays one mesh, as good as the whole."""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapes import grid, torus

import salcore
from salcore.arrays.edges import find_edges
from salcore.input.geometry import clean
from salcore.tiles.merge import count_steps, find_cut, find_step, kept_points, merge_statistics
from salcore.tiles.mesh import (
    analyse_mesh_tile,
    count_for_piece,
    falling_faces,
    order_piece,
    sources_of,
    start_piece,
)
from salcore.tiles.mesh_refine import TileSamples, refine_piece, sample_tile
from salcore.tiles.pieces import (
    Piece,
    cut_piece,
    held_vertices,
    join_parts,
    part_in_box,
    renumbered,
    turned,
)
from salcore.tiles.plan import count_cells, plan_boxes, within

PARAMETERS = salcore.Parameters(workers=1)
SHARES = (2.0, 1.05, 1.0)
EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])


def bumpy_torus(around=100, across=60):
    """Return a closed mesh of uneven detail."""
    points, faces = torus(around, across)
    wave = 1.0 + 0.02 * np.sin(9 * points[:, 0]) * np.cos(11 * points[:, 1])
    noise = np.random.default_rng(3).normal(scale=0.002, size=len(points))
    return points * (wave + noise)[:, None], faces


def hills(rows=70, columns=110):
    """Return an open mesh of uneven detail."""
    points, faces = grid(rows, columns)
    rng = np.random.default_rng(4)
    points[:, 2] = 4 * np.sin(points[:, 0] / 9) * np.cos(points[:, 1] / 7)
    points += rng.uniform(-0.2, 0.2, points.shape)
    return points, faces


def analysed(points, faces, most):
    """Return the tiles of a mesh, of at most so many points."""
    box = points.min(axis=0), points.max(axis=0)
    boxes = plan_boxes(count_cells(points, *box), *box, most)
    halo = 0.1 * np.linalg.norm(box[1] - box[0])
    low, high = points[faces].min(axis=1), points[faces].max(axis=1)
    tiles = []
    for one in boxes:
        near = (high >= one[0] - halo).all(axis=1) & (low < one[1] + halo).all(axis=1)
        number, local = np.unique(faces[near], return_inverse=True)
        here = points[number]
        tiles.append(
            analyse_mesh_tile(
                here,
                local.reshape(-1, 3),
                number,
                np.flatnonzero(near),
                within(here, one),
                box,
                PARAMETERS,
            )
        )
    return tiles


def next_boxes(pieces, turn, most):
    """Return boxes for the next pass."""
    points = np.concatenate([turned(p.points[p.owned], turn) for p in pieces])
    box = points.min(axis=0), points.max(axis=0)
    return plan_boxes(count_cells(points, *box), *box, most)


def joined(pieces, turn, boxes):
    """Return the pieces in these boxes."""
    return [join_parts([part_in_box(p, turn, one) for p in pieces], turn, one) for one in boxes]


def eliminated(pieces, whole, count, keep_border=False):
    """Return what is left of pieces when so many vertices stay, and where the others went."""
    orders = [
        order_piece(p, held_vertices(p, keep_border), PARAMETERS, whole.scale.mean_area)
        for p in pieces
    ]
    pairs = list(zip(pieces, orders, strict=True))
    step, keep = find_step(sum(count_steps(o.step[p.owned]) for p, o in pairs), count)
    at = [p.owned & (o.step == step) for p, o in pairs]
    costs = [o.cost[a] for a, (_, o) in zip(at, pairs, strict=True)]
    numbers = [p.number[a] for a, (p, _) in zip(at, pairs, strict=True)]
    cut = find_cut(step, keep, costs, numbers)
    left, went = [], {}
    for piece, found in pairs:
        kept = kept_points(cut, found.step, found.cost, piece.number)
        source = sources_of(found.parent, kept)
        own = piece.owned
        went |= dict(zip(piece.number[own], piece.number[source[own]], strict=True))
        left.append(cut_piece(piece, source))
    return left, went


def simplify_in_tiles(points, faces, count, most, shares=(2.0, 1.0), refined=False, **options):
    """Return the kept points and the faces over these, as pieces of the last pass."""
    tiles = analysed(points, faces, most)
    assert len(tiles) > 3
    whole = merge_statistics([tile.statistics() for tile in tiles])
    copies = np.concatenate([tile.copies for tile in tiles], axis=1)
    copies = copies[:, np.argsort(copies[0])]
    pieces, went = [start_piece(tile, whole, PARAMETERS) for tile in tiles], []
    passes = len(shares)
    for turn, share in enumerate(shares):
        pieces, sources = eliminated(pieces, whole, int(share * count), **options)
        went.append(sources)
        pieces = [renumbered(p, copies) for p in pieces]
        if turn < passes - 1:
            pieces = joined(pieces, turn + 1, next_boxes(pieces, turn + 1, most // 2))
            assert len(pieces) > 1
    if refined:
        samples = []
        for tile in tiles:
            root = tile.number.copy()
            for sources in went:
                root = np.array([sources.get(n, n) for n in root])
            factor = 1.0 + PARAMETERS.detail * whole.scaled(tile.saliency)
            samples.append(sample_tile(tile, factor, root)[0].arrays())
        every = TileSamples.join(samples)
        pieces = joined(pieces, passes, next_boxes(pieces, passes, most // 4))
        pieces = [refine_piece(p, every, PARAMETERS) for p in pieces]
        pieces = [p.take(np.arange(len(p.number)), p.own_faces()) for p in pieces]
    return pieces


def merged(pieces):
    """Return the numbers of kept points and the faces over the input's numbers."""
    kept = np.sort(np.concatenate([p.number[p.owned] for p in pieces]))
    return kept, np.concatenate([p.number[p.faces] for p in pieces])


def topology(faces):
    """Return Euler's number; edges that are open, crowded, wind amiss; parts."""
    used, local = np.unique(faces, return_inverse=True)
    edges = find_edges(local.reshape(-1, 3), len(used))
    first = np.cumsum(edges.uses) - edges.uses
    forward = np.add.reduceat(edges.forward[edges.sides].astype(int), first)
    links = coo_array((np.ones(len(edges.low)), (edges.low, edges.high)), (len(used),) * 2)
    return (
        len(used) - len(edges.low) + len(faces),
        int((edges.uses == 1).sum()),
        int((edges.uses > 2).sum()),
        int(((edges.uses == 2) & (forward != 1)).sum()),
        connected_components(links, directed=False)[0],
    )


def rms(points, faces, light):
    """Return the root mean square distance from a mesh's points to a light one."""
    used, local = np.unique(light, return_inverse=True)
    original = salcore.make_surface(points, faces)
    simplified = salcore.make_surface(points[used], local.reshape(-1, 3))
    return salcore.compare(original, simplified).surface.rms


@pytest.mark.parametrize("refined", [False, True])
def test_a_closed_mesh_stays_closed_and_is_as_near_as_the_whole(refined):
    points, faces = bumpy_torus()
    pieces = simplify_in_tiles(points, faces, 900, 1600, SHARES, refined=refined)
    kept, light = merged(pieces)
    assert len(kept) == len(np.unique(kept)) == 900
    np.testing.assert_array_equal(np.unique(light), kept)
    assert topology(light) == topology(faces) == (0, 0, 0, 0, 1)
    parameters = salcore.Parameters(refine=refined)
    whole = salcore.simplify(points, faces, parameters=parameters, count=900)
    expected = rms(points, faces, whole.indices[whole.faces])
    assert rms(points, faces, light) < 1.08 * expected


def test_borders_stay_borders_and_tiles_leave_no_marks_in_the_density():
    points, faces = hills()
    kept, light = merged(simplify_in_tiles(points, faces, 1000, 2000, SHARES))
    assert len(kept) == 1000
    chi, single, crowded, amiss, parts = topology(light)
    assert (chi, crowded, amiss, parts) == (1, 0, 0, 1)
    open_edges = find_edges(light, len(points))
    ends = np.concatenate([open_edges.low, open_edges.high])[np.tile(open_edges.uses == 1, 2)]
    row, column = np.divmod(ends, 110)
    assert ((row % 69 == 0) | (column % 109 == 0)).all()
    assert single < 2 * (69 + 109)
    whole = salcore.simplify(points, faces, count=1000).indices
    box = points.min(axis=0), points.max(axis=0)
    boxes = plan_boxes(count_cells(points, *box), *box, 2000)
    inside = np.array([within(points, one, -4.0) for one in boxes]).any(axis=0)
    near = np.count_nonzero(~inside[kept]) / np.count_nonzero(~inside[whole])
    assert 0.9 < near < 1.1  # of 400 points, which have some play


def test_kept_borders_are_kept_whole():
    points, faces = hills(40, 60)
    kept, light = merged(simplify_in_tiles(points, faces, 500, 650, keep_border=True))
    row, column = np.divmod(np.arange(len(points)), 60)
    border = np.flatnonzero((row % 39 == 0) | (column % 59 == 0))
    assert np.isin(border, kept).all()
    assert topology(light)[:2] == (1, len(border))


def test_pieces_that_are_cut_up_and_joined_are_the_same_mesh():
    points, faces = bumpy_torus(60, 30)
    tiles = analysed(points, faces, 500)
    whole = merge_statistics([tile.statistics() for tile in tiles])
    assert whole.scale.mean_area > 0
    pieces = [start_piece(tile, whole, PARAMETERS) for tile in tiles]
    assert sum(p.own_faces().sum() for p in pieces) == len(faces)
    assert sum(p.owned.sum() for p in pieces) == len(points)
    pieces = [cut_piece(p, np.arange(len(p.number))) for p in pieces]
    for turn in (1, 2):
        pieces = joined(pieces, turn, next_boxes(pieces, turn, 700))
        assert sum(p.own_faces().sum() for p in pieces) == len(faces)
        pieces = [Piece.from_arrays(p.arrays()) for p in pieces]
        pieces = [cut_piece(p, np.arange(len(p.number))) for p in pieces]
    (one,) = joined(pieces, 3, EVERYWHERE[None])
    np.testing.assert_array_equal(one.faces, faces)
    np.testing.assert_array_equal(one.number, np.arange(len(points)))
    (alone,) = analysed_alone(points, faces)
    expected = start_piece(alone, whole, PARAMETERS)
    for name in ("points", "quadric", "area", "error"):
        np.testing.assert_allclose(getattr(one, name), getattr(expected, name), rtol=1e-12)
    np.testing.assert_allclose(one.factor, expected.factor, rtol=1e-9)


def analysed_alone(points, faces):
    """Return the one tile of a mesh."""
    box = points.min(axis=0), points.max(axis=0)
    number, order = np.arange(len(points)), np.arange(len(faces))
    core = np.ones(len(points), dtype=bool)
    return [analyse_mesh_tile(points, faces, number, order, core, box, PARAMETERS)]


def test_points_that_are_split_along_a_line_are_one_mesh():
    points, faces = bumpy_torus(60, 40)
    rng = np.random.default_rng(5)
    split = rng.random(faces.shape) < 0.1  # corners with a copy of their own
    again = faces.copy()
    again[split] = len(points) + np.arange(split.sum())
    both = np.concatenate([points, points[faces[split]]])
    pieces = simplify_in_tiles(both, again, 500, 700)
    kept, light = merged(pieces)
    assert len(kept) == 500
    np.testing.assert_array_equal(np.unique(light), kept)
    assert topology(light) == (0, 0, 0, 0, 1)
    assert len(np.unique(both[kept], axis=0)) == 500


def test_faces_that_fall_with_vertices_are_known_before():
    for points, faces in (hills(30, 40), bumpy_torus(30, 20)):
        (tile,) = analysed_alone(points, faces)
        piece = start_piece(tile, merge_statistics([tile.statistics()]), PARAMETERS)
        held = np.zeros(len(points), dtype=bool)
        found = order_piece(piece, held, PARAMETERS, 1e-4)
        for count in (500, 300, 100):
            kept = found.rank < count
            left = cut_piece(piece, sources_of(found.parent, kept))
            assert len(left.faces) == len(faces) - falling_faces(piece)[~kept].sum()
        count = count_for_piece(piece, found, 400)
        left = cut_piece(piece, sources_of(found.parent, found.rank < count))
        assert 399 <= len(left.faces) <= 400


def test_a_piece_that_is_alone_gives_up_parts_and_every_count_is_met():
    points, faces = bumpy_torus(40, 20)
    small = points[:60] * 0.01 + [3, 0, 0]
    near = (faces < 60).all(axis=1)
    both, all_faces = np.concatenate([points, small]), np.concatenate([faces, faces[near] + 800])
    (tile,) = analysed_alone(both, all_faces)
    piece = start_piece(tile, merge_statistics([tile.statistics()]), PARAMETERS)
    held = np.zeros(len(piece.number), dtype=bool)
    found = order_piece(piece, held, PARAMETERS, 1e-4, alone=True)
    assert (np.sort(found.rank)[:4] == np.arange(4)).all()
    kept = found.rank < 100
    left = cut_piece(piece, sources_of(found.parent, kept))
    assert topology(left.faces)[-1] == 1


def test_faces_given_on_both_sides_are_counted_once():
    points, faces = hills(20, 30)
    (tile,) = analysed_alone(points, np.concatenate([faces, faces[:50, ::-1]]))
    assert tile.backs == 50
    assert len(tile.faces) == len(faces)
    assert clean(points, faces).face_count == len(faces)
