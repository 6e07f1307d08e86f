# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.
"""Formulas of numbers that become machine code when they are first called, and take arrays as numpy's own do.

The code is not kept, which costs each process a second or two: of two that compile the same formula at once numba keeps
parts that do not belong together, and who loads them crashes. The exponential and the arc tangent are numpy's, outside
of the formulas: those of the compiler differ from them by the last bit.
"""

from collections.abc import Callable
from functools import cache, wraps
from typing import Any, cast

import numpy as np

Function = Callable[..., Any]


def formula(types: str) -> Callable[[Callable[..., None]], Function]:
    """Compile a function of numbers that writes its results into what it is given last, arrays of one.

    `types` are numpy's letters of what it is given and of its results, "dd->d". What is made of it takes arrays that
    numpy can broadcast, and returns the results.
    """
    given, returned = types.split("->")
    shapes = f"{','.join(['()'] * len(given))}->{','.join(['()'] * len(returned))}"

    def decorate(function: Callable[..., None]) -> Function:
        @cache
        def compiled() -> Function:
            from numba import from_dtype, guvectorize, void  # who never calls a formula need not wait for it

            numbers = [from_dtype(np.dtype(letter)) for letter in given]
            signature = void(*numbers, *(from_dtype(np.dtype(letter))[:] for letter in returned))
            made: Any = guvectorize([signature], shapes)(function)
            return cast(Function, getattr(made, "ufunc", made))  # numpy's own, without numba's questions at each call

        @wraps(function)
        def call(*arguments: Any) -> Any:
            return compiled()(*arguments)

        return call

    return decorate
