# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`python -m adhesion_node.layouts`: the layouts of Foxglove and PlotJuggler, for a namespace."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..command.options import DONE, help_texts, run_tool
from ..command.written import write_text
from . import NAMES, layout

EXAMPLES = ("python -m adhesion_node.layouts --namespace /train1 --output my_layouts",)


def main(args: Sequence[str] | None = None) -> int:
    """Write the layouts into a folder."""
    parser = argparse.ArgumentParser("python -m adhesion_node.layouts", **help_texts(__doc__, *EXAMPLES))
    parser.add_argument("--namespace", default="", metavar="NAME", help="of the nodes, as /train1 (default: none)")
    parser.add_argument("--output", type=Path, default=Path(), metavar="DIR", help="default: the present folder")
    return run_tool(parser, _work, args)


def _work(options: argparse.Namespace) -> int:
    texts = {name: layout(name, options.namespace) for name in NAMES}
    options.output.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        path = options.output / name
        write_text(path, text)
        print(path)
    return DONE


if __name__ == "__main__":
    raise SystemExit(main())
