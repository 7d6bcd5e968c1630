# SPDX-License-Identifier: GPL-3.0-or-later
"""Filters on a `pymeshlab.MeshSet`, named and called like MeshLab's own.

Every filter works on the current layer. Its parameters are `preset` and those of salcore's table,
in lower case without underscores (`deviationthreshold`); they are keyword arguments of the
functions here and of `apply`. A filter that is refused or cancelled leaves all layers as they were.

A mistake raises `salcore.ParameterError`, a layer that cannot be understood
`salcore.GeometryError`, too little memory `salcore.MemoryLimitError`, and a `progress` that returns
False `salcore.Cancelled`.
"""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np
import pymeshlab

import salcore
from salcore.maps import MAPS_BEGIN
from salcore.progress import Progress

from . import bridge
from .parameters import ROWS, TARGETS, Callback, check_not_empty, make_parameters, meshlab_name
from .registry import apply as apply
from .registry import filter_list as filter_list
from .registry import filter_parameter_values as filter_parameter_values
from .registry import registered

_ANALYSIS = {"preset": "default"} | {name: row.default for name, row in ROWS.items()}
_SIMPLIFICATION = _ANALYSIS | dict.fromkeys(TARGETS) | {"protectselected": False}
_MESH = {"keepseams": True, "keepborder": False, "keeptopology": False, "symmetry": None}
_MEASURE = {"errors": True}


def _analyze(
    mesh_set: Any, progress: Callback | None = None, **parameters: Any
) -> salcore.Analysis:
    """Analyse the current layer."""
    if not mesh_set.mesh_number():
        raise salcore.GeometryError("the MeshSet has no layer: load or add a mesh first")
    points, faces, normals = bridge.read(mesh_set.current_mesh())
    return salcore.analyze(points, faces, normals, make_parameters(**parameters), progress=progress)


def _analyze_maps(
    mesh_set: Any, progress: Callback | None, *, regions: bool = False, **parameters: Any
) -> salcore.Analysis:
    """Analyse the current layer, with its saliency at every scale, and its regions."""
    work = Progress(progress)
    analysis = _analyze(mesh_set, work.portion(0.0, MAPS_BEGIN), **parameters)
    analysis.prepare(regions=regions, progress=work.portion(MAPS_BEGIN, 1.0))
    return analysis


