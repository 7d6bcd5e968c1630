# SPDX-License-Identifier: GPL-3.0-or-later
"""What rows of salcore's table are called here: words that Blender's users know."""

from __future__ import annotations

from ..salcore import Parameter

LABELS = {
    "faces": "Triangles",
    "placement": "Points",
    "regions_of_interest": "Dense Regions",
    "interest_density": "Their Density",
}
"""Names of rows, where they are not the table's, or too long for the sidebar."""
CHOICES = {"pca": "PCA", "optimal": "Moved"}
"""Names of choices, where they are not the table's."""
SENTENCES = {
    "placement": "Kept vertices of a mesh move to where the error is least, or stay original "
    "points; points of clouds always stay.",
    "max_error": "About the fewest points whose surface is nowhere further than this from an "
    "original point, in the scene's unit; more keeps fewer points.",
    "detail": "More keeps more points on features, such as eyes and edges, and fewer on plain "
    "parts; 0 looks at the shape alone.",
    "evenness": "More spreads the points of a cloud evenly, and follows its features less; it "
    "changes nothing on a mesh with faces.",
    "regions_of_interest": "How many regions, the most salient first, keep more points than the "
    "rest; more regions share these points, and 0 treats all alike.",
    "interest_density": "How many times as dense these regions are kept as they would "
    "be else; more takes more points from everywhere else.",
    "level": "More smooths noise and small features away before it is decided what is salient.",
    "refine": "Bring the result nearer to the original: edges are rotated, and moved points "
    "fitted; without, it comes sooner and lies a little farther off.",
}
"""What rows mean in words of this place, where the table's are not those."""


def label(row: Parameter) -> str:
    """Return what a row of the table is called."""
    return LABELS.get(row.name, row.label)


def choice_label(choice: str) -> str:
    """Return what a choice is called."""
    return CHOICES.get(choice, choice.capitalize())


def sentence(row: Parameter) -> str:
    """Return what a row of the table means here."""
    return SENTENCES.get(row.name, row.sentence)
