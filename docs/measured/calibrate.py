#!/usr/bin/env python3
"""Make the example of docs/calibrate.md: falls with known parameters, every second one observed, and what `rockfall calibrate` makes of them.

    python docs/measured/calibrate.py --work out/calibrate-example     # some 7 minutes of processor time

`rockfall` is found by PATH. The file of the calibration is the block of the page.
"""
import argparse
import csv
import pathlib
import subprocess

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
TRUE = "contact.0.friction = 0.5\ncontact.0.rolling_friction = 0.14\ncontact.0.restitution = 0.2\n"


def rockfall(*words, cwd):
    """Exit code 3 is a result, too."""
    assert subprocess.run(["rockfall", *words], cwd=cwd).returncode in (0, 3), words


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="a directory that is made")
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--falls", type=int, default=60)
    options = parser.parse_args()
    work = options.work
    work.mkdir(parents=True)
    scenes = REPOSITORY / "launch" / "scenes"
    study = (scenes / "studies" / "slope.toml").read_text()
    study = study.replace("../slope-fall.toml", str(scenes / "slope-fall.toml"))
    study = study.replace("count = 200", f"count = {options.falls}").replace("[maps]\ncell = 1.0\nepsg = 2056\n", "")
    study = "".join(line for line in study.splitlines(True) if not line.startswith("contact.0."))
    (work / "study.toml").write_text(study)
    known = study.replace("[vary]\n", "[vary]\n" + TRUE).replace("seed = 1", "seed = 77")
    (work / "known.toml").write_text(known)
    rockfall("ensemble", "known.toml", "--quiet", cwd=work)

    stops = [(row["member"], row["run_out_m"]) for row in csv.DictReader(open(work / "out/known/members.csv"))]
    crossings = csv.DictReader(open(work / "out/known/lines/road.csv"))
    at_line = {row["member"]: row for row in crossings if row["crossing"] == "1"}
    for name, half in [("half.csv", stops[::2]), ("other.csv", stops[1::2])]:
        with open(work / name, "w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["stop_m", "speed_m_per_s", "jump_height_m"])
            for member, stop in half:
                row = at_line.get(member)
                table.writerow([stop, row["speed_m_per_s"] if row else "", row["passing_height_m"] if row else ""])

    page = (REPOSITORY / "docs" / "calibrate.md").read_text()
    block = page.split("```toml\n")[1].split("```")[0]
    (work / "calibrate.toml").write_text(f"sets = {options.sets}\n" + block.replace("of = 30", f"of = {options.falls // 2}"))
    rockfall("calibrate", "calibrate.toml", cwd=work)


if __name__ == "__main__":
    main()