def _split(parameters: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the targets, by their names in salcore, and the other parameters."""
    targets = {
        TARGETS[meshlab_name(name)].name: value
        for name, value in parameters.items()
        if meshlab_name(name) in TARGETS and value is not None
    }
    others = {k: v for k, v in parameters.items() if meshlab_name(k) not in TARGETS}
    return targets, others


@registered(**_ANALYSIS, colorize=False)
def compute_scalar_by_saliency_per_vertex(
    mesh_set: Any, *, colorize: bool = False, progress: Callback | None = None, **parameters: Any
) -> dict[str, Any]:
    """Store the saliency of every vertex, in [0, 1], as the quality of the current layer.

    It also becomes the custom attribute `saliency`. With `colorize` it is shown as the colour of
    the vertices, from blue for low to red for high.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    colorize : bool
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.
    **parameters
        `preset` and parameters of the analysis.

    Returns
    -------
    dict
        `mean_saliency`: GMS of (4.6), and `seconds`.
    """
    analysis = _analyze_maps(mesh_set, progress, **parameters)
    bridge.set_scalar(mesh_set, analysis.saliency, "saliency")
    if colorize:
        # MeshLab's colour map runs from red to blue, so the bounds are swapped.
        mesh_set.compute_color_from_scalar_per_vertex(minval=1.0, maxval=0.0, colormap="RGB")
    return {"mean_saliency": float(analysis.saliency.mean()), "seconds": analysis.seconds}


@registered(**_ANALYSIS, colorize=False)
def compute_scalar_by_saliency_region_per_vertex(
    mesh_set: Any, *, colorize: bool = False, progress: Callback | None = None, **parameters: Any
) -> dict[str, Any]:
    """Store the region of every vertex, as a number, as the quality of the current layer.

    It also becomes the custom attribute `region`. With `colorize` every region gets a colour.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    colorize : bool
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.
    **parameters
        `preset` and parameters of the analysis.

    Returns
    -------
    dict
        `regions`: their number, and `seconds`.
    """
    analysis = _analyze_maps(mesh_set, progress, regions=True, **parameters)
    bridge.set_scalar(mesh_set, analysis.regions, "region")
    if colorize:
        bridge.set_colors(mesh_set, salcore.region_colors(analysis.regions))
    return {"regions": analysis.segmentation.count, "seconds": analysis.seconds}


def _simplify(
    mesh_set: Any,
    progress: Callback | None = None,
    *,
    protectselected: bool = False,
    keepseams: bool = True,
    keepborder: bool = False,
    keeptopology: bool = False,
    symmetry: str | None = None,
    **parameters: Any,
) -> salcore.Simplification:
    """Simplify the current layer to the one target among the parameters.

    As in MeshLab's own filters, the largest error may be a `pymeshlab.PercentageValue`, of the
    bounding box's diagonal, or a `PureValue`, a length.
    """
    targets, others = _split(parameters)
    error = targets.get("max_error")
    if isinstance(error, pymeshlab.PercentageValue):
        targets["max_error"], others["error_unit"] = error.value() / 100.0, "diagonal"
    elif isinstance(error, pymeshlab.PureValue):
        targets["max_error"], others["error_unit"] = error.value(), "length"
    analysis = _analyze(mesh_set, progress, **others)
    mesh = mesh_set.current_mesh()
    protect = mesh.vertex_selection_array() if protectselected else None
    layers = bridge.corner_layers(mesh)
    result = analysis.simplify(
        protect=protect,
        keep_seams=keepseams,
        keep_border=keepborder,
        keep_topology=keeptopology,
        symmetry=symmetry,
        progress=progress,
        **layers,
        **targets,
    )
    check_not_empty(result)
    return result


def _custom_names(mesh_set: Any, names: str | tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of custom scalar attributes, which the current layer must have."""
    names = (names,) if isinstance(names, str) else tuple(names)
    for name in names if mesh_set.mesh_number() else ():
        try:
            mesh_set.current_mesh().vertex_custom_scalar_attribute_array(name)
        except pymeshlab.PyMeshLabException as error:
            raise salcore.ParameterError(
                f"customattributes={name!r}: the layer has no scalar attribute of that name"
            ) from error
    return names


@registered(**_SIMPLIFICATION, **_MESH)
def compute_selection_by_interest_points_per_vertex(
    mesh_set: Any, *, progress: Callback | None = None, **parameters: Any
) -> dict[str, Any]:
    """Select the vertices of the current layer that a simplification would keep.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.
    **parameters
        One target (`ratio`, `count`, `faces`, `maxerror` or `alpha`), `protectselected`,
        `keepseams`, `keepborder`, `keeptopology`, `symmetry`, `preset` and parameters of the
        analysis.

    Returns
    -------
    dict
        `selected`: their number.
    """
    result = _simplify(mesh_set, progress, **parameters)
    selected = np.zeros(mesh_set.current_mesh().vertex_number(), dtype=bool)
    selected[result.indices] = True
    bridge.set_selection(mesh_set, selected, "interest")
    return {"selected": int(selected.sum())}


@registered(**_SIMPLIFICATION, **_MESH, **_MEASURE, customattributes=())
def generate_simplified_point_cloud_by_saliency(
    mesh_set: Any,
    *,
    customattributes: str | tuple[str, ...] = (),
    errors: bool = True,
    progress: Callback | None = None,
    **parameters: Any,
) -> dict[str, Any]:
    """Add a layer with the kept points of the current one, and make it the current layer.

    They are original points with their colours, normals, quality, texture coordinates, selection,
    and the custom scalar attributes that `customattributes` names. The source does not change.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    customattributes : str or tuple of str
    errors : bool
        Whether errors are measured, which takes longest.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.
    **parameters
        One target (`ratio`, `count`, `faces`, `maxerror` or `alpha`), `protectselected`,
        `keepseams`, `keepborder`, `keeptopology`, `symmetry`, `preset` and parameters of the
        analysis.

    Returns
    -------
    dict
        The report: counts, rate, errors, seconds, and notes of what was given up.
    """
    custom = _custom_names(mesh_set, customattributes)
    result = _simplify(mesh_set, progress, **parameters)
    if errors:
        result.measure(progress)
    source = mesh_set.current_mesh()
    name = f"{source.label()} simplified"
    bridge.add_simplified(mesh_set, source, result, name, custom=custom, with_faces=False)
    return result.make_report(errors=errors).as_dict()


@registered(**_SIMPLIFICATION, **_MESH, **_MEASURE, customattributes=())
def meshing_decimation_by_saliency(
    mesh_set: Any,
    *,
    customattributes: str | tuple[str, ...] = (),
    errors: bool = True,
    progress: Callback | None = None,
    **parameters: Any,
) -> dict[str, Any]:
    """Simplify the mesh of the current layer to a mesh, which replaces it.

    Vertices keep their attributes as in `generate_simplified_point_cloud_by_saliency`, faces their
    colours, quality and wedge texture coordinates. Seams, where values of corners differ, are kept
    as lines; with `keepseams` False the error is smaller, but faces reach across them. With
    `keepborder` points on open borders neither move nor go, with `keeptopology` no part, hole or
    handle does; with `symmetry` "x", "y" or "z" a mesh that is the same on both sides of the plane
    where that coordinate is 0 stays so. A mesh with several textures keeps its texture
    coordinates, but not the textures. pymeshlab cannot exchange the mesh of a layer, so the layer
    gets a new number and comes last; its label and matrix are kept.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    customattributes : str or tuple of str
    errors : bool
        Whether errors are measured, which takes longest.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; returning False cancels.
    **parameters
        One target (`ratio`, `count`, `faces`, `maxerror` or `alpha`), `protectselected`,
        `keepseams`, `keepborder`, `keeptopology`, `symmetry`, `preset` and parameters of the
        analysis.

    Returns
    -------
    dict
        The report: counts, rate, errors, seconds, and notes of what was given up.
    """
    if mesh_set.mesh_number() and not mesh_set.current_mesh().face_number():
        raise salcore.GeometryError(
            "the layer has no faces: use generate_simplified_point_cloud_by_saliency"
        )
    if parameters.get("alpha") is not None:
        raise salcore.ParameterError("alpha gives points: give ratio, count, faces or max_error")
    custom = _custom_names(mesh_set, customattributes)
    result = _simplify(mesh_set, progress, **parameters)
    if errors:
        result.measure(progress)
    source = mesh_set.current_mesh()
    number, label = source.id(), source.label()
    bridge.add_simplified(mesh_set, source, result, "simplified", custom=custom)
    light = mesh_set.current_mesh_id()
    mesh_set.set_current_mesh(number)
    mesh_set.delete_current_mesh()
    mesh_set.set_current_mesh(light)
    mesh_set.current_mesh().set_label(label)
    return result.make_report(errors=errors).as_dict()


@registered(originalmesh=0, simplifiedmesh=1)
def get_simplification_error(
    mesh_set: Any, *, originalmesh: int = 0, simplifiedmesh: int = 1
) -> dict[str, Any]:
    """Return the errors between two layers, both ways, point to point and point to surface.

    Parameters
    ----------
    mesh_set : pymeshlab.MeshSet
    originalmesh, simplifiedmesh : int
        Numbers of the layers, whose matrices are applied.

    Returns
    -------
    dict
        `salcore.Errors.as_dict`, in the layers' unit of length.
    """
    surfaces: list[salcore.Surface] = []
    for name, number in (("originalmesh", originalmesh), ("simplifiedmesh", simplifiedmesh)):
        if not isinstance(number, numbers.Integral) or not mesh_set.mesh_id_exists(number):
            raise salcore.ParameterError(f"{name}={number!r}: there is no such layer")
        surfaces.append(bridge.read_surface(mesh_set.mesh(number)))
    return salcore.compare(*surfaces).as_dict()
