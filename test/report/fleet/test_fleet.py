# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The report of a table of brakings: what is wrong with a table, the rail out of it, where it was low, the page."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from adhesion_node.report.__main__ import main
from adhesion_node.report.fleet.rail import low_spots, over_dates, read_fleet, spread
from adhesion_node.run.results.brakings import BRAKING

DAY_NS = 86_400_000_000_000
START_NS = 1_700_000_000_000_000_000
DATES = ("2023-11-14", "2023-11-15")


def braking(train: str, day: int, place_m: float, mu: float = np.nan, **others: Any) -> dict[str, Any]:
    """A braking over 250 m from 100 km/h; by the brake alone unless an adhesion is given."""
    limited = not np.isnan(mu)
    shares = {"share_adhesion": 0.8 * limited, "share_brake": 0.2 if limited else 1.0, "share_unclaimed": 0.0}
    row = dict.fromkeys(BRAKING.names or (), 0.0) | {"t_ns": START_NS + day * DAY_NS, "estimates": 20}
    row |= {"place_m": place_m, "place_end_m": place_m + 250.0, "from_kmh": 100.0, "to_kmh": 40.0, "safe_m": 500.0}
    row |= {"mu": mu, "mu_std": mu / 50, "mu_least": 0.9 * mu, "used": mu if limited else 0.11, "mu_lower": 0.8 * mu}
    row |= {} if limited else {"mu_lower": 0.1}
    return {"train": train, "recording": f"runs/{train}"} | row | shares | others


