# SPDX-License-Identifier: GPL-3.0-or-later
"""What the README says is what the code has."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def test_every_source_file_names_its_licence():
    for folder in ("salcore", "meshlab_filter", "blender_addon", "tests", "benchmarks", "docs"):
        for path in (ROOT / folder).rglob("*.py"):
            first = path.read_text(encoding="utf-8").splitlines()[0]
            assert first == "# SPDX-License-Identifier: GPL-3.0-or-later", path
