#!/usr/bin/env python3
"""How far the measures of barriers scatter where starts differ by rounding, and whether `uncertainty` covers it.

    python docs/measured/scatter.py --work out/scatter [--rockfall target/release/rockfall]

Each barrier runs as shipped and in weak windows of 2e-5 s, each with its speed as it is and 1e-9 and 1e-6 larger. A value is
covered if it is within its own uncertainty of the median of all runs of that barrier. Runs that are there are not run again.
"""
import argparse
import json
import pathlib
import re
import statistics
import subprocess

SCENES = pathlib.Path(__file__).parents[2] / "launch" / "scenes"
BARRIERS = {
    "slope-barrier": ("slope-barrier", []),
    "slope-barrier, 400 kg": ("slope-barrier", ["rock.0.mass=400"]),
    "slope-barrier, 2 000 kg": ("slope-barrier", ["rock.0.mass=2000"]),
    "slope-barrier, damping 2/s": ("slope-barrier", ["structure.damping=2.0"]),
    "slope-barrier, friction 0.8": ("slope-barrier", ["contact.0.friction=0.8", "contact.0.young=1e8"]),
    "barrier-impact": ("barrier-impact", []),
    "barrier-impact, 800 kg": ("barrier-impact", ["rock.0.mass=800"]),
    "barrier-impact, 0.9 m": ("barrier-impact", ["rock.0.shape.size=0.9"]),
    "barrier-sel": ("barrier-sel", []),
    "barrier-sel, 400 kg": ("barrier-sel", ["rock.0.mass=400", "rock.0.shape.size=0.6"]),
}
WINDOWS = {"as shipped": [], "weak": ['coupling.scheme="weak"', "coupling.time_window=2e-5"]}
MEASURES = [
    "max_travel", "braking_time", "rebound_speed", "max_reaction", "max_reaction_1ms", "max_reaction_10ms", "max_cable_force",
]


def run(rockfall, work, name, scene, sets):
    """The summary of a run."""
    out = work / re.sub(r"[^a-z0-9.-]+", "-", name)
    if not (out / "summary.json").exists():
        words = [word for one in sets for word in ("--set", one)]
        subprocess.run([rockfall, "run", scene, "--out", out, "--quiet", *words], stderr=subprocess.DEVNULL)
    return json.loads((out / "summary.json").read_text())["measures"]


def runs(rockfall, work, barrier):
    """The measures of all runs of a barrier."""
    scene, sets = BARRIERS[barrier]
    path = SCENES / f"{scene}.toml"
    velocity = [float(v) for v in re.search(r"^velocity = \[(.*)\]", path.read_text(), re.M)[1].split(",")]
    for window, more in WINDOWS.items():
        for change in (0.0, 1e-9, 1e-6):
            changed = ", ".join(repr(v * (1.0 + change)) for v in velocity)
            own = [*sets, *more, f"rock.0.velocity=[{changed}]"]
            yield run(rockfall, work, f"{barrier} {window} {change:g}", path, own)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--rockfall", type=pathlib.Path, default="target/release/rockfall")
    options = parser.parse_args()
    rockfall = options.rockfall.resolve()
    covered = {name: [] for name in MEASURES}
    print("| barrier | " + " | ".join(f"`{name}`" for name in MEASURES) + " |")
    print("|---" * (1 + len(MEASURES)) + "|")
    for barrier in BARRIERS:
        of_runs = list(runs(rockfall, options.work, barrier))
        cells = []
        for name in MEASURES:
            known = [m[name] for m in of_runs if m.get(name, {}).get("uncertainty") is not None]
            if len(known) < 2:
                cells.append("-")
                continue
            middle = statistics.median(one["value"] for one in known)
            off = [abs(one["value"] - middle) for one in known]
            covered[name] += [o <= one["uncertainty"] for o, one in zip(off, known)]
            stated = statistics.median(one["uncertainty"] for one in known)
            cells.append(f"{100 * max(off) / middle:.2g} % / {100 * stated / middle:.2g} %")
        print(f"| {barrier} | " + " | ".join(cells) + " |", flush=True)
    cells = [f"{sum(of)} of {len(of)}" for of in covered.values()]
    print("| covered | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
