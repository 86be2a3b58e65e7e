#!/usr/bin/env python3
"""A scene with rockfall's own solvers, and with others in their place: results, time, and how far rows are apart.

usage: compare.py SCENE [--set KEY=VALUE]... [--within SHARE] NAME=ROLE:COMMAND[,KEY=VALUE]...[,lines=FILE]

as in: compare.py launch/scenes/walenstadt-exp1.toml Kratos=fem:launch/adapters/kratos/structure.py
       compare.py launch/scenes/cable-net.toml 'C=fem:launch/adapters/nets/net-c {modelled} {rest},lines=launch/adapters/nets/net.c'

{modelled} and {rest} are the files that `rockfall export` writes of the scene, the second with --at-rest. The processor time of all is that of all
programs of a run. Rows are compared column by column, of all columns that both histories have, over the largest number of the same unit. With
--within the exit code is 1 where one is further apart than this.
"""
import argparse
import pathlib
import resource
import subprocess
import sys
import tempfile

import numpy as np
from rockfall.runs import Results, program

# Columns of the coupler, of which some need energies that a solver does not give.
WITHOUT = ("iterations", "residual", "energy_imbalance", "energy_coupling")
MEASURES = ("max_deflection", "max_elongation", "centre_uz_min", "max_reaction")
NOISE = 1e-9


def run(scene, sets, out):
    """Results of the run, and processor time of all its programs [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [program(), "run", str(scene), "--out", str(out), "--quiet", *("--set=" + one for one in sets)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Results(out), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def export(scene, sets, folder):
    """The words that stand for the structure in a command, each with its file."""
    files = {"modelled": [], "rest": ["--at-rest"]}
    for name, options in files.items():
        words = [program(), "export", str(scene), "--to", "%s/%s.mdpa" % (folder, name), *options, *("--set=" + one for one in sets)]
        subprocess.run(words, check=True, capture_output=True)
    return {"{%s}" % name: "%s/%s.mdpa" % (folder, name) for name in files}


def apart(own, other):
    """The largest difference of a column that both have, over the largest number of its unit, and its name."""
    both = [name for name in own if name in other and not name.startswith(WITHOUT)]
    a, b = ({name: np.array(of[name]) for name in both} for of in (own, other))
    # A row stands where anything touches, which only solvers that say so know before: rows of one alone are left out.
    _, own_rows, other_rows = np.intersect1d(a["time_s"], b["time_s"], return_indices=True)
    if len(own_rows) < 0.9 * len(a["time_s"]):
        return np.inf, "%d rows beside %d" % (len(b["time_s"]), len(a["time_s"]))
    a, b = ({name: of[name][rows] for name in both} for of, rows in ((a, own_rows), (b, other_rows)))
    unit = {name: "/".join(name.split("_")[-3:] if name.endswith("_per_s") else name.split("_")[-1:]) for name in both}
    most = {of: max(np.nanmax(np.abs(a[name])) for name in both if unit[name] == of) for of in unit.values()}
    # What stays below is rounding, as the spin of a cube that falls on its face.
    found = [(np.nanmax(np.abs(a[name] - b[name])) / most[unit[name]], name) for name in both if most[unit[name]] > NOISE]
    return max(found)


def line(name, results, spent, lines, off):
    cells = [name]
    for measure in MEASURES:
        of = {key: one for key, one in results.summary["measures"].items() if one}
        # What a structure does not report follows from its motion, as a mean.
        name = measure if any(key.endswith(measure) for key in of) else measure + "_1ms"
        found = [(one["value"], one["source"]) for key, one in of.items() if key.endswith(name)]
        value, source = max(found, default=(None, ""))
        cells.append("-" if value is None else "%.10g%s" % (value, " (coupler)" if source.startswith("coupler") else ""))
    cells.append(", ".join(one["fate"] for one in results.summary["verdict"]) + ", " + results.status)
    cost = results.summary["cost"]
    cells += ["%.2f" % cost["loop_s"], " / ".join("%.2f" % cost["processes"][role]["cpu_s"] for role in ("dem", "fem")) + " / %.2f" % spent]
    print("| " + " | ".join([*cells, lines, off]) + " |", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("scene", type=pathlib.Path)
    options.add_argument("--set", action="append", default=[], dest="sets")
    options.add_argument("--within", type=float)
    options.add_argument("others", nargs="+", metavar="NAME=ROLE:COMMAND[,KEY=VALUE]")
    given = options.parse_args()
    print("| | %s | verdicts, status | loop [s] | processor, dem / fem / all [s] | lines | rows apart |" % " | ".join(MEASURES))
    print("|" + "---|" * (len(MEASURES) + 6))
    far = False
    with tempfile.TemporaryDirectory() as folder:
        own, spent = run(given.scene, given.sets, pathlib.Path(folder) / "own")
        line("rockfall", own, spent, "", "")
        for i, other in enumerate(given.others):
            name, words = other.split("=", 1)
            place, *sets = words.split(",")
            lines = [len(pathlib.Path(one[6:]).read_text().splitlines()) for one in sets if one.startswith("lines=")]
            sets = [one for one in sets if not one.startswith("lines=")]
            if ":" in place:
                role, command = place.split(":", 1)
                files = export(given.scene, given.sets + sets, folder) if "{" in command else {}
                command, *rest = (files.get(word, word) for word in command.split())
                sets.append("processes.%s=%r" % (role, " ".join([str(pathlib.Path(command).resolve()), *rest])))
            else:
                sets.append(place)
            results, spent = run(given.scene, given.sets + sets, pathlib.Path(folder) / str(i))
            off, column = apart(own.curves, results.curves)
            far |= not off <= (np.inf if given.within is None else given.within)
            line(name, results, spent, "".join(map(str, lines)), "%.1e, %s" % (off, column))
    sys.exit("rows are further apart than %g" % given.within if far else 0)


if __name__ == "__main__":
    main()
