"""A solver of the contract in a process of its own, with this program in the coupler's place: one window after the other.

    with rockfall.Host(["fem-solver"], "fem", "scene.toml", "out") as solver:
        mesh = solver.prepare(end_time=1.0, window=1e-3, takes=solver.can_take, gives=solver.can_give)
        solver.takes[0][:] = force
        solver.solve(rockfall.Window(1, 1, 0.0, 1e-3))
        solver.gives[0][-1]                     # displacement at the window's end

One thread alone may use it. While it waits for the solver, Python waits.
"""

from __future__ import annotations

import os
from types import TracebackType
from typing import Dict, List, Optional, Sequence, Tuple, Type, Union

import numpy as np

from . import _rockfall
from .solver import Array, Arrays, Fault, Field, Gauge, Mesh, Window, _Side

PathLike = Union[str, "os.PathLike[str]"]


class Host:
    """The solver, started and joined. What is wrong with it is raised as `Fault`."""

    program: str
    """Name and version of the solver."""
    repeats: Optional[float]
    """As in `Solver`: None, it cannot repeat a window."""
    can_take: List[Field]
    """What it declares to take."""
    can_give: List[Field]
    """What it declares to give."""
    gauges: List[Gauge]
    """Of the prepared solver; roles are not known here."""
    takes: Arrays
    """Of the prepared solver, what it takes in the next `solve`: (samples, items, components) each, in the order of the plan."""
    gives: Arrays
    """Of the prepared solver, what it has answered, likewise; before the first `solve` as it stands at t = 0."""
    gauge_values: Array
    """Of the last answer: (gauges, 3), value, smallest and largest over the solver's own steps."""

    def __init__(self, command: Sequence[str], role: str, scene: PathLike, out: PathLike, timeout: float = 600.0):
        """Start `command` as `role` (`dem` or `fem`) on the scene, with its results in the directory `out`.

        `timeout` is the longest time that one answer may take [s].
        """
        if not command:
            raise Fault("which solver? give its command", "input")
        words = list(map(os.fspath, command))
        self._host = _rockfall.Host(words, role, os.fspath(scene), os.fspath(out), float(timeout))
        self.program, self.repeats, takes, gives = self._host.hello()
        self.can_take, self.can_give = [Field(*of) for of in takes], [Field(*of) for of in gives]

    def prepare(
        self, end_time: float, window: float, takes: Sequence[Field], gives: Sequence[Field], partner: Optional[Mesh] = None
    ) -> Mesh:
        """Fix what crosses, of what it can; a contact solver gets the mesh of its `partner`. Returns the interface mesh that it uses."""
        parts = None if partner is None else partner._parts()
        prepared = self._host.prepare((float(end_time), float(window)), takes, gives, parts)
        mesh, gauges, taken, given, first, asked, initial = prepared
        self.gauges = [Gauge(name, unit) for name, unit in gauges]
        self._asked, self._answer = np.zeros(asked), np.frombuffer(initial).copy()
        self.takes = _Side.of(takes, taken).views(self._asked)
        self.gives = _Side.of(gives, given).views(self._answer)
        self.gauge_values = self._answer[first:].reshape(-1, 3)
        return Mesh._of(mesh)

    def solve(self, window: Window, commit: bool = False) -> None:
        """Let it solve a window with what is in `takes`; its answer is in `gives` then. `commit`: the last window's solve was accepted."""
        asked = (window.number, window.iteration, window.start, window.length)
        self._answer[:] = np.frombuffer(self._host.solve(asked, commit, self._asked.tobytes()))

    def finish(self, commit: bool) -> Tuple[Dict[str, Tuple[float, str, Optional[float]]], float]:
        """End it in order: its measures, as {"name": (value, "unit", time in s or None)}, and its processor time [s]."""
        measures, seconds = self._host.finish(commit)
        return {name: (value, unit, time) for name, value, unit, time in measures}, seconds

    def close(self) -> None:
        """End it at once, and leave nothing of the run behind."""
        self._host.close()

    def __enter__(self) -> Host:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()
