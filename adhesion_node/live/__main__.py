# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`live`: a page in the browser that shows the run while the nodes run, at 10 Hz."""

import argparse
import sys
from collections.abc import Sequence

from ..command.options import help_texts, run_tool
from ..nodes.ros import runtime
from .node import Live

HOST, PORT = "127.0.0.1", 8080
"""Where the page is served unless another place is named."""

EXAMPLES = ("live", "live --port 9000 --ros-args -r __ns:=/train1")


def main(args: Sequence[str] | None = None) -> int:
    """Run `live [--host H] [--port N] [--ros-args ...]` until a signal."""
    own, ros = runtime.split_ros_arguments(sys.argv[1:] if args is None else args)
    usage = "%(prog)s [options] [--ros-args ...]"
    parser = argparse.ArgumentParser("live", parents=[address_options()], usage=usage, **help_texts(__doc__, *EXAMPLES))
    return run_tool(parser, lambda options: runtime.run("live", lambda: Live(*address_of(options)), ros), own)


def address_options() -> argparse.ArgumentParser:
    """Return the parent of the parsers of programs that serve the page."""
    parent = argparse.ArgumentParser(add_help=False)
    parent.add_argument("--host", help=f"address to serve the page at; 0.0.0.0: for everybody (default: {HOST})")
    parent.add_argument("--port", type=_port, help=f"0: any that is free (default: {PORT})")
    return parent


def address_of(options: argparse.Namespace) -> tuple[str, int]:
    """Return what they ask for."""
    return options.host or HOST, PORT if options.port is None else options.port


def _port(text: str) -> int:
    if not (text.isdecimal() and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text}: give a port from 0 to 65535")
    return int(text)


if __name__ == "__main__":
    raise SystemExit(main())
