# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Files of the rail by place and date: what `brakings --map` wrote is read, in the sense of the positions."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pandas as pd
import pytest

from adhesion_node.core.belief.rail_map import Piece
from adhesion_node.run.results.rail_map import map_of
from adhesion_node.wire.files.rail_map import UNKNOWN_STD, read_rail_map
from adhesion_node.wire.settings.setup import setup_of


def rail() -> pd.DataFrame:
    """Return a map of two pieces: adhesion limited on the second alone."""
    cells = {
        "cell": [7, 3],
        "t_ns": [1_700_000_000_123_456_789, 1_700_000_000_000_000_000],
        "limited": [True, False],
        "speed_mps": 30.0,
        "mu": [0.05, float("nan")],
        "mu_std": [0.003, float("nan")],
        "used": [0.05, 0.08],
        "mu_lower": [0.045, 0.075],
    }
    return map_of(pd.DataFrame(cells), 100.0)


PIECES = (
    Piece(300.0, 100.0, 1_700_000_000_000_000_000, 1, 0.08, UNKNOWN_STD, 0.075, 30.0, False),
    Piece(700.0, 100.0, 1_700_000_000_123_456_789, 1, 0.05, 0.003, 0.045, 30.0, True),
)


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_what_was_written_is_read(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"rail{ending}"
    rail().to_csv(path, index=False) if ending == ".csv" else rail().to_parquet(path, index=False)
    assert read_rail_map(str(path)).pieces == PIECES
    assert setup_of({"rail_map": str(path)}).config.rail_map == read_rail_map(str(path))
    down = setup_of({"rail_map": str(path), "direction": "down"}).config.rail_map
    assert down is not None
    assert [piece.place_m for piece in down.pieces] == [-800.0, -400.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("place_m,date\n0,today\n", "lacks the columns length_m, t_ns, seen"),
        (
            "place_m;length_m\n0,0;100,0\n",
            "lacks the columns place_m, .*: `brakings --map` writes them, cells apart by commas",
        ),
        (
            "place_m,length_m,t_ns,seen,mu,mu_std,used,mu_lower,speed_mps\n0,100,soon,1,,,0.1,0.1,30\n",
            "row 1: t_ns = 'soon': give a number",
        ),
        (
            "place_m,length_m,t_ns,seen,mu,mu_std,used,mu_lower,speed_mps\n0,100,1,inf,,,0.1,0.1,30\n",
            "row 1: seen = 'inf': give a number",
        ),
        (
            "place_m,length_m,t_ns,seen,mu,mu_std,used,mu_lower,speed_mps\n" + 2 * "0,100,1,1,,,0.1,0.1,30\n",
            "rows 1 and 2: one piece at 0 m, one stamp: give it once",
        ),
        ("", "is empty: `brakings --map` writes one"),
        (
            "date,place_m,length_m,t_ns,seen,mu,mu_std,used,mu_lower,speed_mps\n"
            "2023-11-14,0,100,1.7E+18,1,,,0.1,0.1,30\n2024-06-01,100,100,1.72E+18,1,,,0.1,0.1,30\n",
            "row 2: .* is of another day than 2024-06-01: give every digit",
        ),
        (
            "place_m,length_m,t_ns,seen,mu,mu_std,used,mu_lower,speed_mps\n0,0,1,1,,,0.1,0.1,30\n",
            "a length above 0",
        ),
    ],
)
def test_what_is_no_map_is_refused_with_its_file(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "rail.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=rf"rail_map = {path}: .*{message}"):
        read_rail_map(str(path))


def test_what_a_spreadsheet_saved_is_read(tmp_path: Path) -> None:
    """With a mark of its encoding in front, and stamps of 15 digits."""
    path = tmp_path / "rail.csv"
    rail().to_csv(path, index=False, encoding="utf-8-sig")
    assert read_rail_map(str(path)).pieces == PIECES
    saved = path.read_text(encoding="utf-8").replace("1700000000000000000", "1.70000000000000E+18")
    path.write_text(saved, encoding="utf-8")
    assert read_rail_map(str(path)).pieces == PIECES


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e-6, "t_ns = 1700000000123 is of 1970, too old for a train of today: is it in s or ms? Give ns"),
        (1e-9, "t_ns = 1700000000 is of 1970, too old"),
        (2.0, "t_ns = 3400000000246913578 is of 2077, to come, and makes no train less careful until then"),
        (1.0, None),
    ],
)
def test_stamps_of_no_effect_are_said(factor: float, said: str | None, tmp_path: Path) -> None:
    """The map was of no effect, and nothing said so."""
    path = tmp_path / "rail.csv"
    stamps = [int(Decimal(t_ns) * Decimal(str(factor))) for t_ns in rail()["t_ns"]]
    rail().drop(columns="date").assign(t_ns=stamps).to_csv(path, index=False)
    told = setup_of({"rail_map": str(path)}).unread
    assert [line.startswith(f"rail_map = {path}: {said}") for line in told] == ([True] if said else [])


def test_a_missing_file_is_said() -> None:
    with pytest.raises(ValueError, match=r"rail_map = nowhere\.csv: not readable .*`brakings --map` writes one"):
        setup_of({"rail_map": "nowhere.csv"})
