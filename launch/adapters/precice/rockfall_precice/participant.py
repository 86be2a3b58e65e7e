"""What both directions share: a participant on the interface mesh, and the mesh of a scene's structure."""

from __future__ import annotations

import os
import tempfile
from contextlib import contextmanager
from typing import Any, Iterator, List, Sequence, Union

import mpi4py
import numpy as np
from rockfall import Fault, Field, Host, Mesh

from .names import Names

# pyprecice imports MPI, whether preCICE uses it or not: one that does starts it by itself, and others leave nothing of it in /dev/shm.
mpi4py.rc.initialize = False
import precice  # noqa: E402

PathLike = Union[str, "os.PathLike[str]"]


@contextmanager
def said() -> Iterator[None]:
    """What preCICE itself says no to is a fault with its text."""
    try:
        yield
    except RuntimeError as error:
        raise Fault(f"preCICE: {error}") from None


class Participant:
    """The participant of a configuration, with the nodes of a mesh."""

    def __init__(self, names: Names, mesh: Mesh):
        self.mesh = names.mesh
        with said():
            self.it = precice.Participant(names.participant, names.config, 0, 1)
            self.ids = self.it.set_mesh_vertices(self.mesh, np.asarray(mesh.coordinates))
            if self.it.requires_mesh_connectivity_for(self.mesh):
                for nodes, put in ((mesh.lines, self.it.set_mesh_edges), (mesh.faces, self.it.set_mesh_triangles)):
                    if len(np.asarray(nodes)):
                        put(self.mesh, self.ids[np.asarray(nodes)])

    def __getattr__(self, name: str) -> Any:
        """A function of preCICE without arguments, or with the length of a step."""
        function = getattr(self.it, name)

        def call(*arguments: float) -> Any:
            with said():
                return function(*arguments)

        return call

    def read(self, data: str, at: float) -> Any:
        """Numbers at every node, at this time from the start of the window [s]."""
        with said():
            return self.it.read_data(self.mesh, data, self.ids, at)

    def write(self, data: str, values: Any) -> None:
        with said():
            self.it.write_data(self.mesh, data, self.ids, values)


def field(fields: Sequence[Field], name: str, sampling: str) -> List[Field]:
    """Of the fields of a solver those of this name and sampling, with one sample in each window: one, or none."""
    found = [of for of in fields if (of.name, of.sampling) == (name, sampling)]
    return [Field(of.name, of.sampling, of.components, of.place) for of in found[:1]]


def motion(solver: Host) -> List[Field]:
    """Displacement and velocity at the end of a window, which every structure gives."""
    both = []
    for name in ("displacement", "velocity"):
        found = field(solver.can_give, name, "at_ends")
        if not found:
            raise Fault(f"fem: {solver.program} does not give {name} (at_ends)")
        both += found
    return both


def mesh_of(structure: str, scene: PathLike, timeout: float) -> Mesh:
    """The interface mesh of the structure in `scene`, which the program `structure` knows: it is prepared, and ended before the first window."""
    with tempfile.TemporaryDirectory(prefix="rockfall-precice-") as out, Host([structure], "fem", scene, out, timeout) as solver:
        mesh = solver.prepare(1.0, 1.0, (), motion(solver))
        solver.finish(commit=False)
        return mesh
