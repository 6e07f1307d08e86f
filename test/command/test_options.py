# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How a command line tool ends."""

import argparse
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from adhesion_node.command.options import BAD_INPUT, DONE, FAILED, help_texts, json_option, run_tool
from adhesion_node.command.written import whole, write_text


def interrupted_in_a_kernel(_: argparse.Namespace) -> int:
    """What a compiled kernel makes of a Ctrl-C, called by another one."""
    try:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as error:
            raise SystemError("branched returned a result with an exception set") from error
    except SystemError as error:
        raise SystemError("pruned returned a result with an exception set") from error


def test_a_ctrl_c_within_a_kernel_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_tool(argparse.ArgumentParser("tool"), interrupted_in_a_kernel, []) == FAILED
    assert capsys.readouterr().err == "tool: interrupted\n"


@pytest.mark.parametrize("lines", [1, 100_000])
def test_nothing_is_said_where_nobody_reads_on(lines: int) -> None:
    program = (
        "import argparse, sys; from adhesion_node.command.options import run_tool\n"
        f"sys.exit(run_tool(argparse.ArgumentParser(), lambda _: print('line\\n' * {lines}) or 0, []))"
    )
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as unread:
        command = [sys.executable, "-c", program]
        ended = subprocess.run(command, check=False, stdout=unread, stderr=subprocess.PIPE, text=True)
    assert (ended.returncode, ended.stderr) == (FAILED, "")


@pytest.mark.parametrize("lines", [0, 1, 100_000])
def test_a_full_disk_is_one_line(lines: int) -> None:
    """Whenever it shows: at the end, while the work prints, or, with 0 lines, at --version."""
    program = (
        "import argparse, sys; from adhesion_node.command.options import run_tool\n"
        f"sys.exit(run_tool(argparse.ArgumentParser('tool'), lambda _: print('line\\n' * {lines}) or 0))"
    )
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    command = [sys.executable, "-c", program, *([] if lines else ["--version"])]
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(command, check=False, stdout=full, stderr=subprocess.PIPE, text=True, env=buffered)
    assert (ended.returncode, ended.stderr) == (FAILED, "tool: input/output: No space left on device\n")


def broken(_: argparse.Namespace) -> int:
    raise SystemError("an error in Python itself")


def test_another_error_of_the_system_is_not_hidden() -> None:
    with pytest.raises(SystemError, match="in Python itself"):
        run_tool(argparse.ArgumentParser("tool"), broken, [])


def shouting(options: argparse.Namespace) -> int:
    print(f"μ of {options.path}")
    return DONE


def test_what_a_terminal_cannot_show_is_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    parser, written = argparse.ArgumentParser("tool"), io.BytesIO()
    parser.add_argument("path")
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(written, encoding="ascii", write_through=True))
    assert run_tool(parser, shouting, [os.fsdecode(b"t\xff")]) == DONE
    assert written.getvalue() == b"\\u03bc of t\\udcff\n"


def test_what_is_no_text_is_escaped_in_a_file_too(tmp_path: Path) -> None:
    """The file was left empty."""
    write_text(tmp_path / "page", os.fsdecode(b"\xce\xbc of t\xff"))
    assert (tmp_path / "page").read_text(encoding="utf-8") == "μ of t\\udcff"


def test_a_full_disk_names_the_file_and_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    def work(_: argparse.Namespace) -> int:
        write_text("/dev/full", "text")
        return DONE

    assert run_tool(argparse.ArgumentParser("tool"), work, []) == FAILED
    told = "tool: /dev/full: No space left on device: make room, or name a place on another disk\n"
    assert capsys.readouterr().err == told


def test_a_folder_that_is_not_there_is_told_before_the_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    worked: list[argparse.Namespace] = []

    def work(options: argparse.Namespace) -> int:
        worked.append(options)
        return DONE

    def tables(*options: str) -> int:
        parser = argparse.ArgumentParser("tables", parents=[json_option()])
        parser.add_argument("--output")
        return run_tool(parser, work, ["--json", str(tmp_path / "no" / "x"), *options])

    assert tables() == FAILED
    assert not worked
    assert tables("--output", str(tmp_path / "no")) == DONE  # a folder that the work makes
    assert "No such file or directory: name one that is there" in capsys.readouterr().err


def reading(args: list[str]) -> int:
    """A tool that reads LOG and writes a file of its own and JSON."""
    parser = argparse.ArgumentParser("tool", parents=[json_option()])
    parser.add_argument("log", nargs="+")
    parser.add_argument("--out")

    def work(options: argparse.Namespace) -> int:
        for path in filter(None, (options.out, options.json)):
            write_text(path, "result")
        return DONE

    return run_tool(parser, work, args)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("option", ["--out", "--json"])
@pytest.mark.parametrize("path", ["log.csv", "./log.csv", "link.csv"])
@pytest.mark.parametrize("log", ["log.csv", "unit_7=log.csv"])
def test_no_result_takes_the_place_of_what_is_read(
    option: str, path: str, log: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The log was lost."""
    (here / "log.csv").write_text("log")
    (here / "link.csv").symlink_to("log.csv")
    assert reading([log, option, path]) == BAD_INPUT
    assert capsys.readouterr().err == f"tool: {option} {path}: is read, and would be lost: name another file\n"
    assert (here / "log.csv").read_text() == "log"
    assert reading([log, option, "result"]) == DONE
    assert reading([log, option, "result"]) == DONE, "an earlier result is written over"


def test_two_results_are_not_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "result"
    assert reading(["log.csv", "--out", str(file), "--json", f"{tmp_path}/./result"]) == BAD_INPUT
    assert "both are one file: give each its own" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.parametrize("end", [ValueError, KeyboardInterrupt])
@pytest.mark.parametrize("earlier", [[], ["earlier"]])
def test_what_is_interrupted_leaves_the_earlier_file(
    end: type[BaseException], earlier: list[str], tmp_path: Path
) -> None:
    """A part of the rows stood there under the final name."""
    file = tmp_path / "out.csv"
    for text in earlier:
        file.write_text(text)
    with pytest.raises(end):
        begin(file, end)
    assert [path.read_text() for path in tmp_path.iterdir()] == earlier


def begin(file: Path, end: type[BaseException]) -> None:
    with whole(file) as part:
        Path(part).write_text("a part")
        raise end


def test_what_a_link_names_is_written(tmp_path: Path) -> None:
    file, link = tmp_path / "out.csv", tmp_path / "link.csv"
    link.symlink_to(file)
    with whole(link) as part:
        Path(part).write_text("all")
    assert (file.read_text(), link.is_symlink()) == ("all", True)


def test_what_is_no_file_is_written_itself(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/stdout"):
        with whole(path) as written:
            assert written == str(path)


def test_a_help_is_shown_on_the_narrowest_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ended with a traceback."""
    monkeypatch.setenv("COLUMNS", "1")
    assert help_texts("Does it, and more.", "tool FILE")["description"].split() == ["Does", "it,", "and", "more."]
