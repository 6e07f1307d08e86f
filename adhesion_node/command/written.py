# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Files that are written: where the system names none for its error, as on a full disk, the error names the file."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
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


def write_text(path: str | Path, text: str) -> None:
    """Write a text into a file; bytes that are no text, as of another file's name, are escaped."""
    with naming(path):
        Path(path).write_text(text, encoding="utf-8", errors="backslashreplace")
