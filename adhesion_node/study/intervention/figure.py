# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The supervision limits over the distance, as ETCS draws them, by the lower bound and by the fixed worst case."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from sim_node.train.scenario import Rail

from ...core.atp import limits as etcs
from ...core.atp.config import SupervisionConfig
from ...core.physics import braking
from ...core.physics.braking import BrakingCurve
from ...core.physics.train import CRH3, KMH, Array
from ...report.picture import BLACK, BLUE, GREY, ORANGE, SHADES
from ...report.run import FIXED_MU, Run
from ..trial.drawing import PAGE_IN, picture

NAMES = {
    "ebi": ("emergency brake intervention (EBI)", "#b00020", "-"),
    "sbi": ("service brake intervention (SBI)", ORANGE, "-"),
    "warning": ("warning (W)", ORANGE, "--"),
    "permitted": ("permitted speed (P)", BLACK, "-"),
    "indication": ("indication (I)", GREY, "-"),
}
"""Label, colour and line of each limit."""


def draw(config: SupervisionConfig, safe: BrakingCurve, fixed: BrakingCurve, title: str, path: Path) -> None:
    """Draw the limits of `safe` and the emergency intervention of `fixed` into a PNG, or what the ending says.

    The line speed is that of the beginning of `safe`.
    """
    config = replace(config, line_speed_kmh=float(safe.speed_mps[0]) / KMH)
    reach = float(etcs.distances(config, safe, safe.speed_mps[:1]).indication[0])
    ahead = np.linspace(1.1 * reach, -0.1 * reach, 600)
    with picture(path, title, (PAGE_IN, 3.6)) as axis:
        for name, limit in etcs.speeds(config, safe, ahead)._asdict().items():
            label, color, style = NAMES[name]
            axis.plot(ahead, limit / KMH, color=color, ls=style, label=label)
        by_fixed = etcs.speeds(config, fixed, ahead).ebi
        axis.plot(ahead, by_fixed / KMH, color=BLUE, ls=":", label="EBI by the fixed worst case")
        axis.axvline(0.0, color=GREY, lw=0.8)
        axis.annotate(" target", (0.0, 0.02), xycoords=("data", "axes fraction"), color="0.25")
        axis.set(xlabel="distance to the target, m", ylabel="speed, km/h", xlim=(ahead[0], ahead[-1]))
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="lower left", fontsize="small")


def draw_changing(run: Run, laws: Rail, patch: tuple[float, float], target: tuple[float, float], path: Path) -> None:
    """Draw the speed of a run on a rail that changes, and where the emergency brake must come to keep a target.

    `laws` gives the true adhesion at a place and speed, `patch` its worse stretch, m; `target` is a place, m, and a
    speed, m/s. What must come by the true rail is integrated back from the target.
    """
    place_m, target_mps = target
    config = SupervisionConfig(target_position_m=place_m, target_speed_kmh=target_mps / KMH)
    place, speed = run.way
    fixed = braking.curve(CRH3, float(speed.values.max()) + 20.0, FIXED_MU)
    way = np.linspace(place.values[0], place_m, 400)
    by_fixed = etcs.speeds(config, fixed, place_m - way).ebi
    known = np.array(
        [
            (curve.position_m[0], etcs.speeds(config, curve.braking, place_m - curve.position_m[:1]).ebi[0])
            for curve in run.safe.kept
            if curve.position_m[0] < place_m
        ]
    )
    true = _true_limit(laws, way, target_mps)
    with picture(
        path, "Where the emergency brake must come before a target, on a rail that changes", (PAGE_IN, 3.4)
    ) as axis:
        axis.axvspan(*patch, color=SHADES["ADHESION_LIMITED"], lw=0)
        axis.annotate("leaves", (np.mean(patch), 0.04), xycoords=("data", "axes fraction"), ha="center", color="0.25")
        axis.plot(place.values, speed.values / KMH, color=BLACK, lw=2, label="the train, full brake")
        axis.plot(way, by_fixed / KMH, color=GREY, ls=":", lw=2, label=f"limit by the fixed worst case {FIXED_MU}")
        axis.plot(
            known[:, 0], known[:, 1] / KMH, color=BLUE, ls="--", label="limit by the identified adhesion, at least"
        )
        axis.plot(way, true / KMH, color=ORANGE, label="full brake on the true rail, known to nobody")
        axis.plot(place_m, target_mps / KMH, "v", color=BLACK, ms=6)
        axis.set(xlabel="position, m", ylabel="speed, km/h", ylim=(0.0, None))
        axis.legend(loc="lower left")


def _true_limit(laws: Rail, way_m: Array, target_mps: float) -> Array:
    """Speed, m/s, at rising places from which a full brake on the true rail gives the target speed at the last one."""
    speeds, full = [target_mps], CRH3.specific_brake(CRH3.full_pressure_pa)
    for step_m, place_m in zip(np.diff(way_m)[::-1], way_m[::-1], strict=False):
        speed = speeds[-1]
        mu, resistance = laws.mu(float(place_m), speed), CRH3.specific_resistance(np.asarray(speed))
        speeds.append(float(np.sqrt(speed**2 + 2.0 * step_m * CRH3.deceleration(mu, full, resistance))))
    return np.array(speeds[::-1])
