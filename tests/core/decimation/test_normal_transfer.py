# SPDX-License-Identifier: GPL-3.0-or-later
"""A light mesh with the normals of its original."""

import numpy as np
import pytest
from shapes import box, bumpy, hull_mesh, sphere_cloud

import salcore


def of_faces(points, faces):
    """Return the unit normals of faces."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1)[:, None]


@pytest.mark.parametrize("placement", ["original", "optimal"])
def test_a_light_sphere_is_shaded_like_a_sphere(placement):
    points, faces = hull_mesh(sphere_cloud(4000))
    parameters = salcore.Parameters(placement=placement)
    result = salcore.simplify(points, faces, parameters=parameters, ratio=0.05)
    normals = result.transfer_normals()
    kept = points[result.indices] if result.positions is None else result.positions
    expected = kept[result.faces] / np.linalg.norm(kept[result.faces], axis=2)[:, :, None]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0)
    angle = np.degrees(np.arccos(np.clip((normals * expected).sum(axis=2), -1, 1)))
    # The light mesh's own vertices are off by several degrees.
    assert angle.max() < 3


def test_the_sides_of_a_crease_keep_their_own():
    points, faces = box(12)
    result = salcore.simplify(points, faces, ratio=0.1)
    own = of_faces(points[result.indices], result.faces)
    np.testing.assert_allclose(result.transfer_normals(), np.repeat(own[:, None], 3, axis=1))


def test_nothing_to_transfer_to():
    with pytest.raises(salcore.GeometryError, match="simplify a mesh by count"):
        salcore.simplify(bumpy(50), ratio=0.5).transfer_normals()
