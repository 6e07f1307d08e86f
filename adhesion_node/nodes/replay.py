# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Replays a recording: to topics with /clock, or with --offline straight through the estimator."""

import argparse
import sys
from collections.abc import Sequence
from functools import partial

from ..bag import BagReader, left_out, select_from
from ..command.checks import at_least, refuse
from ..command.options import (
    DONE,
    FAILED,
    help_texts,
    json_option,
    out_option,
    remap_option,
    report,
    run_tool,
    setting_options,
)
from ..command.signals import stop_on_signals
from ..wire.topics import POSITIONS, TRACTION_FORCE

EXAMPLES = (
    "replay my_run --offline",
    "replay my_run --offline --set confidence=0.99 --json result.json",
    "replay my_run --offline --out results.csv",
    "replay my_run --rate 5",
    "replay their_run --offline --remap /gnss/along_track:=position",
)

ADHESION, CREEP = "adhesion", "creep"
"""The estimators of an offline replay."""


def main(args: Sequence[str] | None = None) -> int:
    """Run `replay BAG`."""
    arguments = list(sys.argv[1:] if args is None else args)
    if "--offline" in arguments:
        return run_tool(_parser(), _offline, arguments)
    with stop_on_signals() as stop:
        from .ros import runtime  # only here: ROS is neither needed nor loaded for --offline
    if stop.requested:
        return DONE
    own, ros = runtime.split_ros_arguments(arguments)
    return run_tool(_parser(), partial(_live, ros=ros), own)


def _live(options: argparse.Namespace, ros: Sequence[str]) -> int:
    from .player import Replay
    from .ros import runtime

    own = "is for --offline: add that, or start the live estimator of your choice with its own parameters"
    refuse(options, ["set", "params", "train", "node", "seed", "estimator", "out"], own)
    at_least(options, wait_for_subscribers=0)
    asked = {"rate": options.rate, "subscribers": options.wait_for_subscribers}
    given = {name: value for name, value in asked.items() if value is not None}
    with BagReader(options.bag) as reader:
        selection = _selection(reader, options)
        nodes: list[Replay] = []

        def make_node() -> Replay:
            nodes.append(Replay(reader, selection, **given))
            return nodes[0]

        code = runtime.run("replay", make_node, ros)
        if code != DONE or not nodes:  # a signal may come before there is one
            return code
        (node,) = nodes
        complete = node.finished and node.failure is None
        if node.failure is not None:
            print(f"replay: {node.failure}", file=sys.stderr)
        result = {"messages": dict(node.published), "complete": complete}
        lines = [f"{count} {name}" for name, count in node.published.items()]
        report(options.json, result, "\n".join(lines))
        return DONE if node.failure is None else FAILED


def _offline(options: argparse.Namespace) -> int:
    from ..run import creep_offline, offline

    refuse(options, ["rate", "wait_for_subscribers"], "is for a replay to topics: leave it out, or --offline")
    with BagReader(options.bag) as reader:
        selection = _selection(reader, options)
        names = set(selection.values())
        has_place = any(topic.name in names for topic in POSITIONS)
        wanted = options.estimator or (ADHESION if has_place or TRACTION_FORCE.name not in names else CREEP)
        run = offline.run if wanted == ADHESION else creep_offline.run
        return run(options, reader, selection)


def _selection(reader: BagReader, options: argparse.Namespace) -> dict[str, str]:
    """Return the topics to replay and say what the recording lacks, or has under other names."""
    for loss in reader.damage:
        print(f"replay: {loss}", file=sys.stderr)
    selection = select_from(reader, options.remap, options.topics, options.namespace)
    for hint in left_out(reader, selection) if options.topics is None else ():
        print(f"replay: {hint}", file=sys.stderr)
    return selection


def _parser() -> argparse.ArgumentParser:
    usage = "%(prog)s BAG [options] [--ros-args ...]"
    parser = argparse.ArgumentParser(
        "replay", parents=[json_option()], usage=usage, allow_abbrev=False, **help_texts(__doc__, *EXAMPLES)
    )
    add = parser.add_argument
    add("bag", metavar="BAG", help="a rosbag2 directory, an .mcap or a .db3 file, finished or not")
    remap_option(add)
    chosen = "replay these (after --remap) instead of the sensors and the truth"
    add("--topics", metavar="TOPIC", nargs="+", help=chosen)
    live = parser.add_argument_group("to topics").add_argument
    live("--rate", type=float, help="speed; 0 = as fast as reliable subscribers take it (default: 1)")
    awaited = "of position, for 10 s at most; 0 = none (default: 1)"
    live("--wait-for-subscribers", metavar="N", type=int, help=awaited)
    straight = parser.add_argument_group("offline").add_argument
    straight("--offline", action="store_true", help="straight through the estimator, without ROS")
    either = "the adhesion under the brake, or the creep curve (default: by whether there is a position or no force)"
    straight("--estimator", choices=(ADHESION, CREEP), help=either)
    out_option(straight)
    setting_options(straight)
    return parser


if __name__ == "__main__":
    sys.exit(main())
