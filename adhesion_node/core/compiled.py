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

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function for the types of its first call; divisions by 0 give inf or NaN as those of arrays do."""
    compiled: Any
    try:
        compiled = njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # nothing can be written anywhere: each run compiles anew
        compiled = njit(error_model="numpy")(function)
    return cast(Function, compiled)
