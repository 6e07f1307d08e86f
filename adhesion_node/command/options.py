# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the command line tools share: --help, --json, completion, exit codes, errors in one line, progress."""

import argparse
import errno
import io
import json
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeVar

from .signals import interrupted, interrupted_by_sigterm
from .streams import open_closed_streams, show_controls
from .written import require_apart, require_folder, write_text

Item = TypeVar("Item")

DONE, FAILED, BAD_INPUT = 0, 1, 2
"""Exit codes of every tool."""

REMEDIES: Mapping[type[OSError], str] = {
    FileNotFoundError: ": name one that is there, or make the folder first",
    FileExistsError: ": it is a file; name a folder, or one that is to be made",
    NotADirectoryError: ": a part of it is a file; name a folder, or one that is to be made",
    IsADirectoryError: ": it is a folder; name a file",
    PermissionError: ": name one that you may write, or read",
}
"""What to do where the system refuses."""

NO_ROOM = ": make room, or name a place on another disk"

ESCAPED = "backslashreplace"
"""What becomes of letters that a terminal's encoding has not, and of bytes in a file's name that are none."""

WRITTEN, READ = ("output", "map", "out", "json"), ("file", "bag", "bags", "check", "estimate", "train", "params")
"""Options of all tools that name a file to write, or a folder, and one to read, maybe as NAME=FILE."""

NARROWEST = 11
"""Letters to a line of a help, as argparse has it."""

PROGRESS_S = 1.0
"""Time between two signs of life."""


def help_texts(purpose: str | None, *examples: str, more: str = "") -> dict[str, Any]:
    r"""Return what makes --help readable, for a parser: the purpose by paragraphs, `more` as it stands, examples last.

    A purpose that is a docstring is None under `python -OO`.

    >>> help_texts("Does it.", "tool FILE")["epilog"]
    'examples:\n  tool FILE'
    """
    width = max(shutil.get_terminal_size().columns - 2, NARROWEST)
    paragraphs = [textwrap.fill(" ".join(part.split()), width) for part in (purpose or "").split("\n\n")]
    shown = "\n".join(["examples:", *(f"  {example}" for example in examples)]) if examples else ""
    return {
        "description": "\n\n".join(paragraphs),
        "epilog": "\n\n".join(filter(None, (more, shown))),
        "formatter_class": _Formatter,
    }


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Says the default of an option behind its help, unless that says in words what holds else."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default, text = action.default, action.help or ""
        if default in (None, "", argparse.SUPPRESS) or isinstance(default, bool | list) or "default: " in text:
            return text
        return f"{text} (default: %(default){'g' if isinstance(default, float) else 's'})"


def json_option() -> argparse.ArgumentParser:
    """Return the parent of every tool's parser: `ArgumentParser(parents=[json_option()])`."""
    parent = argparse.ArgumentParser(add_help=False)
    parent.add_argument("--json", metavar="FILE", help="write the result as JSON to FILE, or - for standard output")
    return parent


def version_option(parser: argparse.ArgumentParser) -> None:
    """Add --version, which ends the program."""
    parser.add_argument("--version", action=_Version, nargs=0, help="say which version this is, and end")


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(version_of(parser.prog))
        parser.exit(DONE)


def version_of(program: str) -> str:
    """What a program says to --version."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        number = version("adhesion_node")
    except PackageNotFoundError:
        number = "of a source tree that is not installed"
    return f"{program}, adhesion_node {number}"


def remap_option(add: Callable[..., Any]) -> None:
    """Add --remap and --namespace, which say what the topics of a recording are, by a parser's `add_argument`."""
    shown = "which recorded topic is which of ours, for instance /odometry/position:=position"
    add("--remap", metavar="FROM:=TO", action="extend", nargs="+", default=[], help=shown)
    add("--namespace", metavar="NAME", help="of the train, as /train1 (default: none, or the only one recorded)")


def out_option(add: Callable[..., Any]) -> None:
    """Add --out by a parser's `add_argument`."""
    rows = (
        "every estimate as a row: time, place, speed, adhesion, bound, regime, distances, what was learnt of the train"
    )
    add("--out", metavar="FILE.csv|.parquet", help=rows)


def setting_options(add: Callable[..., Any]) -> None:
    """Add the options that set an estimator up, by the `add_argument` of a parser or a group."""
    add("--seed", type=int, help="seed of the estimator")
    add("--set", metavar="NAME=VALUE", action="append", default=[], help="a setting of the estimator; repeatable")
    add("--params", metavar="FILE", help="settings of the estimator as a ROS parameter file")
    train = (
        "the train, by its file (doc/train.md), or high_speed, metro, freight (default: the CRH3 of Xie et al. 2019)"
    )
    add("--train", metavar="FILE", help=train)
    add("--node", metavar="NAME", help="whose, where that file has several, such as /train1/estimator")


