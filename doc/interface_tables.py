# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of what the package declares: parameters by node, topics, a real train's scenarios and sensors, faults."""

import ast
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import adhesion_node
from adhesion_node.core import Outcome
from adhesion_node.core.bank.findings.learnt import KIND, QUANTITIES, SCATTERS, WHEEL
from adhesion_node.core.bank.labels.kinds import KINDS
from adhesion_node.core.readers import READERS
from adhesion_node.core.setting import Setting, bound, by_group
from adhesion_node.tools.defaults import all_settings
from adhesion_node.wire.messages.refused import Reason
from adhesion_node.wire.topic import Quality
from adhesion_node.wire.topics import TOPICS
from sim_node.faults.plan import FAULTS, NONE
from sim_node.real.plant.scenarios import KMH, SCENARIOS
from sim_node.real.plant.way import LEVEL
from sim_node.real.sensors.fitted import FITTED

SOURCES = Path(adhesion_node.__file__).resolve().parent.parent

QUALITIES = {Quality.SENSOR: "sensor", Quality.RESULT: "result", Quality.EXPIRING: "latched"}


def parts() -> dict[str, str]:
    """Return the tables by the name of their part."""
    return {
        **{f"parameters of {node}": "\n\n".join(_groups(specs)) for node, specs in all_settings().items()},
        "topics": table(
            ("topic", "type", "QoS", "meaning"),
            ((f"`{t.name}`", t.type.replace("/msg/", "/"), QUALITIES[t.quality], t.meaning) for t in TOPICS),
        ),
        "refusals": table(("refused message", "what helps"), ((f"`{r.name}`", _cell(r.value)) for r in Reason)),
        "outcomes": table(("sample", "what becomes of it"), ((f"`{o.name}`", _cell(o.value)) for o in Outcome)),
        "learnt": table(("value", "unit", "meaning"), _learnt()),
        "house": table(("folder", "what is in it"), _house()),
        "real trains": table(("scenario", "train", "from, km/h", "differs from what the estimator is told"), _real()),
        "fitted": table(
            ("`sensors`", "the train is fitted with"), ((f"`{name}`", one.description) for name, one in FITTED.items())
        ),
        "faults": table(("`fault`", "what happens", "lasts, s", "share", "size"), _faults()),
    }


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, *rows]
    shown = [f"| {' | '.join(cells)} |" for cells in lines]
    return "\n".join([shown[0], "|" + "---|" * len(head), *shown[1:]])


def _groups(specs: Sequence[Setting]) -> Iterator[str]:
    """Yield a table for each group of settings, in the order of their declaration, under its name."""
    head = ("parameter", "default", "unit", "range", "meaning")
    for group, members in by_group(specs).items():
        if group:
            yield f"### {group[0].upper()}{group[1:]}"
        yield table(head, map(_parameter, members))


def _parameter(spec: Setting) -> tuple[str, ...]:
    default = f"{spec.default:.6g}" if isinstance(spec.default, float) else str(spec.default).lower()
    told = [f"read by {' and '.join(READERS[spec.name])}"] if spec.name in READERS else []
    told += ["may change at run time"] if spec.changes else []
    meaning = f"{spec.description} ({'; '.join(told)})" if told else spec.description
    return f"`{spec.name}`", default, spec.unit, _range(spec), meaning


def _range(spec: Setting) -> str:
    if spec.choices:
        return ", ".join(spec.choices)
    if isinstance(spec.default, bool):
        return "true, false"
    return "text" if isinstance(spec.default, str) else f"{bound(spec.low)} to {bound(spec.high)}"


def _cell(text: str) -> str:
    """Keep Markdown from taking a home folder for a struck-out text, or a bar for the end of a cell."""
    return text.replace("~", "\\~").replace("|", "\\|")


def _learnt() -> Iterator[tuple[str, ...]]:
    """Yield what the bank learns of train and sensors."""
    for quantity in QUANTITIES:
        yield f"`{quantity.name}`, `{quantity.name}_std`", quantity.unit, quantity.meaning
    for name, unit, meaning in SCATTERS:
        yield f"`{name}`", unit, meaning
    kinds = ", ".join(kind.name for kind in KINDS)
    yield f"`{KIND}NAME`", "", f"that this limits the motion: {kinds}"
    yield f"`{WHEEL}AXLE`", "", "true over expected radius of the wheels of an axle"


def _house() -> Iterator[tuple[str, str]]:
    """Yield every package of the sources with its first sentence."""
    for package in ("adhesion_node", "sim_node"):
        for init in sorted((SOURCES / package).rglob("__init__.py")):
            folder = init.parent.relative_to(SOURCES)
            purpose = ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or ""
            yield f"`{folder.as_posix()}`", purpose.partition("\n")[0]


def _real() -> Iterator[tuple[str, ...]]:
    """Yield the scenarios of a real train beyond its usual scatter."""
    for name, scenario in SCENARIOS.items():
        forced = {"mass": scenario.scatter.mass, "pads": scenario.scatter.pads}
        differs = [f"{what} {value:+.0%}" for what, value in forced.items() if value]
        differs += ["rotating mass 8 %"] if scenario.scatter.rotating is not None else []
        differs += ["grade"] if scenario.grade is not LEVEL and not scenario.known_grade else []
        yield f"`{name}`", scenario.nominal.name, f"{scenario.speed_mps / KMH:.0f}", ", ".join(differs)


def _faults() -> Iterator[tuple[str, ...]]:
    for name, fault in FAULTS.items():
        if name != NONE:
            lasts, share, size = fault.dose.duration_s, fault.dose.share, fault.dose.size
            sized = f"{size:g} {fault.size}" if fault.size else ""
            yield (
                f"`{name}`",
                fault.description,
                f"{lasts:g}" if 0.0 < lasts < 1e9 else "",
                f"{100 * share:g} %" if share not in (0.0, 1.0) else "",
                sized,
            )
