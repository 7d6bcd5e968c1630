# SPDX-License-Identifier: GPL-3.0-or-later
"""A cloud in tiles is cut as the whole is."""

import numpy as np
import pytest
from models import load_model

import salcore
from salcore.decimation.thresholds import LAST_STEP
from salcore.tiles.merge import count_steps, find_cut, find_step, kept_points, merge_statistics
from salcore.tiles.plan import CELLS, count_cells, halo_width, plan_boxes, within
from salcore.tiles.tile import Tile, analyse_tile, order_tile


def box_of(points):
    """Return the bounding box of the finite points."""
    finite = points[np.isfinite(points).all(axis=1)]
    return finite.min(axis=0), finite.max(axis=0)


def simplify_in_tiles(points, count, most, halo):
    """Return the kept points, by tiles of at most so many points."""
    box = box_of(points)
    parameters = salcore.Parameters()
    boxes = plan_boxes(count_cells(points, *box), *box, most)
    members = [np.flatnonzero(within(points, one, halo)) for one in boxes]
    tiles = [
        analyse_tile(points[ids], within(points[ids], one), box, parameters)
        for one, ids in zip(boxes, members, strict=True)
    ]
    whole = merge_statistics([tile.statistics() for tile in tiles])
    rows = []
    for tile, ids in zip(tiles, members, strict=True):
        order, core = order_tile(tile, whole, parameters), tile.core
        rows.append((order.step[core], order.cost[core], ids[tile.input_of][core]))
    step, keep = find_step(sum(count_steps(row[0]) for row in rows), count)
    costs = [cost[steps == step] for steps, cost, _ in rows]
    cut = find_cut(step, keep, costs, [number[steps == step] for steps, _, number in rows])
    kept = [number[kept_points(cut, steps, cost, number)] for steps, cost, number in rows]
    return np.sort(np.concatenate(kept)), len(tiles)


def overlap(one, other):
    """Return the Jaccard index of two sets."""
    common = len(np.intersect1d(one, other))
    return common / (len(one) + len(other) - common)


def test_four_tiles_keep_what_the_whole_keeps():
    points, _ = load_model("autzen_crop_100k.ply")
    points = points[points[:, 0] < np.quantile(points[:, 0], 0.5)]
    whole = salcore.simplify(points, ratio=0.1).indices
    kept, tiles = simplify_in_tiles(points, len(whole), 13_000, 40.0)
    assert tiles == 4
    assert len(kept) == len(whole)
    assert overlap(kept, whole) > 0.97


def test_boxes_hold_every_point_once_and_no_more_than_asked():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(20_000, 3)) * [10, 3, 0.1] + [1e6, 0, 0]
    points[::1000] = np.nan
    box = box_of(points)
    counts = count_cells(points, *box)
    assert counts.sum() == np.isfinite(points).all(axis=1).sum()
    parts = count_cells(points[:500], *box) + count_cells(points[500:], *box)
    np.testing.assert_array_equal(parts, counts)
    boxes = plan_boxes(counts, *box, 3000)
    inside = np.array([within(points, one) for one in boxes])
    finite = np.isfinite(points).all(axis=1)
    assert (inside.sum(axis=0) == finite).all()
    assert inside.sum(axis=1).max() <= 3000
    assert inside.sum(axis=1).min() > 0


def test_points_in_one_place_make_one_tile():
    points = np.zeros((500, 3))
    box = box_of(points)
    assert len(plan_boxes(count_cells(points, *box), *box, 100)) == 1
    assert count_cells(points, *box).shape == (CELLS,) * 3


def test_halos_grow_with_what_goes():
    assert halo_width(2.0, 1.0) == halo_width(2.0, 0.5)
    assert halo_width(2.0, 0.001) > 3 * halo_width(2.0, 0.1)


def test_every_count_is_met_exactly():
    rng = np.random.default_rng(1)
    rows = []
    for start in (0, 300):
        step = rng.integers(-20, 20, 300).astype(np.int32)
        step[rng.random(300) < 0.1] = LAST_STEP
        rows.append((step, np.round(rng.random(300), 1), np.arange(start, start + 300)))
    counts = sum(count_steps(row[0]) for row in rows)
    before = np.arange(600)
    for count in (600, 599, 301, 100, 7, 1):
        step, keep = find_step(counts, count)
        costs = [cost[steps == step] for steps, cost, _ in rows]
        cut = find_cut(step, keep, costs, [n[steps == step] for steps, _, n in rows])
        kept = np.concatenate([n[kept_points(cut, s, c, n)] for s, c, n in rows])
        assert len(kept) == count
        assert np.isin(kept, before).all()  # levels nest
        before = kept
    with pytest.raises(salcore.ParameterError, match="count=601: there are 600 valid points"):
        find_step(counts, 601)


def test_tiles_become_arrays_and_statistics_do_not_depend_on_their_order():
    points = np.random.default_rng(2).random((900, 3)) * [1, 1, 0.05]
    box = box_of(points)
    parts = [points[:, 0] < 0.5, points[:, 0] >= 0.5]
    tiles = [
        Tile(**analyse_tile(points, part, box, salcore.Parameters()).arrays()) for part in parts
    ]
    statistics = [tile.statistics() for tile in tiles]
    assert sum(one.points for one in statistics) == len(points)
    one, other = merge_statistics(statistics), merge_statistics(statistics[::-1])
    assert one.low == other.low
    assert one.spread == other.spread
    raw = salcore.analyze(points).saliency_map.raw
    low, high = np.quantile(raw, [0.01, 0.99])
    assert abs(one.low - low) < 2e-3
    assert abs(one.spread - (high - low)) < 5e-3
