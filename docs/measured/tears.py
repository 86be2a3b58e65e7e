#!/usr/bin/env python3
"""What tears in nets, by scheme and preset against fine steps, and in `barrier-impact` with `--refine`.

    python docs/measured/tears.py --work out/tears [--rockfall target/release/rockfall]

The scene and the fine steps are those of tests/tests/physics/rupture.rs. Four nets, ten starts each: 40 fine runs, 240 others. The reaction
is that over 1 ms. Runs that are there are not run again.
"""
import argparse
import json
import math
import pathlib
import random
import subprocess

BARRIER = pathlib.Path(__file__).parents[2] / "launch" / "scenes" / "barrier-impact.toml"
NETS = [(10, 0.3, 1e4), (10, 0.3, 6e3), (15, 0.2, 1e4), (15, 0.2, 6e3)]
FINE = [
    "coupling.scheme=strong", "coupling.yielding_net=true", "coupling.time_window=5e-5", "coupling.samples=10",
    "coupling.yielding_share=0.01", "fem.time_step=5e-6", "dem.time_step=5e-6",
]
SCHEMES = {
    "default": [],
    "weak": ["coupling.scheme=weak"],
    "strong": ["coupling.scheme=strong"],
    "fast": ["coupling.preset=fast"],
    "balanced": ["coupling.preset=balanced"],
    "accurate": ["coupling.preset=accurate"],
}


def scene(n, edge, strength, start):
    """A net of `n` by `n` meshes of `edge` [m], whose wires bear `strength` [N], and a rock that comes down at `start` [m]."""
    side = n + 1
    at = [(i, j, j * side + i) for j in range(side) for i in range(side)]
    nodes = [[i * edge - n * edge / 2, j * edge - n * edge / 2, 0.0] for i, j, _ in at]
    cells = [[node, node + 1] for i, _, node in at if i < n] + [[node, node + side] for _, j, node in at if j < n]
    held = [node for i, j, node in at if i in (0, n) or j in (0, n)]
    return f"""end_time = 0.1
gravity = [0.0, 0.0, -9.81]
[[rock]]
name = "rock"
position = [{start[0]}, {start[1]}, 0.23]
velocity = [0.0, 0.0, -10.0]
mass = 200.0
shape = {{ type = "box", size = [0.4, 0.4, 0.4] }}
cluster.spheres = 64
[[contact]]
law = "hertz_mindlin"
young = 1e8
poisson = 0.2
restitution = 0.5
[structure]
nodes = {nodes}
supports = [{{ nodes = {held} }}]
damping = 15.0
[[structure.parts]]
name = "net"
element = "cable"
cells = {cells}
young = 8.2e9
area = 1.256637061e-5
density = 7850.0
rupture_force = {strength}
"""


def read(out):
    """How a run ended, how many elements tore, the reaction, and whether the run says that what tore is uncertain."""
    summary = json.loads((out / "summary.json").read_text())
    torn = sum(part["elements"] for part in summary["torn"])
    near = any(reason["code"] == "near-rupture" for reason in summary.get("reasons", []))
    return summary["status"], torn, summary["measures"]["max_reaction_1ms"]["value"], near


def run(rockfall, path, out, sets, refine=False):
    """What `read` gives of a run, which is done if it is not there."""
    if not (out / ("refined" if refine else "") / "summary.json").exists():
        words = [word for one in sets for word in ("--set", one)] + ["--refine"] * refine
        subprocess.run([rockfall, "run", path, "--out", out, "--force", "--quiet", *words], stderr=subprocess.DEVNULL)
    return read(out)


def nets(rockfall, work):
    """Scheme by scheme, all nets and starts against fine steps."""
    draw = random.Random(1)
    starts = [(5e-3 * math.sqrt(draw.random()), 2 * math.pi * draw.random()) for _ in range(10)]
    cases = {}
    for n, edge, strength in NETS:
        for k, (r, angle) in enumerate(starts):
            path = work / f"{n}-{strength / 1e3:g}kN-{k}.toml"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(scene(n, edge, strength, [r * math.cos(angle), r * math.sin(angle)]))
            cases[path] = run(rockfall, path, path.with_suffix("") / "fine", FINE)
    ends = [status for status, *_ in cases.values()]
    print(f"Fine steps: {ends.count('done')} `done`, {ends.count('unreliable')} `unreliable`\n")
    print("| | `done` | of these as many torn | one more or less | more | reaction of `done` | of all | `unreliable`, by `near-rupture` |")
    print("|---" * 8 + "|")
    far = []
    for scheme, sets in SCHEMES.items():
        ended, every, near = {"done": [], "unreliable": []}, [], 0
        for path, (_, torn, reaction, _) in cases.items():
            status, count, value, close = run(rockfall, path, path.with_suffix("") / scheme, sets)
            off, error = abs(count - torn), abs(value / reaction - 1)
            ended[status].append(off)
            every.append((error, status))
            near += close
            says = f"{path.stem}, {scheme}: `{status}`, {count} torn for {torn}, reaction {100 * error:.2g} % off"
            if status == "done" and off > 1:
                again = run(rockfall, path, path.with_suffix("") / f"{scheme}-refine", sets, refine=True)
                says += f"; with --refine `{again[0]}`"
            if status == "done" and off > 1 or error > 0.03:
                far.append(says)
        done = ended["done"]
        counts = f"{len(done)} | {done.count(0)} | {done.count(1)} | {sum(off > 1 for off in done)}"
        worst = max(error for error, status in every if status == "done"), max(error for error, _ in every)
        forces = " | ".join(f"{100 * error:.2g} %" for error in worst)
        print(f"| {scheme} | {counts} | {forces} | {len(ended['unreliable'])}, {near} |", flush=True)
    print("", *far, sep="\n")


def barrier(rockfall, work):
    """`barrier-impact`, faster than it holds, with `--refine`."""
    print("\n| `barrier-impact` | torn | with half the steps | ends |\n|---|---|---|---|")
    for speed in (40, 45, 50):
        out = work / f"barrier-{speed}"
        status, torn, _, _ = run(rockfall, BARRIER, out, [f"rock.0.velocity=[0.0, {speed}.0, 0.0]"], refine=True)
        print(f"| {speed} m/s | {torn} | {read(out / 'refined')[1]} | `{status}` |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--rockfall", type=pathlib.Path, default="target/release/rockfall")
    options = parser.parse_args()
    rockfall = options.rockfall.resolve()
    nets(rockfall, options.work)
    barrier(rockfall, options.work)


if __name__ == "__main__":
    main()
