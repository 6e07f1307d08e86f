# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rewrites an interrupted or damaged recording as a complete one that every reader opens."""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..bag import BagReader, BagWriter
from ..command.options import DONE, help_texts, json_option, progress, report, run_tool


def main(args: Sequence[str] | None = None) -> int:
    """Run `recover BAG --output DIR`."""
    example = "recover broken_run --output whole_run"
    parser = argparse.ArgumentParser("recover", parents=[json_option()], **help_texts(__doc__, example))
    parser.add_argument("bag", metavar="BAG", help="a rosbag2 directory, an .mcap or a .db3 file")
    text = "leave out messages that do not decode as what they say they are"
    parser.add_argument("--drop-undecodable", action="store_true", help=text)
    parser.add_argument("--output", metavar="DIR", required=True, help="the new recording, a new directory")
    return run_tool(parser, _work, args)


def recover(source: Path, output: Path, drop_undecodable: bool = False) -> dict[str, Any]:
    """Copy every readable message, unchanged and in the order of log time, into a new recording.

    What is not CDR, or of a second type of its topic, is left out: other readers refuse it. With `drop_undecodable` so
    is a message whose bytes do not fit its type; one of a type that is unknown, or defined otherwise, stays.

    Returns the summary: messages by topic, those left out, lost ones as far as the metadata tells, and a sentence for
    each loss.
    Raises ValueError, and leaves nothing behind, when the source is unreadable or the output exists.
    """
    with BagReader(source) as reader:
        writer, dropped = BagWriter(output), Counter[str]()
        try:
            for name, info in reader.infos.items():
                if info.is_cdr:
                    writer.add_topic(name, info.type, offered=info.offered, known_as=info.definition)
            for record in progress(reader.messages(), "messages", sum(reader.counts.values())):
                if drop_undecodable and record.topic not in reader.unread and not record.is_whole:
                    dropped[record.topic] += 1
                else:
                    writer.write(record.topic, record.type, record.cdr, record.log_ns)
            writer.close()
        except BaseException:
            writer.discard()
            raise
        copied = writer.counts
        left = {name: more for name in reader.unread if (more := reader.counts[name] - copied.get(name, 0))}
        damage = [*reader.damage, *(f"{reader.unread[name]}: {left[name]} messages are left out" for name in left)]
        said = {"complete": not damage, "damage": damage, "messages": copied, "undecodable": dict(dropped)}
        return {**said, "left_out": left, "lost": reader.lost}


def _work(options: argparse.Namespace) -> int:
    summary = recover(Path(options.bag), Path(options.output), options.drop_undecodable)
    for loss in summary["damage"]:
        print(f"recover: {loss}", file=sys.stderr)
    lines = [f"{sum(summary['messages'].values())} messages written to {options.output}"]
    lines += [f"{count} {name}" for name, count in summary["messages"].items()]
    lines += [f"{count} {name} left out, they do not decode" for name, count in summary["undecodable"].items()]
    report(options.json, summary, "\n".join(lines))
    return DONE


if __name__ == "__main__":
    sys.exit(main())
