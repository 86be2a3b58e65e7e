#!/usr/bin/env python3
"""One scene with rockfall's own structure and with others in its place: results, time, and where rows differ.

usage: compare.py SCENE [--role fem|dem] [--set KEY=VALUE]... [--within SHARE] NAME=COMMAND...

Prints a line each. With --within the exit code is 1 where a number of the history that both runs have is further off than
this share of the largest of its column.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import rockfall
from rockfall.runs import program

SHOWN = ("max_deflection", "max_elongation", "max_reaction", "max_reaction_1ms")


def run(scene, sets, out):
    command = [program(), "run", str(scene), "--out", str(out), "--quiet", *("--set=" + one for one in sets)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    return rockfall.runs.Results(out)


def furthest(own, other):
    """The largest difference of a column that both have, over its largest number, and its name."""
    names = [name for name in own if name in other and not name.startswith(("iterations", "residual"))]
    if any(len(own[name]) != len(other[name]) for name in names):
        return np.inf, "rows"
    off = [np.abs(own[name] - other[name]).max() / (np.abs(own[name]).max() or 1.0) for name in names]
    return max(zip(off, names))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("scene", type=pathlib.Path)
    options.add_argument("--role", default="fem", choices=("fem", "dem"))
    options.add_argument("--set", action="append", default=[], dest="sets")
    options.add_argument("--within", type=float)
    options.add_argument("others", nargs="+", metavar="NAME=COMMAND")
    given = options.parse_args()
