"""A preCICE participant as the structure of a rockfall run: force goes to it, its motion comes back.

The run is an implicit coupling of preCICE whose iterations are the solves of the coupler. Nobody knows at a solve whether it will be
the accepted one, so each is an iteration that does not converge: the datum `Iteration`, on which the one convergence measure
stands, is another number each time. A commit is one more iteration with the same force and the same number: it converges, and
shows how well the participant repeats the window.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from rockfall import Fault, Field, Mesh, Plan, Ready, Structure, Window

from .names import Names, named
from .participant import Participant

ITERATION = "Iteration"
"""What says to preCICE whether a window is over."""


class StandIn(Structure):
    """The structure."""

    # What it has done is in the other participant.
    goes_on = False

    def __init__(self, names: Names, mesh: Mesh, start: Optional[str], repeats: float):
        found = next(named(names.writes, "Force"), None)
        if found is None:
            raise Fault(f"{names.participant} writes no Force", "input")
        if names.scheme != "serial-implicit" or names.order[0] != names.participant:
            raise Fault(f"{names.participant} must be the first participant of a serial-implicit scheme", "input")
        for data, word in ((names.writes, ITERATION), (names.reads, "Displacement"), (names.reads, "Velocity")):
            if not any(named(data, word)):
                raise Fault(f"{names.participant} does not exchange {word}", "input")
        self.names, self.mesh, self.start_command = names, mesh, start
        self.force_data, of_end = found
        self.motion_data = [next(named(names.reads, word))[0] for word in ("Displacement", "Velocity")]
        self.program = f"preCICE participant {names.other}"
        self.repeats = repeats
        self.takes = [Field("force", "at_ends" if of_end else "means")]
        self.child: Optional[Started] = None
        self.it: Optional[Participant] = None

    def prepare(self, plan: Plan) -> Ready:
        names = self.names
        if names.window > 0.0 and abs(names.window - plan.window) > 1e-9 * plan.window:
            what = f"coupling.time_window is {plan.window} s, <time-window-size> of preCICE {names.window} s"
            raise Fault(what, "input")
        if names.end_time < plan.end_time * (1.0 - 1e-9):
            raise Fault(f"end_time is {plan.end_time} s, <max-time> of preCICE {names.end_time} s", "input")
        self.plan = plan
        if self.start_command is not None:
            self.child = Started(self.start_command)
        self.it = Participant(names, self.mesh)
        self.it.initialize()
        nodes = len(np.asarray(self.mesh.coordinates))
        self.number, self.force = np.zeros(nodes), np.zeros((nodes, 3))
        self.length: Optional[float] = None
        """Length of the window at hand [s], which preCICE cannot change."""
        self.answer = self.motion(0.0)
        self.differs, self.windows, self.iterations = 0.0, 0, 0
        return Ready(self.mesh)

    def start(self, state: Any, gives: Any, gauges: Any) -> None:
        gives[0][-1], gives[1][-1] = self.answer

    def motion(self, at: float) -> List[Any]:
        """Displacement and velocity at this time from the start of the window [s]."""
        assert self.it is not None, "prepared before the first window"
        return [self.it.read(data, at) for data in self.motion_data]

    def iterate(self, length: float) -> bool:
        """One iteration with the force and the number at hand; whether the window has converged."""
        it = self.it
        assert it is not None, "prepared before the first window"
        it.requires_writing_checkpoint()
        it.write(self.force_data, self.force)
        it.write(ITERATION, self.number)
        # Of lengths that differ by rounding, preCICE takes its own alone.
        whole = it.get_max_time_step_size()
        it.advance(whole if abs(whole - length) < 1e-9 * length else length)
        self.iterations += 1
        return not it.requires_reading_checkpoint()

    def fits(self, window: Window) -> bool:
        """Whether preCICE can solve a window of this length now."""
        if self.length is not None:
            return self.length == window.length
        near = 1e-9 * self.plan.window
        of_end = abs(window.start + window.length - self.plan.end_time) < near
        return of_end or abs(window.length - self.plan.window) < near

    def solve(self, state: Any, window: Window, takes: Any, gives: Any, gauges: Any) -> Any:
        if not self.fits(window):
            raise Fault(
                f"a window of {window.length} s: preCICE solves those of {self.plan.window} s, the last one as long as it must be, and "
                "cannot change the length of one that it has begun",
                "window",
            )
        self.length = window.length
        self.force[:] = takes[0][-1]
        self.number += 1.0
        if self.iterate(window.length):
            raise Fault(
                f"preCICE accepts the window at t = {window.start} s before the coupler does: its scheme needs one "
                f'<absolute-convergence-measure data="{ITERATION}" limit="0.5"> and a <max-iterations> that is never reached'
            )
        self.answer = self.motion(window.length)
        gives[0][-1], gives[1][-1] = self.answer
        return None

    def commit(self, state: Any) -> None:
        if self.length is None:
            raise Fault("a commit without a solve")
        length, self.length = self.length, None
        if not self.iterate(length):
            raise Fault("preCICE goes on with a window that the coupler has accepted")
        for again, solved in zip(self.motion(0.0), self.answer):
            largest = max(np.abs(solved).max(initial=0.0), sys.float_info.min)
            self.differs = max(self.differs, float(np.abs(again - solved).max(initial=0.0) / largest))
        self.windows += 1

    def finish(self, state: Any) -> Dict[str, Union[Tuple[float, str], int]]:
        if self.it is not None and not self.it.is_coupling_ongoing():
            self.it.finalize()
            if self.child is not None:
                self.child.wait()
        return {
            "participant_repeats_to": (self.differs, "1"),
            "precice_windows": self.windows,
            "precice_iterations": self.iterations,
        }

    def close(self) -> None:
        """End what has been started, if the run ended before its time."""
        self.it = None
        if self.child is not None:
            self.child.end()


# Runs the command "$1" and, where that fails, ends the adapter: preCICE waits for ever for a participant that never comes, and Python
# cannot look after it meanwhile. preCICE gets a second to say itself that its partner is gone.
WATCH = """sh -c "$1" >/dev/null
code=$?
[ $code = 0 ] && exit
sleep 1
echo "error: the participant has ended with exit code $code: $1" >&2
kill -KILL $PPID
"""


class Started:
    """The other participant, where this program has started it."""

    def __init__(self, command: str):
        # A group of its own, so that all of it can be ended.
        self.shell = subprocess.Popen(["sh", "-c", WATCH, "sh", command], start_new_session=True)

    def wait(self) -> None:
        """Until it ends by itself."""
        self.shell.wait()

    def end(self) -> None:
        if self.shell.poll() is None:
            os.killpg(self.shell.pid, signal.SIGTERM)
            self.shell.wait()
