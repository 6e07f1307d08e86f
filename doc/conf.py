# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Sphinx as rosdoc2 runs it, in a copy of this folder: these pages come first, then the reference of the modules."""

import re
import sys
from pathlib import Path
from typing import Any

sys.path[:0] = [str(folder) for folder in Path.cwd().parents if (folder / "package.xml").is_file()]

project = "adhesion_node"
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["index.rst", "user_docs*", "standard_docs*", "standards.rst", "__readme_include.rst"]
"""What rosdoc2 makes of these pages itself: the same ones again, without links between them."""

myst_heading_anchors = 3
html_theme_options = {"navigation_depth": 2}


def add_contents(app: Any, page: str, source: list[str]) -> None:
    """Make Sphinx's tree of the links in the table of contents."""
    if page == "index":
        pages = re.findall(r"\]\((\w+)\.md\)", source[0])
        source[0] += "\n".join(["\n```{toctree}", ":hidden:", "", *pages, "modules", "```", ""])


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", add_contents)
