"""Spheres down the generated slope of docs/performance.md, by PlatRock (PyPI, GPL-3; it is run, nothing of it is copied) and by rockfall.

    apt-get install libgdal-dev g++
    python -m venv platrock && platrock/bin/pip install "numpy<2.1" platrock==0.4.6
    platrock/bin/pip install wheel "setuptools<80" && platrock/bin/pip install --no-build-isolation "gdal[numpy]==$(gdal-config --version)"
    platrock/bin/python docs/measured/beside_platrock.py --bin target/release --work out/platrock --spacing 0.4 --rocks 20

Both start from the same places with the same velocity, in turns, each on one core; what is printed is processor time.
"""

import argparse
import csv
import resource
import subprocess
import time
from pathlib import Path

import numpy as np

RADIUS, DENSITY, HEIGHT = 0.5, 2600.0, 1.5
VELOCITY = [4.0, 0.0, -2.0]
# Bourrier's rebound: 31 degrees is a friction of 0.6; the normal restitution is 0.35 at 5 m/s. `R_t` brings the rocks as far as ours come.
BOURRIER = {"bounce_model_number": 2, "phi": 31.0, "v_half": 2.7, "R_t": 0.7, "roughness": 0.1, "mu_r": 0.5}

SCENE = f"""end_time = 120.0
gravity = [0.0, 0.0, -9.81]
[[rock]]
position = [40.0, 100.0, 210.0]
velocity = {VELOCITY}
density = {DENSITY}
shape = {{ type = "sphere", radius = {RADIUS} }}
[terrain]
file = "slope.asc"
[[contact]]
law = "hertz_mindlin"
young = 1e8
poisson = 0.25
restitution = 0.35
friction = 0.6
rolling_friction = 0.5
rolling = "spring"
rolling_damping = 0.3
[dem]
steps_per_contact = 30.0
[output]
interval = 0.1
"""
STUDY = f"""scene = "fall.toml"
[[release]]
line = [[8.0, 20.0], [8.0, 180.0]]
height = {HEIGHT}
count = 1000
"""


def noise(octave, i, j):
    """Numbers from -1 to 1, those of dem-solver/src/terrain/slope.rs for seed 5."""
    word = np.uint64
    x = word(5) ^ (i.astype(word) << word(32)) ^ (j.astype(word) << word(8)) ^ word(octave)
    for _ in range(3):
        x = x + word(0x9E3779B97F4A7C15)
        x = (x ^ x >> word(30)) * word(0xBF58476D1CE4E5B9)
        x = (x ^ x >> word(27)) * word(0x94D049BB133111EB)
        x ^= x >> word(31)
    return (x >> word(11)).astype(float) / 2.0**52 - 1.0


