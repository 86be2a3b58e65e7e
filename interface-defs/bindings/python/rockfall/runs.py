"""Runs of the program `rockfall`, and what they leave."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import xml.etree.ElementTree as xml
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

PathLike = Union[str, "os.PathLike[str]"]


class RunFailed(RuntimeError):
    """The run has no results to trust. `code` is its exit code: 1 failed or interrupted, 2 bad input."""

    def __init__(self, code: int, message: str):
        super().__init__(message)
        self.code = code


@dataclass
class Results:
    """What a run has left in its directory."""

    path: Path

    @cached_property
    def summary(self) -> Dict[str, Any]:
        """summary.json"""
        summary: Dict[str, Any] = json.loads((self.path / "summary.json").read_text(encoding="utf-8"))
        return summary

    @property
    def status(self) -> str:
        """`done`, or `unreliable`: computed to the end, but a bound of trust was passed."""
        return str(self.summary["status"])

    @property
    def measures(self) -> Dict[str, float]:
        """Each measure by its name, in its unit: `summary["measures"]` has unit, time and uncertainty."""
        return {name: of["value"] for name, of in self.summary["measures"].items() if of is not None}

    @cached_property
    def curves(self) -> Any:
        """history.csv: a pandas.DataFrame if pandas is there, else a dict of numpy arrays. Names carry units: `time_s`."""
        path = self.path / "history.csv"
        try:
            import pandas
        except ImportError:
            with path.open(newline="") as file:
                names, *rows = csv.reader(file)
            numbers = np.array([[float(cell or "nan") for cell in row] for row in rows]).reshape(-1, len(names))
            return dict(zip(names, numbers.T))
        return pandas.read_csv(path, float_precision="round_trip")

    def fields(self, name: str = "structure") -> List[Tuple[float, Any]]:
        """`fields/NAME.pvd` as [(time in s, meshio.Mesh)]; the scene needs `output.fields`. Needs meshio."""
        import meshio

        series = self.path / "fields" / f"{name}.pvd"
        if not series.exists():
            there = sorted(p.stem for p in (self.path / "fields").glob("*.pvd"))
            hint = f"there are {there}" if there else "the run wrote none: sets={'output.fields': 0.02}"
            raise FileNotFoundError(f"{series}: {hint}")
        files = xml.parse(series).iter("DataSet")
        return [(float(of.attrib["timestep"]), meshio.read(series.parent / of.attrib["file"])) for of in files]

    def __repr__(self) -> str:
        return f"<rockfall.Results {self.path}: {self.status}, {len(self.measures)} measures>"


def _toml(value: Any) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(item)}" for key, item in value.items()) + "}"
    return repr(value.item() if isinstance(value, np.generic) else value)


def program(name: str = "rockfall") -> str:
    """Path of the program: in the directory of the environment variable ROCKFALL_BIN, else by PATH."""
    there = os.environ.get("ROCKFALL_BIN")
    found = shutil.which(name, path=there) if there else shutil.which(name)
    if found is None:
        where = f"ROCKFALL_BIN={there}" if there else "PATH (set PATH or ROCKFALL_BIN to .../target/release)"
        raise FileNotFoundError(f"the program {name} is not in {where}")
    return found


def run(
    scene: PathLike,
    sets: Optional[Mapping[str, Any]] = None,
    out: Optional[PathLike] = None,
    force: bool = False,
    options: Sequence[str] = (),
    show: bool = False,
) -> Results:
    """Run a scene to its end: `rockfall run SCENE --set KEY=VALUE ...`.

    `sets` changes values of the scene by dotted keys, `out` is the directory of results (default `out/<scene name>`), `force` lets a
    run replace what is there, `options` are further ones of the command line, and `show` lets it print. Raises `RunFailed`.
    """
    out = Path(out) if out is not None else Path("out") / Path(scene).stem
    command = [program(), "run", os.fspath(scene), "--out", os.fspath(out), *options]
    for key, value in (sets or {}).items():
        command += ["--set", f"{key}={_toml(value)}"]
    if force:
        command.append("--force")
    if not show:
        command.append("--quiet")
    ended = subprocess.run(command, stderr=None if show else subprocess.PIPE, text=True)
    if ended.returncode not in (0, 3):
        raise RunFailed(ended.returncode, (ended.stderr or f"exit code {ended.returncode}").strip())
    return Results(out)
