# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What no command line may hold: a number out of range, and an option that would be of no effect."""

import argparse
from collections.abc import Iterable

MOST = 2**31 - 1
"""Of a count, and of a seed."""


def at_least(options: argparse.Namespace, **least: float) -> None:
    """Raise ValueError for the first of these options whose number is below that, or no number; counts have an end.

    >>> at_least(argparse.Namespace(first_seed=-1), first_seed=0)
    Traceback (most recent call last):
    ValueError: first-seed = -1: give at least 0
    """
    for name, bound in least.items():
        value = getattr(options, name)
        if value is None:
            continue
        if not value >= bound or (isinstance(value, int) and value > MOST):
            remedy = f"at most {MOST}" if value > MOST else f"at least {bound:g}"
            raise ValueError(f"{name.replace('_', '-')} = {value}: give {remedy}")


def refuse(options: object, names: Iterable[str], why: str) -> None:
    """Raise ValueError for the first of these options that was given; `why` it would be of no effect, and the remedy.

    Such an option has no default: None, False or an empty list is one that was not given.

    >>> refuse(argparse.Namespace(cell=50.0), ["cell"], "there is no map without --map: add that, or leave this out")
    Traceback (most recent call last):
    ValueError: --cell 50.0: there is no map without --map: add that, or leave this out
    """
    for name in names:
        value = getattr(options, name)
        if value is None or value is False or value == []:
            continue
        values = value if isinstance(value, list) else [] if value is True else [value]
        raise ValueError(f"{' '.join(['--' + name.replace('_', '-'), *map(str, values)])}: {why}")
