# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Units as a log itself names them: behind the name of a column, `v [km/h]`, `speed_kmh`, or in a line below."""

import re
import unicodedata
from collections.abc import Sequence

from ..format import FAMILIES, UNITS

_SPELT = {
    "s": ("sec", "second", "seconds", "sekunden", "с"),
    "ms": ("msec", "millisecond", "milliseconds", "мс"),
    "us": ("μs", "microseconds"),
    "ns": ("nanoseconds",),
    "min": ("minute", "minutes", "minuten", "мин"),
    "h": ("hour", "hours", "std", "ч"),
    "m": ("metre", "metres", "meter", "meters", "м"),
    "km": ("kilometre", "kilometres", "kilometer", "kilometers", "км"),
    "cm": ("centimetre", "centimetres", "centimeter", "centimeters", "см"),
    "mm": ("millimetre", "millimetres", "millimeter", "millimeters", "мм"),
    "mi": ("mile", "miles"),
    "ft": ("feet", "foot"),
    "mps": ("m/s", "ms", "ms-1", "m/sec", "м/с"),
    "kmh": ("km/h", "kph", "kmph", "km/hr", "kmh-1", "км/ч"),
    "mph": ("mi/h", "miles/h"),
    "kn": ("kt", "kts", "knot", "knots", "knoten"),
    "pa": ("pascal", "n/m2", "па"),
    "kpa": ("kn/m2", "кпа"),
    "bar": ("бар",),
    "mbar": ("hpa",),
    "mpa": ("n/mm2", "мпа"),
    "psi": ("lbf/in2",),
    "kgcm2": ("kgf/cm2", "kg/cm2", "kp/cm2", "at", "кгс/см2"),
    "percent": ("%", "prozent", "pct", "процент"),
    "mps2": ("m/s2", "ms-2", "m/s/s", "м/с2"),
    "radps": ("rad/s", "rads-1", "rad/sec", "рад/с"),
    "rpm": ("1/min", "min-1", "r/min", "u/min", "rev/min", "об/мин"),
    "deg": ("°", "degree", "degrees"),
}
"""How units are written; in `min^-1` and `m s⁻²` what raises and what divides is left out."""

_KINDS = {"gauge": "g|ga|gauge|rel|ü", "absolute": "a|abs|absolute?"}
_WITH_KIND = {kind: re.compile(rf"(.+?)[(_]*(?:{ends})\.?") for kind, ends in _KINDS.items()}
"""What follows a unit of pressures where it says above what they are: `barg`, `bar(a)`, `kPa abs`."""

_BRACKETS = re.compile(r"(.*?)(?:\s*/|\s+in)?[\s_]*[\[(<{（【［]\s*(.*?)\s*[\])>}）】］]+")

_MARKS = tuple(
    map(
        re.compile,
        (
            r"(.+)_(.+)$",
            r"(.+?)\s*/\s*(.+)$",
            r"(.+?)\s*[,，]\s*(.+)$",
            r"(.+)\s+in\s+(.+)$",
            r"(.+)[\s.](.+)$",
            r"(.+?)\s(.+)$",
        ),
    )
)
"""What stands between a name and its unit where no brackets are: `p_bar`, `v/km/h` (DIN), `v, km/h`, `v in km/h`."""


def known(text: str, column: str) -> str | None:
    """Return the unit of a column that a text means, as its option calls it; None for what is none.

    >>> known("km/h", "speed"), known("m s⁻²", "acceleration"), known("MPa", "brake_pipe"), known("rods", "speed")
    ('kmh', 'mps2', 'mpa', None)
    >>> known("ms", "time"), known("ms", "speed"), known("(1/min)", "wheel_speed"), known("bar(g)", "brake_demand")
    ('ms', 'mps', 'rpm', 'bar')
    """
    return _known(text, column)[0]


def kind_of(text: str, column: str) -> str | None:
    """Return whether a unit of pressures says that they are `gauge`, above the air, or `absolute`.

    >>> [kind_of(text, "brake_pressure") for text in ("barg", "psia", "MPa", "bar abs.", "at")]
    ['gauge', 'absolute', None, 'absolute', None]
    """
    return _known(text, column)[1]


def _known(text: str, column: str) -> tuple[str | None, str | None]:
    """The unit and the kind."""
    plain = unicodedata.normalize("NFKC", text).replace("\u2212", "-").casefold().strip("[](){}<>【】 ")
    plain = re.sub(r"\^1$|[\s^*·⋅]", "", plain)
    family = FAMILIES.get(column, column)
    ends = _WITH_KIND if family == "pressure" else {}
    texts = {plain: None, **{match[1]: kind for kind, end in ends.items() if (match := end.fullmatch(plain))}}
    found = ((unit, texts[each]) for each in texts for unit in UNITS[family] if each in (unit, *_SPELT.get(unit, ())))
    return next(found, (None, None))


def parted(name: str, column: str) -> tuple[str, str]:
    """Return the name of a column of ours without its unit, and the unit as it is written, or nothing.

    A name may be a unit and nothing else.

    >>> parted("v [km/h]", "speed"), parted("speed_kmh", "speed"), parted("speed_std", "speed")
    (('v', 'km/h'), ('speed', 'kmh'), ('speed_std', ''))
    >>> parted("v in km/h", "speed"), parted("v / (km/h)", "speed"), parted("s/m", "position"), parted("in/x", "speed")
    (('v', 'km/h'), ('v', 'km/h'), ('s', 'm'), ('in/x', ''))
    >>> parted("km/h", "speed"), parted("km", "position")
    (('km/h', 'km/h'), ('km', 'km'))
    """
    if match := _BRACKETS.fullmatch(name):
        return match[1], match[2]
    parts = (mark.match(name) for mark in _MARKS)
    whole = name, name if known(name, column) else ""
    return next(((part[1], part[2]) for part in parts if part and known(part[2], column)), whole)


def meant(name: str, column: str, header: Sequence[str]) -> list[str]:
    """Return the names in a header that mean a column of ours: this one, else those that differ in case and unit.

    >>> meant("speed", "speed", ["Time", "Speed (mph)", "speed_std"])
    ['Speed (mph)']
    """
    return [name] if name in header else [each for each in header if _plain(each, column) == _plain(name, column)]


def _plain(name: str, column: str) -> str:
    return re.sub(r"[\s_-]+", "_", parted(name, column)[0].strip().casefold())
