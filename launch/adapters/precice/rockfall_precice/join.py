"""A solver of rockfall's contract as a participant of a preCICE run."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from rockfall import Fault, Field, Gauge, Host, Mesh, Window

from .names import Names, named
from .participant import Participant, field, mesh_of, motion

# What data of preCICE are, by how their names begin.
WORDS = {"Force": "force", "Displacement": "displacement", "Velocity": "velocity"}


class Read(NamedTuple):
    """Numbers of a request that are read from data of preCICE."""

    data: str
    at_end: bool
    """Whether at the window's end, or at its start."""
    to: Any
    """The numbers, (nodes, components)."""


class Write(NamedTuple):
    """Numbers of an answer that are written to data of preCICE."""

    data: str
    of: Any
    """The numbers, (nodes, components)."""


def join(names: Names, structure: str, role: str, scene: Path, out: Path, timeout: float, command: Sequence[str]) -> None:
    """Let the solver `command` take part until the coupling is over."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Fault(f"--out {out}: {error.strerror}", "input") from None
    partner = mesh_of(structure, scene, timeout) if role == "dem" else None
    with Host(command, role, scene, out, timeout) as solver:
        if names.is_implicit and solver.repeats is None:
            raise Fault(f"{solver.program} cannot repeat a window: {names.scheme} is not for it", "input")
        takes, gives = plan(names, solver, partner)
        # Where the first participant says how long windows are, the longest one may last until the end.
        mesh = solver.prepare(names.end_time, names.window if names.window > 0.0 else names.end_time, takes, gives, partner)
        reads, writes = reads_of(names, solver, takes), writes_of(names, solver, gives)
        if not reads or not writes:
            raise Fault(
                f"{names.participant} reads {names.reads} and writes {names.writes}: a contact solver reads Displacement [and Velocity] and "
                "writes Force, a structure the reverse",
                "input",
            )
        it = Participant(names, mesh)
        record = Record(solver.gauges)
        commit_due = couple(it, solver, reads, writes, role == "dem" and names.goes_ahead, takes, record)
        it.finalize()
        record.write(out, names, solver.program, *solver.finish(commit_due))


def plan(names: Names, solver: Host, partner: Optional[Mesh]) -> Tuple[List[Field], List[Field]]:
    """What crosses: of what the solver can, what the configuration names."""
    both = ("means", "at_ends")
    if partner is None:
        return [of for sampling in both for of in field(solver.can_take, "force", sampling)], motion(solver)
    takes = field(solver.can_take, "displacement", "from_start")
    if any(named(names.reads, "Velocity")):
        takes += field(solver.can_take, "velocity", "from_start")
    return takes, [of for sampling in both for of in field(solver.can_give, "force", sampling)]


def reads_of(names: Names, solver: Host, takes: Sequence[Field]) -> List[Read]:
    """Where what is read goes. A structure that takes force at the window's end gets the data whose name says that, or else what there is."""
    reads = []
    for of, numbers in zip(takes, solver.takes):
        assert numbers is not None, "every planned field has its place"
        word = next(word for word, name in WORDS.items() if name == of.name)
        found = list(named(names.reads, word))
        if of.sampling == "from_start":
            reads += [Read(data, at_end, numbers[int(at_end)]) for data, _ in found[:1] for at_end in (False, True)]
        else:
            found.sort(key=lambda data: data[1] != (of.sampling == "at_ends"))
            reads += [Read(data, True, numbers[-1]) for data, _ in found[:1]]
    return reads


def writes_of(names: Names, solver: Host, gives: Sequence[Field]) -> List[Write]:
    """Which numbers of an answer are written to which data."""
    given = {(of.name, of.sampling): numbers for of, numbers in zip(gives, solver.gives)}
    writes = []
    for word, name in WORDS.items():
        for data, of_end in named(names.writes, word):
            sampling = "means" if name == "force" and not of_end else "at_ends"
            numbers = given.get((name, sampling))
            if numbers is not None:
                writes.append(Write(data, numbers[-1]))
    return writes


