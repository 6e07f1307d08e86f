# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of the bank: what it believes, its labels, and every constant with the words that stand below it."""

import ast
import importlib
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from interface_tables import table

import adhesion_node.core.bank as package
from adhesion_node.core import Config
from adhesion_node.core.bank import layout
from adhesion_node.core.bank.labels import kinds, noises
from adhesion_node.core.bank.labels.laws import laws_of

COMPONENTS = [
    name for name, value in vars(layout).items() if name.isupper() and isinstance(value, int) and name != "SIZE"
]
"""Names of the components of the state."""

FOLDER = Path(package.__file__).parent
MODULES = [path for path in FOLDER.rglob("[a-z]*.py") if path.parent.name != "kernels"]


def parts() -> dict[str, str]:
    """Return the tables by the name of their part."""
    return {
        "bank kinds": table(("kind", "limits", "drift", "grows", "rough", "swings", "restless", "prior"), _kinds()),
        "bank noises": table(("white σ", "slow σ", "lasts, s", "prior"), _noises()),
        "bank laws": table(("law over speed", "on a slippery rail", "on a wet one"), _laws()),
        "bank constants": table(("module", "constant", "value", "what it is"), _constants()),
    }


def _kinds() -> Iterator[Sequence[str]]:
    for each in kinds.KINDS:
        limits = "adhesion" if each.slides else {"brake": "brake", "other": "another brake"}.get(each.name, "no brake")
        shares = (f"{share:.1%}".replace("%", " %") for share in (each.drift, each.growth, each.roughness))
        swings = "`used_ripple`" if each.swings else "–"
        yield f"`{each.name}`", limits, *shares, swings, f"{each.restlessness_mps:g}", f"{each.prior:g}"


def _noises() -> Iterator[Sequence[str]]:
    for each in noises.NOISES:
        parts = ((each.white, each.least_white_m), (each.slow, each.least_slow_m))
        stds = (_std(*part) for part in parts)
        yield *stds, f"{each.lasts_s:g}" if each.stds_m(1.0)[1] else "–", f"{each.prior:g}"


def _std(of_declared: float, least_m: float) -> str:
    if not of_declared:
        return f"{least_m:g} m" if least_m else "–"
    return f"{of_declared:g} × declared" + (f", at least {least_m:g} m" if least_m else "")


def _laws() -> Iterator[Sequence[str]]:
    config = Config()
    names = (f"`law` = {config.law}", "a third of its dependence on speed", "none: the same at any speed")
    laws = zip(names, laws_of(config), strict=True)
    return ((name, *(f"{prior:.2g}" for prior in priors)) for name, (_, priors) in laws)


def _constants() -> Iterator[Sequence[str]]:
    """Yield every number that has words below it."""
    for path in sorted(MODULES, key=lambda path: path.stem):
        name = path.stem
        module = importlib.import_module(".".join((package.__name__, *path.relative_to(FOLDER).with_suffix("").parts)))
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for one, below in pairwise(body):
            if isinstance(one, ast.Assign) and isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                names = [node.id for node in ast.walk(one.targets[0]) if isinstance(node, ast.Name)]
                values = [_value(each, getattr(module, each)) for each in names]
                if "" not in values:
                    words = " ".join(str(below.value.value).split())
                    yield f"`{name}`", ", ".join(f"`{each}`" for each in names), ", ".join(values), words


def _value(name: str, value: object) -> str:
    """Tell a number, or several, times in s; nothing for what is none."""
    several = np.atleast_1d(np.asarray(value))
    if several.dtype.kind not in "if" or name in COMPONENTS:
        return ""
    shown = " ".join(f"{each:g}" for each in (several * 1e-9 if name.endswith("_NS") else several).flat)
    return f"{shown} s" if name.endswith("_NS") else shown