def run_tool(
    parser: argparse.ArgumentParser, work: Callable[[argparse.Namespace], int], args: Sequence[str] | None = None
) -> int:
    """Parse the command line, do the work and return the exit code.

    A ValueError is bad input (2), an OSError or Ctrl-C a failure (1), SIGTERM 143: one line on standard error, no
    traceback, and none at all where nobody reads on, as behind `| head`, or a stream is closed. Bad usage ends the
    program with 2 (SystemExit). Asked by a shell, it says how the command line may go on and ends.
    """
    open_closed_streams()
    try:
        try:
            return _worked(parser, work, args)
        finally:
            sys.stdout.flush()
    except OSError as error:
        with suppress(io.UnsupportedOperation):  # what waits to be written would complain at the program's end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED if isinstance(error, BrokenPipeError) else complain(parser.prog, error, FAILED)


def _worked(
    parser: argparse.ArgumentParser, work: Callable[[argparse.Namespace], int], args: Sequence[str] | None
) -> int:
    """As `run_tool`, as long as somebody reads the output."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ESCAPED)
    show_controls()
    version_option(parser)
    complete(parser)
    options = parser.parse_args(args)
    try:
        with interrupted_by_sigterm():
            _require_files(options)
            return work(options)
    except ValueError as error:
        return complain(parser.prog, error, BAD_INPUT)
    except BrokenPipeError:
        raise
    except OSError as error:
        return complain(parser.prog, error, FAILED)
    except (KeyboardInterrupt, SystemError) as error:
        if not _is_interrupt(error):
            raise
        return interrupted(parser.prog)


def written_by(options: argparse.Namespace) -> dict[str, str]:
    """The files and folders that are written, by option."""
    given = vars(options)
    return {name: str(given[name]) for name in WRITTEN if given.get(name) not in (None, "-")}


def _require_files(options: argparse.Namespace) -> None:
    """Raise, before the work, where a file cannot be written as it is named, or would be in another's place."""
    named, written = {name: value for name, value in vars(options).items() if value is not None}, written_by(options)
    for name in ("json", "out", "map"):
        if name in written:
            require_folder(written[name], written.get("output"))
    given = (named[name] for name in READ if name in named)
    every = [each for value in given for each in (value if isinstance(value, list) else [value])]
    texts = [each for each in every if isinstance(each, str)]
    require_apart(written, (text if os.path.exists(text) else text.partition("=")[2] for text in texts))


def printable(path: str) -> str:
    """The path as text: bytes that are none, as a file's name may have, are escaped."""
    return path.encode(errors=ESCAPED).decode()


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether it is a Ctrl-C; within a kernel it comes as the cause of a SystemError, or of several."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def complete(parser: argparse.ArgumentParser) -> None:
    """Tell a shell that asks how the command line may go on, and end; else do nothing."""
    if "_ARGCOMPLETE" in os.environ:
        import argcomplete  # only here: no node needs it to run

        argcomplete.autocomplete(parser)


def report(destination: str | None, result: Mapping[str, Any] | Sequence[Any], text: str) -> None:
    """Print `text`, and write `result` as JSON to `destination`; for "-" the JSON stands alone on standard output.

    Raises ValueError for a number that is not finite, which JSON cannot hold.
    """
    if destination != "-":
        print(text)
    if destination is None:
        return
    document = json.dumps(result, indent=2, allow_nan=False) + "\n"
    if destination == "-":
        sys.stdout.write(document)
    else:
        write_text(destination, document)


def progress(items: Iterable[Item], noun: str, total: int | None = None) -> Iterator[Item]:
    """Yield the items and say on standard error about every second how many have passed; short work stays silent."""
    of_all = "" if total is None else f" of {total}"
    due = time.monotonic() + PROGRESS_S
    for count, item in enumerate(items):
        if (now := time.monotonic()) >= due:
            due = now + PROGRESS_S
            print(f"{count}{of_all} {noun}", file=sys.stderr)
        yield item


def complain(program: str, error: Exception, code: int) -> int:
    """Say in one line under the program's name what is wrong, and return the exit code."""
    message = str(error)
    if isinstance(error, OSError):
        is_full = bool(error.filename) and error.strerror == os.strerror(errno.ENOSPC)
        remedy = NO_ROOM if is_full else REMEDIES.get(type(error), "")
        message = f"{error.filename or 'input/output'}: {error.strerror or error}{remedy}"
    print(f"{program}: {' '.join(message.split())}", file=sys.stderr)
    return code
