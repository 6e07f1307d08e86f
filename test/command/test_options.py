# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How a command line tool ends."""

import argparse
import errno
import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from adhesion_node.command.options import BAD_INPUT, DONE, FAILED, help_texts, json_option, run_tool
from adhesion_node.command.written import whole, write_text

FULL = "No space left on device: make room, or name a place on another disk"


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
    assert (ended.returncode, ended.stderr) == (FAILED, f"tool: standard output: {FULL}\n")


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


def test_what_a_terminal_would_obey_is_escaped(capsys: pytest.CaptureFixture[str]) -> None:
    """A topic's or a column's name went out as it stands in the file: it could clear the screen."""

    def work(_: argparse.Namespace) -> int:
        print("a\tb\r\x1b[31m")
        raise ValueError("μ\x1b[31m\x9b")

    assert run_tool(argparse.ArgumentParser("tool"), work, []) == BAD_INPUT
    assert capsys.readouterr() == ("a\tb\\x0d\\x1b[31m\n", "tool: μ\\x1b[31m\\x9b\n")


def test_what_is_no_text_is_escaped_in_a_file_too(tmp_path: Path) -> None:
    """The file was left empty."""
    write_text(tmp_path / "page", os.fsdecode(b"\xce\xbc of t\xff"))
    assert (tmp_path / "page").read_text(encoding="utf-8") == "μ of t\\udcff"


def test_a_full_disk_names_the_file_and_what_to_do(capsys: pytest.CaptureFixture[str]) -> None:
    def work(_: argparse.Namespace) -> int:
        write_text("/dev/full", "text")
        return DONE

    assert run_tool(argparse.ArgumentParser("tool"), work, []) == FAILED
    assert capsys.readouterr().err == f"tool: /dev/full: {FULL}\n"


def test_a_folder_that_is_not_there_is_told_before_the_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    worked: list[argparse.Namespace] = []

    def work(options: argparse.Namespace) -> int:
        worked.append(options)
        return DONE

    def tables(*options: str, file: str = "no/x") -> int:
        parser = argparse.ArgumentParser("tables", parents=[json_option()])
        parser.add_argument("--output")
        return run_tool(parser, work, ["--json", str(tmp_path / file), *options])

    assert tables() == FAILED
    assert tables("--output", str(tmp_path / "no"), file="no/deeper/x") == FAILED  # the work makes no folder in it
    assert not worked
    assert tables("--output", str(tmp_path / "no")) == DONE  # a folder that the work makes
    assert "No such file or directory: name one that is there" in capsys.readouterr().err


def reading(args: list[str]) -> int:
    """A tool that reads files and folders, and writes a file of its own, or into a folder, and JSON."""
    parser = argparse.ArgumentParser("tool", parents=[json_option()])
    parser.add_argument("bags", nargs="+")
    parser.add_argument("--out")
    parser.add_argument("--output")

    def work(options: argparse.Namespace) -> int:
        for path in filter(None, (options.out, options.json)):
            write_text(path, "result")
        return DONE

    return run_tool(parser, work, args)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder of a log, a link to it and a recording."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text("log")
    (tmp_path / "link.csv").symlink_to("log.csv")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run_0.mcap").write_text("recorded")
    return tmp_path


