"""Self-contained HTML pages: style, scripts and data stand in the page, nothing is fetched from elsewhere."""

from __future__ import annotations

import json
from importlib.resources import files
from string import Template
from typing import Any


def page(name: str, title: str, data: Any, **parts: str) -> str:
    """Return the page `name`.html with its style, its scripts and `data` inlined.

    `title` and `parts` fill the $placeholders and must be HTML already; the scripts find `data` in the element
    `data`. Raises ValueError for a number that is not finite, which JSON cannot hold.
    """
    scripts = "\n".join(_read(script) for script in ("chart.js", f"{name}.js"))
    return Template(_read(f"{name}.html")).substitute(
        title=title, style=_read("style.css"), script=scripts, data=as_json(data), **parts
    )


def as_json(data: Any) -> str:
    r"""Return compact JSON that may stand inside a script element.

    >>> as_json({"name": "</script>"})
    '{"name":"\\u003c/script>"}'
    """
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _read(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
