"""The command `rockfall-precice`."""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from typing import List, Optional

from rockfall import Fault, serve

from .join import join
from .names import Names
from .participant import mesh_of
from .stand_in import StandIn

# What the structure's program is given to find the net at rest [s].
PATIENCE = 600.0


def arguments() -> argparse.ArgumentParser:
    options = argparse.ArgumentParser(
        "rockfall-precice", description="Rockfall's solvers as preCICE participants, and preCICE participants as solvers in rockfall"
    )
    options.add_argument("--config", required=True, metavar="FILE", help="configuration of preCICE")
    options.add_argument("--participant", required=True, metavar="NAME", help="name of the participant that this program is")
    options.add_argument(
        "--structure", default="fem-solver", metavar="PROGRAM", help="program that knows the scene's structure, for its interface mesh"
    )
    options.add_argument("--start", metavar="COMMAND", help="serve: shell command that starts the other participant")
    options.add_argument(
        "--repeats",
        type=float,
        default=0.0,
        metavar="SHARE",
        help="serve: how well the other participant repeats a window, relative to the size of each field; 0: equal bytes",
    )
    commands = options.add_subparsers(dest="command", required=True)
    one = commands.add_parser("join", help="start a solver of rockfall's contract, and take part in a preCICE run in its name")
    one.add_argument("role", choices=["dem", "fem"], help="part of the solver: dem (contact) or fem (structure)")
    one.add_argument("scene", type=Path)
    one.add_argument("--out", type=Path, default=Path("out"), metavar="DIR", help="directory for results")
    one.add_argument(
        "--timeout", type=float, default=600.0, metavar="S", help="seconds that an answer may take, of the solver or of the other participant"
    )
    one.epilog = "Behind --: the solver and its arguments."
    other = commands.add_parser(
        "serve", help="be the structure of a rockfall run in the name of the other participant; `rockfall run` and `rockfall conform` add this"
    )
    other.add_argument("scene", help="the resolved scene")
    other.add_argument("rest", nargs=argparse.REMAINDER, help="how the run is joined")
    return options


def run(argv: List[str]) -> None:
    # Behind the first `--` stands the solver, whose options are its own.
    own, solver = (argv[: argv.index("--")], argv[argv.index("--") + 1 :]) if "--" in argv else (argv, [])
    given = arguments().parse_args(own)
    if given.command == "join":
        if not solver:
            raise Fault("which solver? give its command behind `--`", "input")
        # An interrupt ends it at once, in the middle of preCICE's waiting, too; the solver notices.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        join(Names.read(given.config, given.participant), given.structure, given.role, given.scene, given.out, given.timeout, solver)
        return
    standing: Optional[StandIn] = None

    def stand_in() -> StandIn:
        nonlocal standing
        names = Names.read(given.config, given.participant)
        role = given.rest[given.rest.index("--as") + 1] if "--as" in given.rest else "fem"
        if role != "fem":
            raise Fault(f"it stands in for a structure (--as fem), not for {role}", "input")
        standing = StandIn(names, mesh_of(given.structure, given.scene, PATIENCE), given.start, given.repeats)
        return standing

    try:
        serve(stand_in, ["rockfall-precice", "serve", given.scene, *given.rest])
    finally:
        if standing is not None:
            standing.close()


def main() -> None:
    try:
        run(sys.argv[1:])
    except Fault as fault:
        print(f"error: {fault}", file=sys.stderr)
        sys.exit(2 if fault.kind == "input" else 1)


if __name__ == "__main__":
    main()