def write_slope(path, spacing):
    """400 m x 200 m, falls 200 m over four benches: that of dem-solver/examples/trajectories.rs, each so many points."""
    i, j = np.meshgrid(np.arange(1001), np.arange(501)[::-1])
    along = np.minimum(i / 1000 / 0.75, 1.0)
    wave = 0.9 * np.sin(8 * np.pi * along) / (8 * np.pi)
    z = 200.0 * (1.0 - np.clip(along - wave, 0.0, 1.0)) ** 1.5
    for octave in range(5):
        cell = 2 << octave
        u, v = (t * t * (3.0 - 2.0 * t) for t in (i % cell / cell, j % cell / cell))
        low, high = (
            noise(octave, i // cell, j // cell + up) * (1.0 - u) + noise(octave, i // cell + 1, j // cell + up) * u
            for up in (0, 1)
        )
        z += 0.08 / np.sqrt(5 * 0.55 / 3) * (low * (1.0 - v) + high * v)
    z = z[:: round(spacing / 0.4), :: round(spacing / 0.4)]
    head = f"ncols {z.shape[1]}\nnrows {z.shape[0]}\nxllcenter 0\nyllcenter 0\ncellsize {spacing}\nNODATA_value -9999"
    np.savetxt(path, z, fmt="%.3f", header=head, comments="")


def ours(given, number):
    """Members, processor seconds of the whole process."""
    out = given.work / f"ours{number}"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [given.bin / "rockfall", "ensemble", given.work / "study.toml", "--threads", "1", "--force", "--quiet", "--out", out]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    rows = list(csv.DictReader(open(out / "members.csv")))
    return rows, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, required=True, help="where rockfall is")
    parser.add_argument("--work", type=Path, required=True, help="where everything is written")
    parser.add_argument("--spacing", type=float, default=0.4, help="of the raster [m], a multiple of 0.4 [default: 0.4]")
    parser.add_argument("--rocks", type=int, default=20, help="rocks in each of PlatRock's three turns [default: 20]")
    given = parser.parse_args()
    given.work.mkdir(parents=True, exist_ok=True)
    slope = given.work / "slope.asc"
    write_slope(slope, given.spacing)
    (given.work / "fall.toml").write_text(SCENE)
    (given.work / "study.toml").write_text(STUDY)

    import shapely.geometry
    from platrock.Common import BounceModels, Debug
    from platrock.ThreeD import Objects, Simulations

    # What rocks do to trees is a table from the network; there are no trees here.
    BounceModels.Toe_Tree_2022.__init__ = lambda self: None
    Debug.init(Debug.ERROR)
    clock = time.process_time()
    terrain = Objects.Terrain(DEM_asc=str(slope))
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"PlatRock has read {len(terrain.faces)} triangles in {time.process_time() - clock:.1f} s, {used:.0f} MB", flush=True)

    class Simulation(Simulations.Simulation):
        """With the releases of ours; the clock runs from the first rock to the last."""

        def before_run_tasks(self):
            super().before_run_tasks()
            self.clock = time.process_time()

        def after_successful_run_tasks(self):
            self.clock = time.process_time() - self.clock
            super().after_successful_run_tasks()

        def pick_rock_start_xy(self):
            row = self.starts[self.current_rock_number]
            # Its origin is the corner of the first cell, ours the middle.
            return tuple(float(row[name]) + given.spacing / 2 for name in ["x_m", "y_m"])

        def setup_rock_kinematics(self):
            super().setup_rock_kinematics()
            self.current_rock.vel[:] = VELOCITY

    volume = 4 / 3 * np.pi * RADIUS**3
    zone = {"number": given.rocks, "z": HEIGHT, "density": DENSITY, "vz": VELOCITY[2]}
    zone |= {"rocks_min_vol": volume, "rocks_max_vol": volume, "rocks_volumes": [volume] * given.rocks}
    speeds = []
    for number in (1, 2, 3):
        rows, spent = ours(given, number)
        lengths = [float(row["run_out_m"]) for row in rows]
        fastest = max(float(row["max_speed_m_per_s"]) for row in rows)
        print(f"ours     {len(rows) / spent:8.2f} rocks/s, run-out {np.quantile(lengths, [0.1, 0.5, 0.9]).round()} m, at most {fastest:.0f} m/s")
        its = Simulation(terrain=terrain, gravity=9.81, random_seed=number)
        its.starts = rows[(number - 1) * given.rocks : number * given.rocks]
        its.override_rebound_params = True
        for name, value in BOURRIER.items():
            setattr(its, f"override_{name}", value)
        its.rocks_start_params = [{"shapely_polygon": shapely.geometry.box(0, 0, 1, 1), "params": zone}]
        its.run()
        assert its.status == "finished", its.status
        paths = [its.output.get_contacts_pos(k) for k in range(given.rocks)]
        lengths = [np.hypot(*(path[-1] - path[0])[:2]) for path in paths]
        fastest = max(np.linalg.norm(contacts[:, 4:7], axis=1).max() for contacts in its.output.contacts)
        print(
            f"PlatRock {given.rocks / its.clock:8.2f} rocks/s, run-out {np.quantile(lengths, [0.1, 0.5, 0.9]).round()} m, at most {fastest:.0f} m/s,"
            f" {np.mean([len(path) - 2 for path in paths]):.0f} impacts",
            flush=True,
        )
        speeds.append([len(rows) / spent, given.rocks / its.clock])
    print("medians, rocks/s: ours {:.2f}, PlatRock {:.2f}".format(*np.median(speeds, axis=0)))


if __name__ == "__main__":
    main()
