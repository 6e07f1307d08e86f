# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Kernels: plain functions of numbers and arrays that become machine code when they are first called.

The code is kept beside the module, or where that cannot be written in the user's cache, so that only the first run
after an install waits for the compiler. What is kept is told by the kernel's own file alone: a kernel calls only what
stands in that file, and is given every constant as an argument.
"""

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar, cast
from uuid import uuid4

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function for the types of its first call; divisions by 0 give inf or NaN as those of arrays do."""
    compiled: Any
    try:
        compiled = njit(cache=True, error_model="numpy")(function)
        if hasattr(compiled, "_cache"):  # else numba is told to compile nothing
            compiled._cache._cache_file = _Files(compiled._cache._cache_file)
    except (RuntimeError, AttributeError):  # nothing can be written anywhere, or numba keeps otherwise: never kept
        compiled = njit(error_model="numpy")(function)
    return cast(Function, compiled)


class _Files:
    """Numba's files of a kernel's code, without which every kernel works.

    A power cut, a full disk or another user may leave files that cannot be read or written, or a part of the code: it
    is compiled anew. Numba gives the code of a new version the name of the old one's, and lists it before it is
    written; whoever was stopped in between left a list that led to the old code. So each code has a name of its own.
    """

    def __init__(self, files: Any) -> None:
        self._files, self._dump = files, files._dump
        pattern = files._data_name_pattern
        files._data_name = lambda number: pattern.format(number=number).replace(".nbc", f".{uuid4().hex[:16]}.nbc")

    def flush(self) -> None:
        """Forget what is kept."""
        self._files.flush()

    def load(self, key: Any) -> Any:
        """What is kept, None if nothing is."""
        try:
            digest, content = self._files.load(key) or (b"", b"")
            return pickle.loads(content) if hashlib.sha256(content).digest() == digest else None
        except Exception:  # of a file that is cut any may come
            return None

    def save(self, key: Any, data: Any) -> None:
        """Keep it, if that can be."""
        content = self._dump(data)
        checked = hashlib.sha256(content).digest(), content
        try:
            self._files.save(key, checked)
        except OSError:
            return
        except Exception:  # a list that is cut is begun anew
            with suppress(OSError):
                self._files.flush()
                self._files.save(key, checked)
