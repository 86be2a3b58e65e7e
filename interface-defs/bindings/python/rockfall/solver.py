"""A solver in Python: what it declares, what it is given, and what it gives.

Units are SI. Arrays of fields are of shape (samples, items, components): `takes[0][-1]` is what the first declared field is at the
window's end. They are views of shared memory, valid in the call that gets them: keep copies.
"""

from __future__ import annotations

import gc
import math
import pickle
import signal
import sys
import traceback
import weakref
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _rockfall

Array = NDArray[np.float64]
Arrays = List[Optional[Array]]


@dataclass(frozen=True)
class Field:
    """A field of the exchange, as a solver declares it."""

    name: str
    """`force` [N], `displacement` from t = 0 [m], `velocity` [m/s], or another name of PROTOCOL.md, section 6."""
    sampling: str
    """`at_ends` (of equal parts of the window), `from_start` (the window's start as well), `means` (over each part) or `once`."""
    components: int = 3
    """Numbers per item."""
    place: str = "node"
    """`node`, `line`, `face` or `whole`: what the items are."""
    samples: int = 1
    """The most parts of a window that the solver can do; the plan may have fewer."""


@dataclass(frozen=True)
class Gauge:
    """A named number that comes with every answer: a column of history.csv."""

    name: str
    """In snake_case, without the unit. One in N whose name contains `reaction` is a mean over the window."""
    unit: str
    """`m`, `m/s`, `N`, `J` or `1`."""
    role: str = ""
    """Its part in the balance of energy [J]: `kinetic`, `potential`, `stored`, `dissipated`, `received` (work), or none."""
    extremes: bool = True
    """Whether its smallest and largest value over the run are measures, NAME_min and NAME_max."""


