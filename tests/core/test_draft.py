# SPDX-License-Identifier: GPL-3.0-or-later
"""Drafts are cuts through the same order, without what takes most of a cut's time."""

import dataclasses

import numpy as np
from shapes import bumpy, hull_mesh

import salcore


def test_a_draft_shares_the_order_and_is_not_refined():
    points, faces = hull_mesh(bumpy(800))
    parameters = salcore.Parameters(placement="optimal")
    analysis = salcore.analyze(points, faces, parameters=parameters)
    result = analysis.simplify(ratio=0.2)
    draft = analysis.draft().simplify(ratio=0.2)
    assert analysis.draft()._order is analysis._order
    assert draft.positions is None
    assert result.positions is not None
    np.testing.assert_array_equal(draft.indices, result.indices)
    plain = dataclasses.replace(parameters, refine=False, placement="original")
    expected = salcore.analyze(points, faces, parameters=plain).simplify(ratio=0.2)
    np.testing.assert_array_equal(draft.faces, expected.faces)
    again = analysis.simplify(ratio=0.2)
    np.testing.assert_array_equal(again.positions, result.positions)
