# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Files that are written: whole or not at all, never over one that is read, and an error names its file."""

import errno
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import combinations, count
from pathlib import Path

PARTS = (".mcap", ".db3", ".zstd", "-wal", "metadata.yaml", "report.html", ".png", ".pdf")
"""How files of a recording and of a report end."""

KEPT_LETTERS = 20
"""Of a file's name in that of its unfinished part, so that no system finds it too long."""


@contextmanager
def naming(path: str | Path) -> Iterator[None]:
    """Let an OSError that names no file name this one; opening a file names it, writing and closing do not."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def require_folder(path: str, made: str | None) -> None:
    """Raise OSError where a file cannot be: its folder is not there, nor the one that is made, or it is a folder."""
    folder = os.path.dirname(os.path.realpath(path))
    if path == "" or Path(path).is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), path)
    if not os.path.isdir(folder) and (made is None or os.path.realpath(made) != folder):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)


def require_apart(written: Mapping[str, str], read: Iterable[str]) -> None:
    """Raise ValueError where two options, by name, write one file, or one writes what is read or a part of it."""
    files = {name: path for name, path in written.items() if not os.path.exists(path) or os.path.isfile(path)}
    for (one, path), (other, again) in combinations(files.items(), 2):
        if os.path.realpath(path) == os.path.realpath(again):
            raise ValueError(f"--{one} {path} and --{other} {again}: both are one file: give each its own")
    inputs = [path for path in read if os.path.exists(path)]
    folders = {os.path.realpath(path) for path in (*inputs, *written.values())}
    for name, path in files.items():
        if os.path.isfile(path) and any(os.path.samefile(path, each) for each in inputs):
            raise ValueError(f"--{name} {path}: is read, and would be lost: name another file")
        final = os.path.realpath(path)
        if final.lower().endswith(PARTS) and not folders.isdisjoint(map(str, Path(final).parents)):
            raise ValueError(f"--{name} {path}: is a part of that recording or report: name another file")


@contextmanager
def whole(path: str | Path) -> Iterator[str]:
    """Give the name of a file to write that takes the place of `path` at the end, or goes where an error ends it.

    A file that is there is written itself where nothing can take its place as it is: a device or a pipe, one that is
    another user's, may not be written or has a second name, one in a folder that may not be changed.
    """
    final = os.path.realpath(path)
    if _is_itself(str(path), final):
        yield str(path)
        return
    try:
        part = _begun(final)
    except OSError as error:
        error.filename = str(path)
        raise
    try:
        yield part
        _replace(part, final)
    except BaseException as error:
        with suppress(OSError):
            os.unlink(part)
        if isinstance(error, OSError) and error.filename == part:
            error.filename = str(path)
        raise


def _begun(final: str) -> str:
    """Make a part of a file, of a name that none has: another process may be killed, or be at it."""
    folder, name = os.path.split(final)
    numbers = count()
    while True:
        part = Path(folder, f"{name[:KEPT_LETTERS]}.{next(numbers)}.part")
        with suppress(FileExistsError):
            part.touch(exist_ok=False)
            return str(part)


def _is_itself(path: str, final: str) -> bool:
    named = os.path.abspath(path)
    if named.startswith(("/dev/", "/proc/")) and not named.startswith("/dev/shm/"):
        return True
    if not os.path.exists(path):
        return False
    found = os.stat(path)
    is_ours = os.path.isfile(path) and found.st_nlink == 1 and found.st_uid == os.geteuid()
    return not (is_ours and os.access(path, os.W_OK) and os.access(os.path.dirname(final), os.W_OK))


def _replace(part: str, final: str) -> None:
    if os.path.exists(final):
        shutil.copymode(final, part)
    with open(part, "rb") as file:
        os.fsync(file.fileno())
    try:
        os.replace(part, final)
    except OSError as error:
        if error.errno != errno.EBUSY:  # a file that is mounted by itself
            raise
        shutil.copyfile(part, final)
        os.unlink(part)


def write_text(path: str | Path, text: str) -> None:
    """Write a text into a file; bytes that are no text, as of another file's name, are escaped."""
    with naming(path), whole(path) as part:
        Path(part).write_text(text, encoding="utf-8", errors="backslashreplace")
