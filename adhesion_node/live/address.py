# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Where the live page is served: options that its programs share."""

from __future__ import annotations

import argparse


def address_options() -> argparse.ArgumentParser:
    """Return the parent of the parsers of programs that serve the page."""
    parent = argparse.ArgumentParser(add_help=False)
    parent.add_argument(
        "--host", default="127.0.0.1", help="address to serve the page at; 0.0.0.0: for everybody (default: 127.0.0.1)"
    )
    parent.add_argument("--port", type=_port, default=8080, help="0: any that is free (default: 8080)")
    return parent


def _port(text: str) -> int:
    number = int(text)
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError(f"{text}: give a port from 0 to 65535")
    return number
