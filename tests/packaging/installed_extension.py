# SPDX-License-Identifier: GPL-3.0-or-later
"""Install a zip into an empty Blender, simplify with it, and take it off again.

Run by test_extension.py in an environment of its own, with the zip as the only argument and
BLENDER_USER_RESOURCES set to an empty folder.
"""

import importlib
import importlib.util
import os
import sys
from pathlib import Path

BUNDLED = ("scipy", "laspy", "lazrs", "plyfile")
assert not any(map(importlib.util.find_spec, BUNDLED))

import bpy  # noqa: E402

MODULE = "bl_ext.user_default.salient_simplify"
USER = Path(os.environ["BLENDER_USER_RESOURCES"])
INSTALLED = USER / "extensions" / "user_default" / "salient_simplify"


def select_only(item):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    item.hide_set(False)  # a simplified object is hidden
    item.select_set(True)
    bpy.context.view_layer.objects.active = item


def simplified(item):
    """Simplify an object to a quarter; give the new object and the two numbers of points."""
    select_only(item)
    before = set(bpy.data.objects)
    assert bpy.ops.object.salient_simplify(target="RATIO", ratio=0.25) == {"FINISHED"}
    (result,) = set(bpy.data.objects) - before
    return result, *(len(each.data.attributes["position"].data) for each in (item, result))


def check_mesh_and_cloud():
    bpy.ops.mesh.primitive_torus_add(major_segments=40, minor_segments=20)
    torus = bpy.context.active_object
    result, before, after = simplified(torus)
    assert result.type == "MESH"
    assert result.data.polygons
    assert (before, after) == (800, 200)

    points = bpy.data.meshes.new("points")
    points.from_pydata([vertex.co for vertex in torus.data.vertices], [], [])
    cloud = bpy.data.objects.new("points", points)
    bpy.context.collection.objects.link(cloud)
    select_only(cloud)
    bpy.ops.object.convert(target="POINTCLOUD")
    result, before, after = simplified(bpy.context.active_object)
    assert result.type == "POINTCLOUD"
    assert (before, after) == (800, 200)


bpy.ops.preferences.addon_enable(module="bl_pkg")
bpy.ops.extensions.package_install_files(
    filepath=sys.argv[1], repo="user_default", enable_on_install=True, overwrite=True
)
assert MODULE in bpy.context.preferences.addons
assert INSTALLED.is_dir()


def check_files():
    """Import what needs libraries: a scan that laspy packs here by lazrs, and a PLY file."""
    import laspy
    import numpy as np

    points = 6e5 + np.random.default_rng(0).random((300, 3)).cumsum(axis=0)
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.header.scales, las.header.offsets = [0.001] * 3, [6e5] * 3
    las.x, las.y, las.z = points.T
    las.write(str(USER / "scan.laz"))
    rows = "\n".join(" ".join(map(repr, row)) for row in points.tolist())
    head = "ply\nformat ascii 1.0\nelement vertex 300\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    (USER / "scan.ply").write_text(f"{head}end_header\n{rows}\n")
    for name, step in (("scan.laz", 0.0006), ("scan.ply", 1e-4)):
        assert bpy.ops.import_scene.salient_cloud(filepath=str(USER / name)) == {"FINISHED"}
        cloud = bpy.context.active_object
        near = np.empty(900, dtype=np.float32)
        cloud.data.attributes["position"].data.foreach_get("vector", near)
        off = near.reshape(-1, 3) + np.array(cloud["salient_offset"][:]) - points
        assert np.abs(off).max() < step, name


check_mesh_and_cloud()
check_files()


def check_the_worker():
    """Have the child, which knows Blender's own modules alone, find salcore and scipy, too."""
    work = importlib.import_module(MODULE + ".operators.work")
    work.host.start()
    while work.host.state == "starting":
        work.host.poll()
        work.host.wait(0.1)
    assert work.host.state == "idle", work.host.reason
    process, number = work.host._process, work.host.pid
    torus = next(item for item in bpy.data.objects if item.name == "Torus")
    assert simplified(torus)[1:] == (800, 200)
    assert (work.host.state, work.host.pid) == ("idle", number)
    return process


process = check_the_worker()
for library in BUNDLED:
    place = Path(sys.modules[library].__file__).resolve()
    assert place.is_relative_to(USER.resolve()), place

bpy.ops.preferences.addon_disable(module=MODULE)
assert MODULE not in bpy.context.preferences.addons
assert process.poll() is not None, "the worker is still there"
modules = [repository.module for repository in bpy.context.preferences.extensions.repos]
bpy.ops.extensions.package_uninstall(
    repo_index=modules.index("user_default"), pkg_id="salient_simplify"
)
assert not INSTALLED.exists()
for library in BUNDLED:
    left = [path for path in USER.rglob(f"{library}*") if path.parent.name != "__pycache__"]
    assert not left, left  # Blender leaves the compiled copy of a module that is no folder

# bpy's own end now and then waits for ever for one of its threads.
sys.stdout.flush()
os._exit(0)
