# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Kill, stop, flood and mislead the real processes of a line, and see whether the monitor says so and all recover.

    python test/chaos.py            # ten minutes, seed 1
    python test/chaos.py 1 7        # one minute, seed 7

Simulator, estimator, ATP monitor and recorder run as processes; this one kills them (-9), stops and continues them,
floods and flaps their topics and sets /clock, by a script that the seed makes. It ends with a table: *told*, time from
what makes the train's state unsafe to know until `atp/status` says EMERGENCY_BRAKE; *recovered*, time from its end
until the train is let go; *pause*, longest time between two `atp/status` of a monitor that lives. Then what recordings
lack of what was heard, and the growth of memory. Exit code 1 when something was silent, lost or unbounded.

Of every life of a publisher a recording must hold all that was published from the first to the last message that it has
of it: what lies between and is not there is *lost*. What lies before came while the recorder did not know of the
publisher yet, which each subscriber finds out for itself; nobody can record that. What lies behind was not saved when
the recorder was killed. Both times are told, and bounded.
"""

from __future__ import annotations

import math
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from start_stop import start

from adhesion_node.bag import BagReader
from adhesion_node.core.atp.supervision import Level
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns
from adhesion_node.wire.topic import Topic

TOLD_S, RECOVERED_S, PAUSE_S = 10.0, 120.0, 10.0
"""Longest times. A state is valid for 2 s, /clock may stand for 2 s, and this machine may be busy."""

STARTED_S = 300.0
"""Until the first supervised train: an estimator that has never run compiles its loops."""

FOUND_S, UNSAVED_S = 30.0, 10.0
"""Longest times until a recorder has begun and found a publisher, and from what it saved last until it is killed. That
is a second where it is given the processor."""

WARM_S, GROWTH_MB = 20.0, 40.0
"""Memory counts from so long after a start on, and may grow by so much."""

LONGEST_RUN_S = 150.0
"""Of a simulator: its scenario ends some time later."""

WATCHED = (topics.STATE, topics.ATP_STATUS)
"""Reliable topics, of which a recording must hold all that was sent."""

SIMULATED = ("--ros-args", "-p", "use_sim_time:=true")
FAR = ("-p", "target_position_m:=1000000.0", "-p", "target_speed_kmh:=0.0")


class Process:
    """A program of the package that may be killed and started again; what it says goes to a file."""

    def __init__(self, name: str, folder: Path, *arguments: str) -> None:
        self.name, self.arguments, self._folder, self._starts = name, arguments, folder, 0
        self.memory_mb: dict[int, list[float]] = defaultdict(list)
        self.begun_s: list[float] = []
        """When its lives began."""
        self.begin()

    def begin(self, *more: str) -> None:
        self._starts += 1
        self.begun_s.append(time.time())
        self.log = self._folder / f"{self.name}_{self._starts}.log"
        with self.log.open("w") as said:
            self.program = start(self.name, *self.arguments, *more, said=said)
        self.since_s = time.monotonic()

    def send(self, number: signal.Signals) -> None:
        self.program.send_signal(number)

    def kill(self) -> None:
        self.program.kill()
        self.program.wait()

    def end(self) -> str:
        """End as an operator would; say what was wrong with it."""
        self.send(signal.SIGCONT)
        self.send(signal.SIGINT)
        try:
            code = self.program.wait(30.0)
        except subprocess.TimeoutExpired:
            self.kill()
            return f"{self.name} did not end"
        return f"{self.name} ended with {code}" if code else ""

    @property
    def traceback(self) -> bool:
        return any("Traceback" in log.read_text() for log in self._folder.glob(f"{self.name}_*.log"))

    def measure(self) -> None:
        """Note the resident memory of a process that has found its size."""
        if self.program.poll() is None and time.monotonic() - self.since_s > WARM_S:
            status = Path(f"/proc/{self.program.pid}/status").read_text()
            size = next(line for line in status.splitlines() if line.startswith("VmRSS"))
            self.memory_mb[self.program.pid].append(int(size.split()[1]) / 1024.0)

    @property
    def grown_mb(self) -> float:
        """Most that one of its lives has grown by."""
        return max((max(sizes) - sizes[0] for sizes in self.memory_mb.values()), default=0.0)


Sent = dict[str, list[tuple[float, int]]]
"""What was heard: when it was published, and its stamp, by topic."""


class Recorded(NamedTuple):
    """A life of the recorder."""

    bag: Path
    begun_s: float
    until_s: float = math.inf


@dataclass
class Line:
    """The processes, and a node that listens to them and disturbs them."""

    folder: Path
    rng: random.Random
    seen: list[tuple[float, str]] = field(default_factory=list)
    """When a level was heard."""
    sent: Sent = field(default_factory=lambda: defaultdict(list))
    recorded: list[Recorded] = field(default_factory=list)
    epoch_s: float = 1000.0

    def __post_init__(self) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node

        from adhesion_node.nodes.ros import qos

        rclpy.init()
        self.qos, self.node = qos, Node("chaos")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        for topic in WATCHED:
            qos.subscribe(self.node, topic, self._receiver(topic))
        self.clock = qos.advertise(self.node, topics.CLOCK)
        self.simulator = Process(
            "simulator", self.folder, "--ros-args", "-p", "scenario:=long_braking", "-p", "exit_at_end:=false"
        )
        self.estimator = Process("estimator", self.folder, *SIMULATED)
        self.monitor = Process("atp_monitor", self.folder, *SIMULATED, *FAR)
        self.recorder = Process("recorder", self.folder, "--output", str(self._next_bag()))

    @property
    def processes(self) -> tuple[Process, ...]:
        return self.simulator, self.estimator, self.monitor, self.recorder

    def _receiver(self, topic: Topic) -> Callable[..., None]:
        def receive(message: Any, info: Mapping[str, int]) -> None:
            now_s = time.time()
            if stamp := stamp_ns(message.header):  # those of our own floods have none
                self.sent[topic.name].append((info["source_timestamp"] / 1e9, stamp))
            if topic is topics.ATP_STATUS:
                (status,) = message.status
                self.seen.append((now_s, next(pair.value for pair in status.values if pair.key == "level")))

        return receive

    def spin(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Listen for so long, or until something holds; say whether it does."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=min(left_s, 0.05))
            if until():
                return True
        return until()

    def heard(self, since_s: float, braked: bool) -> float | None:
        """When, after a time, a level was first heard that brakes, or that does not."""
        brake = Level.EMERGENCY_BRAKE.name
        return next((at_s for at_s, level in self.seen if at_s > since_s and (level == brake) == braked), None)

    def _next_bag(self) -> Path:
        self.recorded.append(Recorded(self.folder / f"bag_{len(self.recorded)}", time.time()))
        return self.recorded[-1].bag

    def begin_recorder(self) -> None:
        self.recorder.arguments = ("--output", str(self._next_bag()))
        self.recorder.begin()

    def kill_recorder(self) -> None:
        self.recorder.kill()
        self.recorded[-1] = self.recorded[-1]._replace(until_s=time.time())

    def again(self, by_s: float) -> None:
        """A simulator whose clock is ahead of the one before by so much."""
        self.epoch_s += by_s
        self.simulator.begin("-p", f"start_time_s:={self.epoch_s}")

    def flood(self, topic: Topic, message: Any, seconds: float, rate_hz: float) -> None:
        """Publish one message again and again, at such a rate at most."""
        output, end_s = self.qos.advertise(self.node, topic), time.monotonic() + seconds
        while time.monotonic() < end_s:
            output.publish(message)
            self.spin(1.0 / rate_hz)
        self.node.destroy_publisher(output)

    def flap(self, times: int) -> None:
        """Come and go as a publisher and as a subscriber."""
        for _ in range(times):
            ends = [self.qos.advertise(self.node, topic) for topic in (topics.POSITION, topics.STATE)]
            listener = self.qos.subscribe(self.node, topics.BRAKING_CURVE, lambda _: None)
            self.spin(0.1)
            self.node.destroy_subscription(listener)
            for end in ends:
                self.node.destroy_publisher(end)

    def set_clock(self, by_s: float) -> None:
        """Another time on /clock, some times, between those of the simulator."""
        from adhesion_node.nodes.ros.types import new

        stamps = self.sent[topics.STATE.name]
        at_ns = max(stamps[-1][1] + round(by_s * 1e9), 0)
        for _ in range(20):
            self.clock.publish(topics.CLOCK.build(new, at_ns))
            self.spin(0.02)

    def message(self, topic: Topic) -> Any:
        """One without a number in it."""
        from adhesion_node.nodes.ros.types import message_class

        message = message_class(topic.type)()
        message.header.frame_id = "track"
        message.pose.pose.position.x = float("nan")
        return message


class Deed(NamedTuple):
    """What is done and undone. `unsafe`: the monitor has to say so, `mute`: it cannot."""

    do: Callable[[Line], None]
    undo: Callable[[Line], None] = lambda line: None
    unsafe: bool = True
    mute: bool = False


def stop(name: str) -> Callable[[Line], None]:
    return lambda line: getattr(line, name).send(signal.SIGSTOP)


def go_on(name: str) -> Callable[[Line], None]:
    return lambda line: getattr(line, name).send(signal.SIGCONT)


DEEDS = {
    "kill -9 estimator": Deed(lambda line: line.estimator.kill(), lambda line: line.estimator.begin()),
    "stop estimator": Deed(stop("estimator"), go_on("estimator")),
    "kill -9 simulator, clock on by 1000 s": Deed(lambda line: line.simulator.kill(), lambda line: line.again(1000.0)),
    "kill -9 simulator, clock back by 300 s": Deed(lambda line: line.simulator.kill(), lambda line: line.again(-300.0)),
    "stop simulator, and /clock": Deed(stop("simulator"), go_on("simulator")),
    "kill -9 monitor": Deed(lambda line: line.monitor.kill(), lambda line: line.monitor.begin(), mute=True),
    "stop monitor": Deed(stop("monitor"), go_on("monitor"), mute=True),
    "kill -9 recorder": Deed(Line.kill_recorder, Line.begin_recorder, unsafe=False),
    "stop recorder": Deed(stop("recorder"), go_on("recorder"), unsafe=False),
    "another /clock, 50 s back": Deed(lambda line: line.set_clock(-50.0)),
    "another /clock, 50 s on": Deed(lambda line: line.set_clock(50.0)),
    "500 positions/s, not finite": Deed(
        lambda line: line.flood(topics.POSITION, line.message(topics.POSITION), 3.0, 500.0), unsafe=False
    ),
    "200 states/s, not finite": Deed(lambda line: line.flood(topics.STATE, line.message(topics.STATE), 3.0, 200.0)),
    "publishers come and go": Deed(lambda line: line.flap(20), unsafe=False),
}


class Done(NamedTuple):
    """What came of a deed, s; None where it was not to be."""

    name: str
    told_s: float | None
    recovered_s: float
    pause_s: float | None
    fault: str


def perform(line: Line, name: str) -> Done:
    """Do and undo, and listen to what the monitor says."""
    deed, faults = DEEDS[name], []
    begun_s = time.time()
    deed.do(line)
    told_s = None
    if deed.unsafe and not deed.mute:
        line.spin(TOLD_S, lambda: line.heard(begun_s, True) is not None)
        if (at_s := line.heard(begun_s, True)) is None:
            faults.append("silent: no EMERGENCY_BRAKE")
        else:
            told_s = at_s - begun_s
    line.spin(line.rng.uniform(0.5, 3.0))
    undone_s = time.time()
    deed.undo(line)
    if deed.mute:
        line.spin(RECOVERED_S, lambda: line.seen[-1][0] > undone_s + 0.5)
    line.spin(RECOVERED_S, lambda: line.heard(undone_s, False) is not None)
    free_s = line.heard(undone_s, False)
    if free_s is None:
        faults.append("never recovered")
    line.spin(line.rng.uniform(1.0, 3.0))
    pause_s = None
    if not deed.mute:
        times = [at_s for at_s, _ in line.seen if at_s >= begun_s - PAUSE_S]
        pause_s = max((later - one for one, later in pairwise(times)), default=float("inf"))
        if pause_s > PAUSE_S:
            faults.append(f"silent for {pause_s:.1f} s")
    return Done(name, told_s, (free_s or time.time()) - undone_s, pause_s, "; ".join(faults))


def script(rng: random.Random) -> Iterator[str]:
    """All deeds in turn, in another order each time."""
    while True:
        yield from rng.sample(sorted(DEEDS), len(DEEDS))


def run(line: Line, minutes: float) -> list[Done]:
    """Go through the script for so long."""
    if not line.spin(STARTED_S, lambda: line.heard(0.0, False) is not None):
        return [Done("start", None, STARTED_S, None, "no supervised train")]
    done: list[Done] = []
    end_s = time.monotonic() + 60.0 * minutes
    for due in script(line.rng):
        if time.monotonic() > end_s:
            return done
        old = time.monotonic() - line.simulator.since_s > LONGEST_RUN_S
        done.append(perform(line, "kill -9 simulator, clock on by 1000 s" if old else due))
        print(f"{done[-1]}", file=sys.stderr)
        for process in line.processes:
            process.measure()
    return done


class Kept(NamedTuple):
    """What a recording holds of a life of a publisher."""

    topic: str
    bag: str
    asked: int
    """Messages that were heard and that it must hold."""
    lost_s: tuple[float, ...] = ()
    """When those were published that it lacks, before its last one."""
    found_s: float = 0.0
    """Until it held the first, from when the publisher was first heard and the recorder started."""
    unsaved_s: float = 0.0
    """From its last until the last that was heard of that life while the recorder lived."""

    @property
    def faults(self) -> list[str]:
        """What is wrong with it."""
        found = [f"lost: {self.topic}, {before_s:.2f} s before the last of {self.bag}" for before_s in self.lost_s]
        if self.found_s > FOUND_S:
            found.append(f"{self.topic}: {self.bag} began {self.found_s:.1f} s late")
        if self.unsaved_s > UNSAVED_S:
            found.append(f"{self.topic}: {self.bag} lacks the last {self.unsaved_s:.1f} s")
        return found


def kept(sent: Sent, lives: Mapping[str, Sequence[float]], recordings: Iterable[Recorded]) -> Iterator[Kept]:
    """Yield what the recordings hold of each life of the publishers, which began at `lives`, by topic."""
    for recorded in recordings:
        stamps: dict[str, set[int]] = defaultdict(set)
        with BagReader(recorded.bag) as bag:
            for record in bag.messages():
                if (name := record.topic.lstrip("/")) in sent:
                    stamps[name].add(stamp_ns(record.message.header))
        for name, began in lives.items():
            for from_s, to_s in pairwise([*began, math.inf]):
                heard = [one for one in sorted(sent[name]) if from_s <= one[0] < min(to_s, recorded.until_s)]
                if heard and heard[-1][0] > recorded.begun_s:
                    yield _kept(name, recorded, heard, stamps[name])


def _kept(name: str, recorded: Recorded, heard: Sequence[tuple[float, int]], stamps: set[int]) -> Kept:
    since_s, until_s = max(heard[0][0], recorded.begun_s), heard[-1][0]
    held_s = [at_s for at_s, stamp in heard if stamp in stamps]
    if not held_s:
        return Kept(name, recorded.bag.name, 0, (), until_s - since_s)
    first_s, last_s = held_s[0], held_s[-1]
    wanted = [one for one in heard if first_s <= one[0] <= last_s]
    lost_s = tuple(last_s - at_s for at_s, stamp in wanted if stamp not in stamps)
    return Kept(name, recorded.bag.name, len(wanted), lost_s, max(first_s - since_s, 0.0), until_s - last_s)


def table(done: list[Done]) -> Iterator[str]:
    """A line for each kind of deed: how often, and the longest times."""
    yield f"{'':<42}{'times':>6}{'told s':>8}{'recovered s':>13}{'pause s':>9}"
    for name in DEEDS:
        rows = [one for one in done if one.name == name]
        if rows:
            told, pauses = [one.told_s for one in rows], [one.pause_s for one in rows]
            cells = [
                f"{max(times):.1f}" if (times := [s for s in all_s if s is not None]) else "-"
                for all_s in (told, pauses)
            ]
            longest = max(one.recovered_s for one in rows)
            yield f"{name:<42}{len(rows):>6}{cells[0]:>8}{longest:>13.1f}{cells[1]:>9}"


def main(arguments: list[str]) -> int:
    """Run the script, print the table and what was wrong."""
    minutes = float(arguments[0]) if arguments else 10.0
    seed = int(arguments[1]) if len(arguments) > 1 else 1
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ.setdefault("ROS_DOMAIN_ID", "102")
    with tempfile.TemporaryDirectory() as name:
        os.environ.setdefault("ROS_LOG_DIR", name)
        line = Line(Path(name), random.Random(seed))
        try:
            done = run(line, minutes)
            faults = [f"{one.name}: {one.fault}" for one in done if one.fault]
            faults += filter(None, (process.end() for process in line.processes))
        finally:
            for process in line.processes:
                process.kill()
        faults += [f"{process.name}: a traceback" for process in line.processes if process.traceback]
        lives = {topics.STATE.name: line.estimator.begun_s, topics.ATP_STATUS.name: line.monitor.begun_s}
        held = list(kept(line.sent, lives, line.recorded))
        grown = {process.name: process.grown_mb for process in line.processes}
    faults += [fault for one in held for fault in one.faults]
    asked, missing = sum(one.asked for one in held), sum(len(one.lost_s) for one in held)
    faults += [] if asked else ["nothing was recorded"]
    faults += [f"{name} grew by {mb:.0f} MB" for name, mb in grown.items() if mb > GROWTH_MB]
    print(f"seed {seed}, {minutes:g} minutes, {len(done)} deeds")
    print("\n".join(table(done)))
    found_s = max((one.found_s for one in held), default=0.0)
    unsaved_s = max((one.unsaved_s for one in held), default=0.0)
    print(f"lost: {missing} of {asked} messages in {len(line.recorded)} recordings")
    print(f"until a recorder found a publisher: {found_s:.1f} s; not saved before it was killed: {unsaved_s:.1f} s")
    print("grown by, MB: " + ", ".join(f"{name} {mb:.1f}" for name, mb in grown.items()))
    print("\n".join(faults) or "nothing silent, lost or unbounded")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
