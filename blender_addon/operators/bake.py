# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the normals of an original into an image for the light mesh that stands for it."""

from __future__ import annotations

from typing import Any

import bpy

from ..geometry import normal_map, sources, unwrap
from ..geometry.bake_child import Task
from ..geometry.baking import Child, Stage, cage_of
from ..geometry.read import HostError
from ..geometry.results import ORIGINAL
from ..geometry.sources import Source
from ..settings import baking
from .base import NAVIGATION, SKIP_SAVE, ModalOperator

STAGE = "Bake"


class OBJECT_OT_salient_bake(ModalOperator, bpy.types.Operator):
    """Bake the normals of the original into a normal map of the active, simplified mesh"""

    bl_idname = "object.salient_bake"
    bl_label = "Salient Bake Normal Map"
    __annotations__ = baking.bake_annotations(SKIP_SAVE)
    _stage: Stage | None = None
    _child: Child | None = None

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Ask for a mesh."""
        if context.active_object is None or context.active_object.type != "MESH":
            cls.poll_message_set("Make the simplified mesh active, and select its original, too")
            return False
        return super().poll(context)

    def find(self, context: Any) -> list[Source]:
        """Return the light mesh and its original, with modifiers applied."""
        self._stage = self._child = None
        self._result = context.active_object
        self._from = find_original(context)
        Source([self._result], self._result.data).require_editable()
        self._stage = Stage(context, self._from, self._result)
        return [
            Source([obj], self._stage.evaluated(copy), fresh=True)
            for obj, copy in (
                (self._result, self._stage.result),
                (self._from, self._stage.original),
            )
        ]

    def check(self, source: Source) -> None:
        """Ask for faces."""
        if not len(source.data.polygons):
            raise HostError(f"{source.object.name}: has no faces; normals come from a mesh")

    def _leave_out(self, problems: dict[int, Any]) -> list[Any]:
        """Do without neither of the two."""
        for error in problems.values():
            if error is not None:
                raise error
        return []

    def requests(self) -> list[Any]:
        """Ask how far the two are apart, unless that is given."""
        self._cage = self.bake_cage
        return [] if self.bake_cage else [self._compare]

    def _compare(self) -> dict[str, Any]:
        result, original = map(sources.geometry, self._sources)
        return {"task": "compare", "original": original, "simplified": result}

    def commit(self, context: Any, answers: list[dict[str, Any]]) -> None:
        """Prepare the bake: the user's objects change only when it has succeeded."""
        assert self._stage is not None
        if answers:
            largest = max(answers[0][way]["max"] for way in ("surface", "surface_back"))
            self._cage = cage_of(largest, sources.geometry(self._sources[0])["points"])
        self.warn(self._sources[0], self._stage.prepare(self.bake_size, self.bake_unwrap))

    def _step(self, context: Any, wait: bool) -> bool:
        """Measure, and bake or have it begun; return whether nothing remains."""
        if not super()._step(context, wait):
            return False
        self._committed = False  # so far nothing would last
        super()._release()  # these meshes have been measured, and hold the materials
        assert self._stage is not None
        task = Task(self.bake_size, self._cage, self._stage.uv_map)
        if not wait:
            try:
                self._child = self._stage.begin(task)
                self._task.stage, self._task.fraction = STAGE, 0.0
                return False
            except OSError as error:
                text = f"Blender waited for the bake, as no other process could be started: {error}"
                self._warnings.append(text)
        self._take(self._stage.bake(task))
        return True

    def modal(self, context: Any, event: Any) -> set[str]:
        """Wait for the measuring, and then for the process that bakes; Esc ends it."""
        if self._child is None:
            return super().modal(context, event)
        if event.type == "ESC" and event.value == "PRESS":
            self._end(context)
            self.report({"INFO"}, "Cancelled: nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"} if event.type in NAVIGATION else {"RUNNING_MODAL"}
        if not self._child.over():
            return {"RUNNING_MODAL"}
        try:
            self._take(self._child.take())
        except HostError as error:
            self._end(context)
            return self._fail(context, error)
        self._end(context)
        self._finish(context)
        return {"FINISHED"}

    def _take(self, image: Any) -> None:
        """Give the light mesh its UV map, and its materials the normal map."""
        stage = self._stage
        assert stage is not None
        image.name = f"{self._result.name} normals"
        if image.packed_file is None:
            image.pack()
        mesh = self._result.data
        if stage.uv_map not in mesh.uv_layers:
            unwrap.add(mesh, stage.uv_map, unwrap.coordinates(stage.result.data, stage.uv_map))
        notes = normal_map.attach(self._result, image, stage.uv_map)
        self._warnings += [f"{self._result.name}: {note}" for note in notes]
        self._message = (
            f"{self._result.name}: normals of {self._from.name} are in the image {image.name!r}, "
            f"{image.size[0]} pixels wide; cage {self._cage:.4g}"
        )

    def conclude(self, context: Any) -> None:
        """Tell where the normals are."""
        self.report({"INFO"}, self._message)

    def _release(self) -> None:
        """End and remove all that was made for the work."""
        super()._release()
        if self._child is not None:
            self._child.close()
        stage, self._stage, self._child = self._stage, None, None
        if stage is not None:
            stage.discard()


def find_original(context: Any) -> Any:
    """Return the mesh that the active object stands for.

    Raises
    ------
    HostError
        If there is none, or it is a cloud.
    """
    active = context.active_object
    others = [obj for obj in sources.eligible(context.selected_objects) if obj != active]
    if len(others) > 1:
        raise HostError(
            f"{active.name}: {len(others)} others are selected; select its original alone beside it"
        )
    name = active.get(ORIGINAL, "")
    found = others[0] if others else context.scene.objects.get(name)
    if found is None or found == active:
        lost = f"its original {name!r} is not in the scene" if name else "has no original known"
        raise HostError(f"{active.name}: {lost}; select it, and last the simplified mesh")
    if found.type != "MESH":
        raise HostError(f"{found.name}: is a cloud and has no surface; bake from a mesh")
    return found


CLASSES: tuple[Any, ...] = (OBJECT_OT_salient_bake,)