@pytest.mark.parametrize("option", ["--out", "--json"])
@pytest.mark.parametrize("path", ["log.csv", "./log.csv", "link.csv"])
@pytest.mark.parametrize("given", [["log.csv"], ["unit_7=log.csv"]])
def test_no_result_takes_the_place_of_what_is_read(
    option: str, path: str, given: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The log was lost."""
    assert reading([*given, option, path]) == BAD_INPUT
    assert capsys.readouterr().err == f"tool: {option} {path}: is read, and would be lost: name another file\n"
    assert (here / "log.csv").read_text() == "log"
    assert reading([*given, option, "result"]) == DONE
    assert reading([*given, option, "result"]) == DONE, "an earlier result is written over"


@pytest.mark.parametrize("path", ["run/run_0.mcap", "run/metadata.yaml", "made/report.html"])
def test_no_result_takes_the_place_of_a_part_of_a_recording_or_report(
    path: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reading(["run", "--output", "made", "--json", path]) == BAD_INPUT
    assert capsys.readouterr().err == f"tool: --json {path}: is a part of that recording or report: name another file\n"
    assert (here / "run" / "run_0.mcap").read_text() == "recorded"
    for _ in range(2):
        assert reading(["run", "--json", "run/result.json"]) == DONE


def test_a_second_name_of_what_is_read_is_no_result(here: Path) -> None:
    os.link(here / "log.csv", here / "second.csv")
    assert reading(["log.csv", "--out", "second.csv"]) == BAD_INPUT
    assert (here / "log.csv").read_text() == "log"


def test_two_files_that_are_begun_at_once_are_two(tmp_path: Path) -> None:
    """Nor is what a killed tool has left in the way."""
    one, other = (tmp_path / f"{'n' * 100}{index}.csv" for index in range(2))
    (tmp_path / f"{'n' * 20}.0.part").write_text("left")
    with whole(one) as first, whole(other) as second:
        Path(first).write_text("one")
        Path(second).write_text("other")
    assert (one.read_text(), other.read_text()) == ("one", "other")


def test_what_is_no_file_that_is_read_may_be_the_name_of_a_result(here: Path) -> None:
    (here / "bank=log.csv").write_text("another log")
    for path in ("bank", "log.csv", "log.csv"):
        assert reading(["bank=log.csv", "--json", path]) == DONE, "a file of that very name is meant"
    assert reading(["bank=log.csv", "--json", "/dev/null", "--out", "/dev/null"]) == DONE


def test_two_results_are_not_one_file(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert reading(["log.csv", "--out", "result", "--json", f"{here}/./result"]) == BAD_INPUT
    assert "both are one file: give each its own" in capsys.readouterr().err
    assert not (here / "result").exists()


@pytest.mark.parametrize("path", ["", "run", "run/"])
def test_a_folder_is_no_result_and_told_before_the_work(
    path: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reading(["log.csv", "--out", "result", "--json", path]) == FAILED
    assert capsys.readouterr().err.endswith(": Is a directory: it is a folder; name a file\n")
    assert not (here / "result").exists()


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


def test_a_file_stays_what_it_is_when_it_is_written_over(tmp_path: Path) -> None:
    """Its links, and who may read it."""
    file, link, second = tmp_path / "out.csv", tmp_path / "link.csv", tmp_path / "second.csv"
    link.symlink_to(file)
    for text in ("first", "second"):
        write_text(link, text)
        assert (file.read_text(), link.is_symlink()) == (text, True)
        file.chmod(0o600)
    assert file.stat().st_mode & 0o777 == 0o600
    os.link(file, second)
    write_text(file, "third")
    assert second.read_text() == "third"


@pytest.mark.parametrize(("name", "error"), [("no/out.csv", FileNotFoundError), ("out.csv/more", NotADirectoryError)])
def test_what_the_system_refuses_names_the_file_that_was_meant(name: str, error: type[OSError], tmp_path: Path) -> None:
    (tmp_path / "out.csv").write_text("")
    with pytest.raises(error) as raised, whole(tmp_path / name):
        pass
    assert raised.value.filename == str(tmp_path / name)


def test_a_name_may_be_as_long_as_the_system_lets_it(tmp_path: Path) -> None:
    write_text(tmp_path / ("n" * (os.pathconf(tmp_path, "PC_NAME_MAX") - 4) + ".csv"), "text")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["text"]


def test_where_nothing_can_take_a_files_place_it_is_written_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where it is mounted by itself."""

    def busy(*_: Any) -> None:
        raise OSError(errno.EBUSY, "busy")

    monkeypatch.setattr(os, "replace", busy)
    write_text(tmp_path / "out.csv", "text")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["text"]


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
