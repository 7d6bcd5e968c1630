# SPDX-License-Identifier: GPL-3.0-or-later
"""Every attribute type goes in and comes out equal on what is kept, on every domain."""

import bpy
import numpy as np
import pytest
import scenes

TYPES = [item.identifier for item in bpy.types.Attribute.bl_rna.properties["data_type"].enum_items]
DOMAINS = ("POINT", "EDGE", "FACE", "CORNER")


def values_for(attributes, kind, count):
    rng = np.random.default_rng(3)
    if kind == "STRING":
        return [f"nr {k} ünïcödé".encode() for k in range(count)]
    layout = attributes.LAYOUTS[kind]
    shape = count if layout.width == 1 else (count, layout.width)
    dtype = np.dtype(layout.dtype)
    if kind == "BYTE_COLOR":
        return (rng.integers(0, 256, shape) / 255.0).astype("f4")
    if dtype.kind == "b":
        return rng.random(shape) < 0.5
    if dtype.kind == "i":
        limits = np.iinfo(dtype)
        return rng.integers(limits.min, limits.max, shape, dtype=dtype, endpoint=True)
    values = rng.normal(size=shape).astype("f4")
    if kind == "QUATERNION":
        values /= np.linalg.norm(values, axis=1, keepdims=True)
    return values


def test_the_table_knows_every_type_there_is(module):
    assert set(TYPES) == set(module("geometry.attributes").LAYOUTS) - {"FLOAT4"} | {"STRING"} | (
        {"FLOAT4"} if "FLOAT4" in TYPES else set()
    )


@pytest.mark.parametrize("domain", DOMAINS)
def test_of_a_mesh(module, domain):
    """All types lie on one mesh, as they do on a rich one, and are cut in one go."""
    attributes, read = module("geometry.attributes"), module("geometry.read")
    obj = scenes.torus()
    given = write_all(attributes, obj.data, domain)
    before = scenes.positions(obj)
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.9, output="IN_PLACE"
    )
    mesh = obj.data
    place = {tuple(row): k for k, row in enumerate(before.tolist())}
    origin = [place[tuple(row)] for row in scenes.positions(obj).tolist()]
    rows = list(enumerate(origin))
    if domain != "POINT":
        # Elements of which nothing has changed are found again by their points.
        original = scenes.torus().data
        old = elements(original, domain, range(len(before)))
        new = elements(mesh, domain, origin)
        rows = [(k, old[key]) for key, k in new.items() if key in old]
        assert len(rows) > len(new) / 3
    for kind in TYPES:
        attribute = mesh.attributes[kind]
        assert (attribute.data_type, attribute.domain) == (kind, domain)
        after = attributes.read(attribute)
        assert domain != "POINT" or len(after) == len(rows)
        assert_same([after[k] for k, _ in rows], [given[kind][k] for _, k in rows], kind)
    assert read.is_mesh(mesh)


def write_all(attributes, data, domain):
    """Give data an attribute of each type, named after it; return what each reads as."""
    given = {}
    for kind in TYPES:
        attribute = data.attributes.new(kind, kind, domain)
        attributes.write(attribute, values_for(attributes, kind, len(attribute.data)))
        given[kind] = attributes.read(data.attributes[kind])
    return given


def elements(mesh, domain, name):
    """Return element numbers by the original points that an element has."""
    if domain == "EDGE":
        return {frozenset(name[v] for v in e.vertices): e.index for e in mesh.edges}
    faces = {tuple(sorted(name[v] for v in p.vertices)): p for p in mesh.polygons}
    if domain == "FACE":
        return {key: polygon.index for key, polygon in faces.items()}
    return {
        (key, name[mesh.loops[loop].vertex_index]): loop
        for key, polygon in faces.items()
        for loop in polygon.loop_indices
    }


def assert_same(after, before, kind):
    if isinstance(before[0], bytes):
        assert list(after) == list(before), kind
    else:
        np.testing.assert_array_equal(np.asarray(after), np.asarray(before), err_msg=kind)


@pytest.mark.parametrize("make", [scenes.points_mesh, scenes.cloud])
def test_of_points(module, make):
    attributes = module("geometry.attributes")
    obj = make(scenes.relief())
    given = write_all(attributes, obj.data, "POINT")
    before = scenes.positions(obj).tolist()
    bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", target="COUNT", count=200
    )
    (result,) = (other for other in bpy.data.objects if other is not obj)
    assert result.type == obj.type
    place = {tuple(row): k for k, row in enumerate(before)}
    origin = [place[tuple(row)] for row in scenes.positions(result).tolist()]
    assert len(origin) == 200
    assert origin == sorted(origin)
    for kind in TYPES:
        attribute = result.data.attributes[kind]
        assert (attribute.data_type, attribute.domain) == (kind, "POINT")
        assert_same(attributes.read(attribute), [given[kind][k] for k in origin], kind)
        assert_same(attributes.read(obj.data.attributes[kind]), given[kind], kind)


def test_names_that_other_domains_and_types_use_are_replaced(module):
    attributes = module("geometry.attributes")
    mesh = scenes.torus().data
    mesh.attributes.new("saliency", "INT", "FACE")
    layer = attributes.Layer("saliency", "FLOAT", "POINT", np.ones(800))
    attributes.write_layer(mesh, layer)
    attribute = mesh.attributes["saliency"]
    assert (attribute.data_type, attribute.domain) == ("FLOAT", "POINT")
    assert "saliency.001" not in mesh.attributes
