# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of the last result, and how far running work has come.

They are plain Python: whoever writes to a property of Blender's has every region of every window
drawn again, the 3D views too, and an undo may take what it holds.
"""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass
class Figures:
    """What the panel tells; `bpy.context.window_manager.salient_simplify` reads it.

    Attributes
    ----------
    stage : str
        Of the work under way; empty while there is none.
    fraction : float
        Of the work, in whole per cents.
    preview : str
        "shown", "apply" or "discard" while there is a preview; empty otherwise.
    title : str
        What the last result is of; empty before the first one.
    points_before, points_after : int
    faces_before, faces_after : int
        Polygons; 0 for clouds.
    max_error, mean_error : float
        In the scene's unit; only where `measured` says so.
    measured : bool
    seconds : float
        From the call to the result; 0 where nothing was made.
    notes : str
        What the result had to give up, a sentence a line.
    """

    stage: str = ""
    fraction: float = 0.0
    preview: str = ""
    title: str = ""
    points_before: int = 0
    points_after: int = 0
    faces_before: int = 0
    faces_after: int = 0
    max_error: float = 0.0
    mean_error: float = 0.0
    measured: bool = False
    seconds: float = 0.0
    notes: str = ""

    @property
    def busy(self) -> bool:
        """Whether work goes on, or a preview is shown."""
        return bool(self.stage or self.preview)

    def tell(self, stage: str, fraction: float) -> bool:
        """Set stage and fraction; return whether the stage or the whole per cent is another."""
        fraction = int(100.0 * fraction + 1e-9) / 100.0
        if (self.stage, self.fraction) == (stage, fraction):
            return False
        self.stage, self.fraction = stage, fraction
        return True

    def show(self, **values: object) -> None:
        """Show the figures of a new result, and no others."""
        work = {"stage": self.stage, "fraction": self.fraction, "preview": self.preview}
        for field in fields(self):
            setattr(self, field.name, (work | values).get(field.name, field.default))


figures = Figures()