def couple(
    it: Participant, solver: Host, reads: List[Read], writes: List[Write], ahead: bool, takes: Sequence[Field], record: Record
) -> bool:
    """Window after window until the coupling is over; whether the last one is still to be committed."""

    def write() -> None:
        for one in writes:
            it.write(one.data, one.of)

    if it.requires_initial_data():
        write()
    it.initialize()
    number, iteration, commit_due = 1, 1, False
    # Times are products of whole numbers with a length, from where that length was another one.
    since, count, usual = 0.0, 0, 0.0
    while it.is_coupling_ongoing():
        # The committed state of the solver is the checkpoint; it is written with the first request of a window.
        it.requires_writing_checkpoint()
        length = it.get_max_time_step_size()
        for one in reads:
            one.to[:] = it.read(one.data, length if one.at_end else 0.0)
        if ahead:
            extrapolate(dict(zip((of.name for of in takes), solver.takes)), length)
        if abs(length - usual) > 1e-9 * length:
            since, count, usual = since + count * usual, 0, length
        start = since + count * usual
        solver.solve(Window(number, iteration, start, length), commit_due)
        commit_due = False
        write()
        it.advance(length)
        if it.requires_reading_checkpoint():
            iteration += 1
        else:
            record.accept(start + length, iteration, solver.gauge_values)
            number, iteration, commit_due, count = number + 1, 1, True, count + 1
    record.seconds = time.monotonic() - record.began
    return commit_due


def extrapolate(takes: Dict[str, Any], length: float) -> None:
    """In an explicit scheme whoever goes ahead does not know how the net moves in the window: it goes on with its velocity, as in the
    weak scheme of the coupler."""
    if "displacement" in takes and "velocity" in takes:
        takes["displacement"][1] += length * takes["velocity"][0]


class Record:
    """What is kept of a run."""

    def __init__(self, gauges: Sequence[Gauge]):
        self.columns = [f"{gauge.name}_{gauge.unit.replace('/', '_per_')}" for gauge in gauges]
        self.rows = [",".join(["time_s", "iterations", *self.columns])]
        self.ranges = np.tile([math.inf, -math.inf], (len(gauges), 1))
        self.iterations = 0
        self.began, self.seconds = time.monotonic(), 0.0

    def accept(self, at: float, iterations: int, numbers: Any) -> None:
        """A window that ended at this time [s], with three numbers for each gauge."""
        self.iterations += iterations
        self.rows.append(",".join([repr(at), str(iterations), *(repr(float(value)) for value in numbers[:, 0])]))
        np.minimum(self.ranges[:, 0], numbers[:, 1], out=self.ranges[:, 0])
        np.maximum(self.ranges[:, 1], numbers[:, 2], out=self.ranges[:, 1])

    def write(self, out: Path, names: Names, program: str, measures: Dict[str, Tuple[Any, ...]], cpu_seconds: float) -> None:
        """history.csv and summary.json."""
        report = {
            "participant": names.participant,
            "scheme": names.scheme,
            "solver": program,
            "windows": len(self.rows) - 1,
            "iterations": self.iterations,
            "loop_seconds": self.seconds,
            "solver_cpu_seconds": cpu_seconds,
            "measures": {name: {"value": finite(of[0]), "unit": of[1], "time_s": of[2]} for name, of in measures.items()},
            "gauges": {column: [finite(of) for of in pair] for column, pair in zip(self.columns, self.ranges.tolist())},
        }
        text = json.dumps(report, indent=2, sort_keys=True) + "\n"
        try:
            (out / "history.csv").write_text("\n".join(self.rows) + "\n", encoding="utf-8")
            (out / "summary.json").write_text(text, encoding="utf-8")
        except OSError as error:
            raise Fault(f"--out {out}: {error.strerror}", "input") from None
        print(text, end="", flush=True)


def finite(number: float) -> Optional[float]:
    """JSON has no infinity."""
    return number if math.isfinite(number) else None
