# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Cells of a CSV log: exact numbers and times, and a reason with a remedy for each one that is none."""

import csv
import re
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation

TIME_UNITS = {"s": Decimal(10**9), "ms": Decimal(10**6), "ns": Decimal(1), "iso": Decimal(10**9)}

END_OF_STAMPS_NS = 2**31 * 10**9
"""A ROS stamp holds whole seconds in 31 bits: until 2038."""

MAX_EXPONENT = 40
"""Decimal powers beyond this would only overflow on the way to being refused."""

_ISO = re.compile(r"(?P<moment>[^.,]+?)([.,](?P<fraction>\d+))?(?P<zone>Z|[+-]\d\d:?\d\d)?")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class Bad(ValueError):
    """A cell that cannot be used: `reason` is for counting, the text is the whole message."""

    def __init__(self, reason: str, column: str, value: str, remedy: str) -> None:
        shown = repr(value if len(value) <= 60 else value[:60] + "...")
        super().__init__(f"{column} = {shown}: {remedy}")
        self.reason = reason


def split(text: str, delimiter: str) -> list[str]:
    """Return the cells of a line; raises Bad."""
    try:
        return next(csv.reader([text], delimiter=delimiter, strict=True), [])
    except csv.Error as error:
        raise Bad("broken_quotes", "row", text.strip(), f"close the quotes of this row ({error})") from None


def decimal(column: str, text: str) -> Decimal:
    """Return the number of a cell, exactly; raises Bad."""
    try:
        value = Decimal(text)
    except InvalidOperation:
        value = Decimal("nan")
    # Python also reads 1_000 as a number; in a log it is a misprint.
    if not value.is_finite() or "_" in text:
        raise Bad("not_a_number", column, text, "write a finite number with a decimal point, without its unit")
    if value and not -MAX_EXPONENT < value.adjusted() < MAX_EXPONENT:
        raise Bad("out_of_range", column, text, "no measured quantity has such a size")
    return value


def time_ns(text: str, unit: str) -> int:
    """Return a time in whole nanoseconds, exactly; digits beyond are rounded. Raises Bad."""
    value = _iso_seconds(text) if unit == "iso" else decimal("time", text)
    t_ns = int((value * TIME_UNITS[unit]).to_integral_value())
    if not 0 <= t_ns < END_OF_STAMPS_NS:
        remedy = "a stamp lies between 1970 (or 0) and 2038: is the --time-unit another?"
        raise Bad("out_of_range", "time", text, remedy)
    return t_ns


def _iso_seconds(text: str) -> Decimal:
    """Return the seconds since 1970; without a zone the time is taken as UTC.

    The fraction is kept apart: `datetime` would cut it to microseconds.
    """
    parts = _ISO.fullmatch(text)
    try:
        if parts is None:
            raise ValueError
        moment = datetime.fromisoformat(parts["moment"] + (parts["zone"] or "Z"))
    except ValueError:
        remedy = "write 2024-05-31T10:20:30.125Z, or choose another --time-unit"
        raise Bad("not_a_time", "time", text, remedy) from None
    return (moment - _EPOCH) // timedelta(seconds=1) + Decimal(f"0.{parts['fraction'] or 0}")