@dataclass
class Mesh:
    """The interface mesh at t = 0. A node that no line and no face holds is a contact point of its own."""

    coordinates: ArrayLike
    """(nodes, 3) [m]"""
    lines: ArrayLike = ()
    """(lines, 2), nodes from 0"""
    faces: ArrayLike = ()
    """(faces, 3), nodes from 0"""
    line_radius: ArrayLike = ()
    """(lines,) or one for all [m]"""
    masses: ArrayLike = ()
    """(nodes,) [kg], infinite where a node is held; empty: not known"""
    groups: Mapping[str, Sequence[int]] = field(default_factory=dict)
    """Named sets of nodes."""

    @classmethod
    def _of(cls, parts: Sequence[Any]) -> Mesh:
        """The one that the part in Rust gives."""
        x, lines, faces, radius, masses = (
            np.frombuffer(part, kind) for part, kind in zip(parts, ("f8", "u4", "u4", "f8", "f8"))
        )
        return cls(x.reshape(-1, 3), lines.reshape(-1, 2), faces.reshape(-1, 3), radius, masses, dict(parts[5]))

    def _parts(self) -> Tuple[Any, ...]:
        """As the part in Rust takes it."""
        lines = _bytes(self.lines, "<u4", 2, "lines")
        radius = np.asarray(self.line_radius, "<f8")
        if radius.ndim == 0:
            radius = np.full(len(lines) // 8, radius)
        return (
            _bytes(self.coordinates, "<f8", 3, "coordinates"),
            lines,
            _bytes(self.faces, "<u4", 3, "faces"),
            radius.tobytes(),
            _bytes(self.masses, "<f8", 1, "masses"),
            [(name, [int(node) for node in nodes]) for name, nodes in self.groups.items()],
        )


@dataclass
class Plan:
    """What the run is to be."""

    end_time: float
    """[s]"""
    window: float
    """Length of the scene's windows [s]; single ones may be shorter, or longer up to `largest_window`."""
    partner: Optional[Mesh]
    """For a contact solver the structure's mesh."""
    scene: Dict[str, Any]
    """The scene with every default; its table `custom` belongs to programs like yours."""
    progress: Callable[[str, float], None]
    """`progress("what", share)`: call it at least once a second while preparing takes long."""


@dataclass
class Ready:
    """A prepared solver."""

    mesh: Optional[Mesh] = None
    """A structure's mesh; None: the partner's, for a contact solver."""
    state: Any = None
    """All that moves, at t = 0: what `solve` starts from."""
    gauges: Sequence[Gauge] = ()


@dataclass(frozen=True)
class Window:
    """A time window, as the coupler asks for it."""

    number: int
    iteration: int
    start: float
    """[s]; never sum up lengths: this is the time"""
    length: float
    """[s]"""

    @property
    def end(self) -> float:
        """[s]"""
        return self.start + self.length

    def steps(self, longest: float) -> int:
        """How many equal steps, none longer than `longest` [s]."""
        return max(1, math.ceil(self.length / longest * (1.0 - 1e-9)))


class Fault(Exception):
    """The solver cannot do what was asked. `kind`: `input` (the user's input is wrong), `window` (a shorter window may succeed) or
    `broken`, which every other exception means as well."""

    def __init__(self, what: str, kind: str = "broken"):
        super().__init__(what)
        self.kind = kind


class Solver:
    """A solver: a function of committed state and input over one window. Derive from `Structure` or `Contact`."""

    program: str = ""
    """Name and version, for messages; empty: the name of the class."""
    takes: Sequence[Field] = ()
    gives: Sequence[Field] = ()
    repeats: Optional[float] = 0.0
    """Solving A, B, A gives both A equal to this share of each field (0: equal bytes); None: it cannot repeat a window."""
    largest_window: float = math.inf
    """Longest window that it can solve [s]."""
    goes_on: bool = True
    """Whether `state` (pickled) is all that a killed run needs to go on. False for one that keeps state elsewhere."""

    def prepare(self, plan: Plan) -> Ready:
        """Build everything."""
        raise NotImplementedError

    def start(self, state: Any, gives: Arrays, gauges: Array) -> None:
        """Write the answer as it stands at t = 0; all of it is zero before."""

    def solve(self, state: Any, window: Window, takes: Arrays, gives: Arrays, gauges: Array) -> Any:
        """Advance `state` over the window; return the new one, and leave the old one as it was.

        `takes` and `gives` are the declared fields in their order, None for one that the plan does not have; write every number of
        `gives`. `gauges` is (gauges, 3): value, smallest and largest over the solver's own steps. May be called any number of times
        for a window: equal input gives equal numbers.
        """
        raise NotImplementedError

    def commit(self, state: Any) -> None:
        """The last solve was accepted, and `state`, which it returned, is the committed one."""

    def at_rest(self, state: Any) -> bool:
        """Whether nothing of it will move any more unless the other solver moves it."""
        return False

    def finish(self, state: Any) -> Optional[Dict[str, Union[Tuple[float, str], int]]]:
        """The run is over: measures of its own, as {"name": (value, "unit")}, and counts of work done, as {"name": 12}."""
        return None


class Structure(Solver):
    """Takes the mean force on its nodes, gives their displacement and velocity at the window's end."""

    takes = [Field("force", "means")]
    gives = [Field("displacement", "at_ends"), Field("velocity", "at_ends")]


class Contact(Solver):
    """Takes the displacement of the structure's nodes at the window's start and end, gives the force on them: its mean, and the
    one at the end (the plan has one of the two, or both)."""

    takes = [Field("displacement", "from_start")]
    gives = [Field("force", "means"), Field("force", "at_ends")]


def serve(solver: Union[Solver, Callable[[], Solver]], argv: Optional[Sequence[str]] = None) -> None:
    """Take part in the run that the command line names, and exit when it is over.

    `solver` may be a function that makes one: what it raises is told to the run as the reason why there is none.
    """
    argv = list(sys.argv if argv is None else argv)
    # The run's own handling of Ctrl-C takes the place of Python's, which would look only between two windows.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_rockfall.serve(Adapter(solver, argv), argv))


@dataclass
class _Side:
    """One side of the exchange: where its fields lie, each as (first, last, shape)."""

    places: List[Optional[Tuple[int, int, Tuple[int, int, int]]]] = field(default_factory=list)

    @classmethod
    def of(cls, declared: Sequence[Field], places: Sequence[Optional[Tuple[int, int, int]]]) -> _Side:
        shaped = [place and (*place[:2], (place[2], -1, f.components)) for f, place in zip(declared, places)]
        return cls(shaped)

    def views(self, numbers: Array) -> Arrays:
        return [place and numbers[place[0] : place[1]].reshape(place[2]) for place in self.places]


def _bytes(values: ArrayLike, kind: str, width: int, what: str) -> bytes:
    array = np.asarray(values, dtype=kind)
    if array.size % width or (array.ndim == 2 and array.size and array.shape[1] != width):
        raise Fault(f"{what} is of shape {array.shape}, it must be (..., {width})")
    return np.ascontiguousarray(array).tobytes()


class Adapter:
    """What the part in Rust calls."""

    def __init__(self, solver: Union[Solver, Callable[[], Solver]], argv: List[str]):
        self.made = solver
        self.argv = argv
        self.state: Any = None
        self.trial: Any = None
        self.resumed: Optional[bytes] = None

    def hello(self) -> Adapter:
        self.solver = self.made if isinstance(self.made, Solver) else self.made()
        return self

    @property
    def program(self) -> str:
        return self.solver.program or type(self.solver).__name__

    def __getattr__(self, name: str) -> Any:
        if name in ("repeats", "largest_window", "takes", "gives", "goes_on"):
            return getattr(self.solver, name)
        raise AttributeError(name)

    def prepare(
        self, end_time: float, window: float, partner: Optional[Tuple[Any, ...]], progress: Callable[[str, float], None]
    ) -> Tuple[Any, List[Gauge]]:
        mesh = None if partner is None else Mesh._of(partner)
        ready = self.solver.prepare(Plan(end_time, window, mesh, _rockfall.scene(self.argv), progress))
        if not isinstance(ready, Ready):
            raise Fault(f"prepare returned {type(ready).__name__}, it must return rockfall.Ready")
        self.state = ready.state if self.resumed is None else pickle.loads(self.resumed)
        self.initial = ready.state
        self.gauge_count = len(ready.gauges)
        own = ready.mesh
        if own is None:
            if mesh is None:
                raise Fault("a structure has a mesh: Ready(mesh=...)")
            return None, list(ready.gauges)
        return own._parts(), list(ready.gauges)

    def start(self, takes: Sequence[Any], gives: Sequence[Any], gauges: int, output: memoryview) -> None:
        self.taken, self.given = _Side.of(self.solver.takes, takes), _Side.of(self.solver.gives, gives)
        self.gauges = gauges
        lent = [np.frombuffer(output)]
        self.solver.start(self.initial, *self.answer(lent[0]))
        self.take_back(lent)

    def answer(self, numbers: Array) -> Tuple[Arrays, Array]:
        return self.given.views(numbers), numbers[self.gauges : self.gauges + 3 * self.gauge_count].reshape(-1, 3)

    def solve(self, window: Tuple[int, int, float, float], takes: memoryview, gives: memoryview) -> None:
        lent = [np.frombuffer(takes), np.frombuffer(gives)]
        self.trial = self.solver.solve(
            self.state, Window(*window), self.taken.views(lent[0]), *self.answer(lent[1])
        )
        self.take_back(lent)

    @staticmethod
    def take_back(lent: List[Array]) -> None:
        """Arrays that the solver has kept would look into memory that the next window uses for something else."""
        left = [weakref.ref(array) for array in lent]
        lent.clear()
        if any(array() is not None for array in left):
            # What only a circle of references holds goes with the circle.
            gc.collect()
            if any(array() is not None for array in left):
                raise Fault(
                    "the solver has kept an array of the exchange, which is valid in the call alone: keep a copy, numpy.array(it)"
                )

    def commit(self) -> None:
        self.state = self.trial
        self.solver.commit(self.state)

    def at_rest(self) -> bool:
        return bool(self.solver.at_rest(self.trial))

    def save(self) -> bytes:
        return pickle.dumps(self.state)

    def resume(self, state: bytes) -> None:
        self.resumed = state

    def finish(self) -> Tuple[List[Tuple[str, float, str]], List[Tuple[str, int]]]:
        given = (self.solver.finish(self.state) or {}).items()
        measures = [(name, float(of[0]), of[1]) for name, of in given if isinstance(of, tuple)]
        return measures, [(name, int(of)) for name, of in given if not isinstance(of, tuple)]

    @staticmethod
    def explain(error: BaseException) -> Tuple[str, str]:
        """Kind of fault and reason of an exception; all of it goes to standard error, which the run keeps in its log."""
        if isinstance(error, Fault):
            return error.kind, str(error)
        traceback.print_exception(type(error), error, error.__traceback__)
        frames = traceback.extract_tb(error.__traceback__)
        at = f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""
        return "broken", f"{type(error).__name__}: {error}{at}"
