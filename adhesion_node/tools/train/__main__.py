# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Looks at the file of a train before anything is computed for it, or proposes one from a recording.

`--check` prints what the full brake gives, the dry stopping distances, and what is unlikely; the exit code is 1 if
anything is. `--estimate` finds resistance and brake from how the recorded train coasts and brakes.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from shlex import join

from ...bag import BagReader, left_out, select_from
from ...command.checks import refuse
from ...command.options import (
    DONE,
    FAILED,
    help_texts,
    json_option,
    progress,
    remap_option,
    report,
    run_tool,
    setting_options,
)
from ...command.written import require_folder, write_text
from ...run import offline
from ...wire.files.train import read_train
from ...wire.settings.given import given
from ...wire.settings.nodes import SETTINGS
from ...wire.settings.setup import setup_of
from . import slowing
from .checked import figures, likely, stopping, told
from .found import file_of

EXAMPLES = (
    "train --check my_train.yaml",
    "train --check metro",
    "train --estimate my_run --train my_train.yaml --output better_train.yaml",
)


def main(args: Sequence[str] | None = None) -> int:
    """Run `train --check FILE` or `train --estimate BAG`."""
    parser = argparse.ArgumentParser("train", parents=[json_option()], **help_texts(__doc__ or "", *EXAMPLES))
    one = parser.add_mutually_exclusive_group(required=True).add_argument
    one("--check", metavar="FILE", help="the train's file (doc/train.md), or high_speed, metro, freight")
    one("--estimate", metavar="BAG", help="a recording with coasting and with brakings on a dry rail")
    add = parser.add_argument
    add("--output", metavar="FILE", help="with --estimate: write the proposed train, a new file")
    remap_option(add)
    setting_options(parser.add_argument_group("what is believed of the recorded train and its track").add_argument)
    return run_tool(parser, _work, args)


def _work(options: argparse.Namespace) -> int:
    if options.check is None:
        return _estimate(options)
    of_estimate = ["output", "remap", "namespace", "seed", "set", "params", "train", "node"]
    refuse(options, of_estimate, "is for --estimate: --check takes the train's file alone, leave this out")
    file = read_train(options.check)
    rows, odd = stopping(file), [one.told for one in likely(file) if not one.low <= one.value <= one.high]
    result = {**figures(file), "stopping": rows, "unlikely": odd}
    report(options.json, result, "\n".join([*told(file, rows), *(f"unlikely: {one}" for one in odd)]))
    return FAILED if odd else DONE


def _estimate(options: argparse.Namespace) -> int:
    refuse(options, ["seed"], "nothing is drawn by chance: leave it out")
    if options.output and Path(options.output).exists():
        raise ValueError(f"output = {options.output}: is there already: name a new file")
    if options.output:
        require_folder(options.output, None)
    setup = setup_of(given(options, "estimator", SETTINGS))
    with BagReader(options.estimate) as reader:
        for loss in reader.damage:
            print(f"train: {loss}", file=sys.stderr)
        selection = select_from(reader, options.remap, namespace=options.namespace)
        for hint in left_out(reader, selection):
            print(f"train: {hint}", file=sys.stderr)
        recorded = progress(offline.messages(reader, selection, setup.line), "messages")
        found = slowing.find(setup.config, slowing.read(recorded, setup.line))
    text = [f"believed: {setup.train}", *found.told()]
    if options.output and found.says_anything:
        write_text(options.output, file_of(found, Path(options.estimate).name))
        command = join(("train", "--check", options.output))
        text.append(f"{options.output} holds the proposal: {command}")
    report(options.json, found.result(), "\n".join(text))
    return DONE if found.says_anything else FAILED


if __name__ == "__main__":
    raise SystemExit(main())