BRAKINGS = (
    braking("unit_7", 0, 1000.0, 0.05),
    braking("unit_8 <b>", 1, 1100.0, 0.12),
    braking("unit_8 <b>", 1, 5000.0, share_brake=0.6, share_unclaimed=0.4),
)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Write the brakings as `brakings` does."""
    path = tmp_path / "brakings.csv"
    pd.DataFrame(BRAKINGS).to_csv(path, index=False)
    return path


def rail(path: Path) -> Path:
    """Write the map of a piece that is low on one of two dates, its neighbour, and one far away."""
    one = {"length_m": 100.0, "limited": 1, "mu_std": 0.001, "speed_mps": 20.0, "t_ns": START_NS}
    rows = [
        one | {"place_m": place, "date": DATES[day], "seen": seen, "mu": mu, "mu_lowest": mu, "used": mu} | bound
        for place, day, seen, mu in ((1000.0, 0, 2, 0.05), (1100.0, 0, 3, 0.065), (1000.0, 1, 4, 0.12))
        for bound in ({"mu_lower": mu - 0.01},)
    ]
    far = {"place_m": 9000.0, "date": DATES[1], "seen": 1, "limited": 0, "mu": np.nan, "mu_lowest": np.nan}
    pd.DataFrame([*rows, one | far | {"used": 0.11, "mu_lower": 0.1}]).to_csv(path, index=False)
    return path


def test_a_low_spot_is_of_neighbouring_pieces_and_tells_how_often_it_was_seen(table: Path, tmp_path: Path) -> None:
    fleet = read_fleet([table, rail(tmp_path / "rail.csv")])
    assert fleet.by_piece
    (spot,) = low_spots(fleet.rail, 0.0726)
    assert (spot.from_m, spot.to_m, spot.lowest, spot.mu_lower) == pytest.approx((1000.0, 1200.0, 0.05, 0.04))
    assert (spot.seen, spot.limited, spot.dates, spot.low_dates, spot.newest) == (3 + 4, 2, 2, 1, DATES[0])
    assert low_spots(fleet.rail, 0.05) == []
    whole = over_dates(fleet.rail).set_index("place_m")
    assert whole.loc[1000.0, ["mu", "mu_lower"]].tolist() == pytest.approx([0.05, 0.04])
    assert np.isnan(whole.loc[9000.0, "mu"])
    assert whole.loc[9000.0, "mu_lower"] == 0.1


def test_without_a_map_each_braking_counts_along_its_whole_way(table: Path) -> None:
    fleet = read_fleet([table])
    assert not fleet.by_piece
    assert fleet.rail[fleet.rail["date"] == DATES[0]]["place_m"].tolist() == [1000.0, 1100.0, 1200.0]
    by_place = fleet.rail.groupby("place_m")["mu"].min()
    assert by_place.to_dict() == pytest.approx(
        {1000.0: 0.05, 1100.0: 0.05, 1200.0: 0.05, 1300.0: 0.12, 5000.0: np.nan, 5100.0: np.nan, 5200.0: np.nan},
        nan_ok=True,
    )
    falling = pd.DataFrame([braking("unit_7", 0, 1250.0, 0.05, place_end_m=1000.0)])
    assert spread(falling)["place_m"].tolist() == [1000.0, 1100.0, 1200.0]


def test_the_page_has_a_row_for_each_braking_and_says_how_low_where(
    table: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result.json"
    assert main([str(table), "--output", str(tmp_path / "report"), "--json", str(result)]) == 0
    told = json.loads(result.read_text(encoding="utf-8"))
    assert (told["brakings"], told["limited"]) == (3, 2)
    assert [(spot["from_m"], spot["to_m"], spot["low_dates"]) for spot in told["low_spots"]] == [(1000.0, 1300.0, 1)]
    assert "1000 to 1300 m: 0.0500, 1 of 2 dates" in capfd.readouterr().out
    page = Path(told["page"]).read_text(encoding="utf-8")
    assert "unit_8 &lt;b&gt;" in page
    assert "unit_8 <b>" not in page
    legend = re.findall(r'<p class="legend">(.*)</p>', page)[0]
    assert legend.count("</span> <span>") == legend.count("<span>") - 1 == 4, "Firefox breaks a line at a space alone"


def test_a_braking_of_two_tables_counts_once(table: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """As where the table of a month is given beside that of the year."""
    month = tmp_path / "month.parquet"
    pd.DataFrame([*BRAKINGS[:2], braking("unit_9", 2, 3000.0, 0.07)]).to_parquet(month, index=False)
    result = tmp_path / "result.json"
    assert main([str(table), str(month), "--output", str(tmp_path / "report"), "--json", str(result)]) == 0
    told = json.loads(result.read_text(encoding="utf-8"))
    assert (told["brakings"], told["limited"]) == (4, 3)
    assert capfd.readouterr().err.splitlines() == [
        f"report: runs/{train}: brakings that are there again: 1; each counts once: give them once"
        for train in ("unit_7", "unit_8 <b>")
    ]


@pytest.mark.parametrize("turned", [1, -1])
def test_a_table_without_any_braking_changes_nothing(turned: int, table: Path, tmp_path: Path) -> None:
    """As of a day on which no train braked."""
    empty = tmp_path / "empty.csv"
    pd.DataFrame(BRAKINGS).iloc[:0].to_csv(empty, index=False)
    fleet = read_fleet([table, empty][::turned])
    pd.testing.assert_frame_equal(fleet.rail, read_fleet([table]).rail)


def test_nothing_identified_is_said(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    table, empty = tmp_path / "brakings.csv", tmp_path / "rail.csv"
    pd.DataFrame([BRAKINGS[2]]).to_csv(table, index=False)
    pd.read_csv(rail(tmp_path / "full.csv")).iloc[:0].to_csv(empty, index=False)
    for tables in ([table], [table, empty]):
        assert main([*map(str, tables), "--output", str(tmp_path / "report")]) == 1
        assert "nothing is identified: the adhesion limited in no braking" in capfd.readouterr().err
    assert "None known: the adhesion limited in no braking." in (tmp_path / "report/report.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["brakings.csv", "run.mcap"], "give recordings, or tables of brakings, not both"),
        (["log.csv"], "log.csv: lacks the columns train, recording, t_ns"),
        (["rail.csv"], "tables = 0 of brakings, 1 maps"),
        (["none.csv"], "none.csv: is not there"),
        (["broken.parquet"], "broken.parquet: not readable"),
        (["broken.parquet"], "`import_csv` makes a recording of a log"),
        (["nothing.csv"], "hold no braking"),
        (["brakings.csv", "--low", "0"], "low = 0.0: give"),
        (["brakings.csv", "--set", "train.mass_kg=400000"], "--set train.mass_kg=400000: tables are shown as written"),
        (["brakings.csv", "--estimate"], "report: --estimate: tables are shown as written: leave it out"),
        (["brakings.csv", "--target", "0"], "--target 0.0: tables are shown as written: leave it out"),
    ],
)
def test_what_cannot_be_shown_is_said(
    given: list[str], said: str, table: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    rail(tmp_path / "rail.csv")
    (tmp_path / "log.csv").write_text("t,v\n1,2\n", encoding="utf-8")
    (tmp_path / "broken.parquet").write_bytes(b"nothing")
    pd.read_csv(table).iloc[:0].to_csv(tmp_path / "nothing.csv", index=False)
    paths = [str(tmp_path / each) if each.endswith((".csv", ".mcap", ".parquet")) else each for each in given]
    assert main([*paths, "--output", str(tmp_path / "report")]) == 2
    assert said in capfd.readouterr().err
