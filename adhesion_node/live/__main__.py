"""`live`: a page in the browser that shows the run while the nodes run, at 10 Hz."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from ..cli import run_tool
from ..nodes import runtime
from .address import address_options
from .node import Live


def main(args: Sequence[str] | None = None) -> int:
    """Run `live [--host H] [--port N] [--ros-args ...]` until a signal."""
    own, ros = runtime.split_ros_arguments(sys.argv[1:] if args is None else args)
    parser = argparse.ArgumentParser(
        "live", description=__doc__, parents=[address_options()], usage="%(prog)s [options] [--ros-args ...]"
    )
    return run_tool(parser, lambda options: runtime.run(lambda: Live(options.host, options.port), ros), own)


if __name__ == "__main__":
    raise SystemExit(main())
