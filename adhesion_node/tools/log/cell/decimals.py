# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which sign the decimals of a log have, where separators of thousands may be the other one."""

import re
from collections.abc import Iterable

NO_DECIMAL = re.compile("(?<=[0-9])['\u2019 \u00a0\u2009\u202f](?=[0-9]{3}(?![0-9]))")
"""What stands between groups of thousands and is no decimal sign: apostrophes and spaces."""

_GROUP = "[+-]?[1-9][0-9]{0,2}"
_SURE = {
    sign: re.compile(
        rf"(?!{_GROUP}{sign}[0-9]{{3}}$)[+-]?[0-9]*{sign}[0-9]+([eE][+-]?[0-9]+)?"  # 20,5 and 1000,173
        rf"|{_GROUP}({other}[0-9]{{3}})+{sign}[0-9]+|{_GROUP}({other}[0-9]{{3}}){{2,}}"  # 1.000,17 and 1.000.000
    )
    for sign, other in ((",", "[.]"), ("[.]", ","))
}
"""What a number looks like that tells its decimal sign; 20,000 does not."""

_UNSURE = {sign: re.compile(rf"{_GROUP}{sign}[0-9]{{3}}") for sign in _SURE}


def decimal_sign(cells: Iterable[str]) -> tuple[str, bool]:
    """The sign that more numbers have, and whether it is sure: not where all of them may be groups of thousands.

    >>> decimal_sign(["20,5", "1.250,5"]), decimal_sign(["1.000", "0.1"]), decimal_sign(["20,000"]), decimal_sign(["7"])
    ((',', True), ('.', True), (',', False), ('.', False))
    >>> decimal_sign(["1 250,5"])
    (',', True)
    """
    texts = [NO_DECIMAL.sub("", cell) for cell in cells]
    for looks in (_SURE, _UNSURE):
        commas, points = (sum(map(bool, map(number.fullmatch, texts))) for number in looks.values())
        if commas or points:
            return "," if commas > points else ".", looks is _SURE and commas != points
    return ".", False
