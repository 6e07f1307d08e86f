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
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path


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
    """Raise FileNotFoundError where the folder of a file is not there, nor the one that is made: before the work."""
    folder = Path(path).parent
    if not folder.is_dir() and (made is None or Path(made) not in (folder, *folder.parents)):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)


def require_apart(written: Mapping[str, str], read: Iterable[str]) -> None:
    """Raise ValueError where two options, by name, write one file, or one writes what is read."""
    for (one, path), (other, again) in combinations(written.items(), 2):
        if os.path.realpath(path) == os.path.realpath(again):
            raise ValueError(f"--{one} {path} and --{other} {again}: both are one file: give each its own")
    inputs = {os.path.realpath(path) for path in read if os.path.isfile(path)}
    for name, path in written.items():
        if os.path.realpath(path) in inputs:
            raise ValueError(f"--{name} {path}: is read, and would be lost: name another file")


@contextmanager
def whole(path: str | Path) -> Iterator[str]:
    """Give the name of a file to write that takes the place of `path` at the end, or goes where an error ends it.

    What is no file, or under /dev, is written itself; so is a file in a folder that may not be changed.
    """
    final, is_device = os.path.realpath(path), Path("/dev") in Path(path).absolute().parents
    is_plain = os.path.isfile(path) and os.access(os.path.dirname(final), os.W_OK)
    if is_device or (os.path.exists(path) and not is_plain):
        yield str(path)
        return
    part = f"{final}.{os.getpid()}.part"
    try:
        yield part
        os.replace(part, final)
    except BaseException as error:
        Path(part).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename == part:
            error.filename = str(path)
        raise


def write_text(path: str | Path, text: str) -> None:
    """Write a text into a file; bytes that are no text, as of another file's name, are escaped."""
    with naming(path), whole(path) as part:
        Path(part).write_text(text, encoding="utf-8", errors="backslashreplace")
