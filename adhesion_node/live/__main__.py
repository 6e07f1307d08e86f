# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`live`: a page in the browser that shows the run while the nodes run, at 10 Hz."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from ..command.options import help_texts, run_tool
from ..nodes.ros import runtime
from .address import address_options
from .node import Live

EXAMPLES = ("live", "live --port 9000 --ros-args -r __ns:=/train1")


def main(args: Sequence[str] | None = None) -> int:
    """Run `live [--host H] [--port N] [--ros-args ...]` until a signal."""
    own, ros = runtime.split_ros_arguments(sys.argv[1:] if args is None else args)
    usage = "%(prog)s [options] [--ros-args ...]"
    parser = argparse.ArgumentParser("live", parents=[address_options()], usage=usage, **help_texts(__doc__, *EXAMPLES))
    return run_tool(parser, lambda options: runtime.run(lambda: Live(options.host, options.port), ros), own)


if __name__ == "__main__":
    raise SystemExit(main())
