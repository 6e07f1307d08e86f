# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`bench`: speed, ours beside its peers in one run."""

import argparse
import os
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

from ..command.checks import at_least
from ..command.options import DONE, help_texts, json_option, report, run_tool
from ..study.trial.figures import add_figure_options, figures_of
from . import against, growth, step
from .amounts import add_amounts, put_in_amounts, refuse_unless
from .peers import gaussian, normal, particle

PURPOSE = "Times the estimator beside its peers in one run, and prints versions and settings with the times."

PEERS = ("filterpy", "particles", "threadpoolctl", "gtsam")
"""Of the extra `bench`."""

PARTICLE_STEPS, PARTICLES = 100, 200
GAUSSIAN_STEPS = 50
GROWTH_ROUNDS, AGAINST_ROUNDS = 3, 5

Options = argparse.Namespace
Section = Mapping[str, Any]


def _particle(options: Options) -> Section:
    rows = particle.compare(PARTICLE_STEPS, PARTICLES, options.rounds, options.seed)
    return {"settings": {"steps": PARTICLE_STEPS, "particles": PARTICLES}, "rows": rows}


def _gaussian(options: Options) -> Section:
    rows = gaussian.compare(GAUSSIAN_STEPS, options.rounds, options.seed)
    return {"settings": {"steps": GAUSSIAN_STEPS}, "rows": rows}


def _normal(options: Options) -> Section:
    rows = normal.compare(GAUSSIAN_STEPS, options.rounds, options.seed)
    return {"settings": {"steps": GAUSSIAN_STEPS}, "rows": rows}


def _step(options: Options) -> Section:
    ways = [(rate_hz, estimate_s) for estimate_s in (step.CONFIG.estimate_s, 0.0) for rate_hz in (10.0, 100.0)]
    rows = [step.latency(rate_hz, options.journeys, options.seed, estimate_s) for rate_hz, estimate_s in ways]
    return {"settings": {"window": step.CONFIG.window, "step": step.CONFIG.step}, "rows": rows}


def _memory(options: Options) -> Section:
    return {"settings": {"rate_hz": 10.0}, "rows": [step.memory(options.minutes, 10.0, options.seed)]}


def _trains(options: Options) -> Section:
    from . import trains  # only here: no other benchmark needs ROS

    rows = [trains.share(one, options.trains, 10.0, options.seconds, options.seed) for one in trains.EXECUTORS]
    return {"settings": {"rate_hz": 10.0, "seconds": options.seconds}, "rows": rows}


def _recording(options: Options) -> Section:
    from . import recording  # what it reads and writes needs more than a train does

    return {"settings": {"rate_hz": 10.0}, "rows": [recording.replay(options.hours, 10.0, options.seed)]}


def _report(options: Options) -> Section:
    from . import recording  # see above

    return {"settings": {"rate_hz": 10.0}, "rows": recording.report(options.hours, 10.0, options.seed)}


def _growth(options: Options) -> Section:
    rows = growth.compare(GROWTH_ROUNDS, options.seed)
    if (figures := figures_of(options)) is not None:
        from .growth_figure import draw  # no other benchmark draws

        draw(rows, figures.place("growth"))
    return {"settings": {"rounds": GROWTH_ROUNDS}, "rows": rows}


def _against(options: Options) -> Section:
    rows = against.compare(options.against, AGAINST_ROUNDS, 10.0, options.seed)
    return {"settings": {"rate_hz": 10.0}, "rows": rows}


BENCHMARKS: Mapping[str, tuple[Callable[[Options], Section], tuple[str, ...], str]] = {
    "particle": (_particle, PEERS[1:3], "particle E and M step of one window"),
    "gaussian": (_gaussian, (PEERS[0], PEERS[2]), "Gaussian update of one window, EM converged"),
    "normal": (_normal, PEERS[2:], "one normal equation with its linearisation"),
    "step": (_step, (), "a sample through the estimator in steady braking"),
    "memory": (_memory, (), "resident memory over a long journey"),
    "trains": (_trains, ("rclpy",), "braking trains in one process, an estimator each on one executor, through DDS"),
    "recording": (_recording, (), "a recording through the offline replay"),
    "report": (_report, (), "the report of that recording, with the estimator's results and of the sensors alone"),
    "growth": (_growth, (), "how the cost grows"),
    "against": (_against, (), "the default method beside that of another revision, under the brake"),
}
"""What runs it, the peers it needs, and its title."""


def main(args: Sequence[str] | None = None) -> int:
    """Run the benchmarks and print their tables."""
    texts = help_texts(
        PURPOSE,
        "bench",
        "bench particle gaussian --rounds 20",
        "bench step memory --json -",
        "bench growth --figures .",
        "bench trains",
        "bench --against HEAD~10",
    )
    parser = argparse.ArgumentParser("bench", parents=[json_option()], **texts)
    add = parser.add_argument
    add("names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHMARKS)} (default: all)")
    add_amounts(parser)
    add("--against", metavar="REV", help="a revision of this clone, for the benchmark against, which is then run, too")
    add_figure_options(parser, "how the cost grows")
    add("--seed", type=int, default=1, help="of window and noise")
    return run_tool(parser, _run, args)


def _run(options: Options) -> int:
    names = _names(options)
    put_in_amounts(options, names)
    refuse_unless(names, ["growth"], options, "figures")
    figures_of(options)
    at_least(options, seed=0)
    missing = sorted({peer for name in names for peer in BENCHMARKS[name][1] if find_spec(peer) is None})
    if missing:
        raise ValueError(f"{', '.join(missing)} not installed: pip install '.[ros,bench]'")
    # All on one thread: the arrays are too small for more, which would only make the times depend on the neighbours.
    limited = import_module("threadpoolctl").threadpool_limits(1) if find_spec("threadpoolctl") else nullcontext()
    with limited:
        sections = {name: dict(BENCHMARKS[name][0](options)) for name in names}
    result = {"versions": versions(), "seed": options.seed, **sections}
    report(options.json, result, "\n".join(_lines(result)))
    return DONE


def _names(options: Options) -> Sequence[str]:
    """The benchmarks that are asked for."""
    for name in options.names:
        if name not in BENCHMARKS:
            raise ValueError(f"benchmark {name!r}: choose of {', '.join(BENCHMARKS)}")
    if "against" in options.names and not options.against:
        raise ValueError("benchmark against: name the revision, --against REV")
    if options.against and "against" not in options.names:
        return [*options.names, "against"]
    return options.names or [name for name in BENCHMARKS if name != "against"]


def versions() -> dict[str, str]:
    """Versions of what is timed and of what it runs on."""
    installed = {name: version(name) for name in ("numpy", "scipy", *PEERS) if find_spec(name)}
    return {"python": platform.python_version(), **installed, "cores": str(os.cpu_count())}


def _lines(result: Mapping[str, Any]) -> Iterator[str]:
    yield ", ".join(f"{name} {value}" for name, value in result["versions"].items())
    for name, (_, _, title) in BENCHMARKS.items():
        if name in result:
            settings = ", ".join(f"{key} {value}" for key, value in result[name]["settings"].items())
            yield f"\n{title} ({settings})"
            yield from _table(result[name]["rows"])


def _table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Columns as wide as their widest cell."""
    told = ([f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()] for row in rows)
    cells = [list(rows[0]), *told]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for line in cells:
        yield "  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True))


if __name__ == "__main__":
    raise SystemExit(main())
