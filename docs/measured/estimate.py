#!/usr/bin/env python3
"""How long `rockfall check` expects runs to take, and how long they take.

    python docs/measured/estimate.py --work out/estimate [--rockfall target/release/rockfall] [--times 3] [SCENE...]

Each scene is checked and run so many times, in turns; medians are printed. On an idle machine.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import time

SCENES = pathlib.Path(__file__).parents[2] / "launch" / "scenes"
SHIPPED = """sphere-on-plate-spring sphere-on-cable cable-net walenstadt-compare walenstadt-exp1 walenstadt-exp2 free-fall slope-cube
    slope-edge slope-fall barrier-cables barrier slope-barrier drape barrier-impact site barrier-sel""".split()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SHIPPED)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--rockfall", type=pathlib.Path, default="target/release/rockfall")
    parser.add_argument("--times", type=int, default=3)
    options = parser.parse_args()
    rows = {name: [] for name in options.scenes}
    for _ in range(options.times):
        for name, row in rows.items():
            scene, out = SCENES / f"{name}.toml", options.work / name
            begin = time.monotonic()
            said = subprocess.run([options.rockfall, "check", scene, "--format", "json"], capture_output=True, check=True)
            checked = time.monotonic() - begin
            subprocess.run([options.rockfall, "run", scene, "--out", out, "--force", "--quiet"], stderr=subprocess.DEVNULL)
            took = json.loads((out / "summary.json").read_text())["cost"]["wall_s"]
            row.append((json.loads(said.stdout)["expected_cost_s"], took, checked))
    print("| scene | expected [s] | took [s] | expected over taken | `check` took [s] |\n|---|---|---|---|---|")
    for name, row in rows.items():
        expected, took, checked = (statistics.median(values) for values in zip(*row))
        print(f"| `{name}` | {expected:.2g} | {took:.2g} | {expected / took:.2f} | {checked:.2g} |")


if __name__ == "__main__":
    main()
