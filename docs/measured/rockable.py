"""Authume quarry, code against code: the published runs of Rockable, and our falls from the same drops.

    git clone https://github.com/richefeu/AuthumeQuarryRockfalls_Data-in-Brief
    python docs/measured/rockable.py --data AuthumeQuarryRockfalls_Data-in-Brief --work out/measured --points 14 6 4 --of 16 --members 3 8

Rockable (Richefeu et al.) is a discrete element code for rounded polyhedra. Its 2 048 runs: two places, four drops at each, four shapes, 64
orientations, 19 s, one row each 0.1 s. Each of our falls has drop, shape, mass and orientation of one of them. The ground parameters of
these runs are not published with them, so ours are calibrated on the drops 1 and 2 and predict 3 and 4. `--members`: orientations of each
drop and shape in the calibration, and in what is reported. Everything goes to `out/measured/rockable`. Nothing of it is part of this project.
"""

import csv
import subprocess
from concurrent.futures import ThreadPoolExecutor

import falls
import numpy as np
from authume import PROFILES, Ground, surface, upright
from falls import Range

SHAPES = ("SP1A", "SP2A", "SP2B", "SP3A")
SPHERES = 32
STEP, ROWS, GRAVITY = 0.1, 191, 9.81
MOVING = 0.05  # m/s: a slower rock counts as stopped
HALVES = {"a": (1, 2), "b": (3, 4)}
LINE = {"P1": 15.0, "P2": 30.0}  # m from the middle of the drops, seen from above
CELL = 0.25  # of the raster of heights [m]
QUANTITIES = {
    "run_out": "run-out after 19 s [m]",
    "speed": "largest speed [m/s]",
    "speed_2": "speed after 2 s [m/s]",
    "speed_4": "speed after 4 s [m/s]",
    "energy": "largest energy of translation [kJ]",
    "height": "largest height of the centre after the first touch [m]",
    "spin": "largest spin [rad/s]",
    "force": "largest force of contact, mean of 0.1 s [kN]",
    "line_speed": "speed at the line [m/s]",
    "rim": "speed of the rim over that of the centre after 4 s, of rocks above 1 m/s: 1 where a ball rolls, 0 where a rock slides",
}
JUDGED = ("run_out", "line_speed")  # what the calibration looks at, beside the share that passes the line

RANGES = {
    f"{zone}.{key}": it
    for zone in (0, 1)
    for key, it in (
        ("restitution", Range(0.05, 0.4)),
        ("friction", Range(0.3, 1.2)),
        ("rolling_friction", Range(0.05, 0.6)),
        ("rolling_friction_impact", Range(0.2, 2.0)),
    )
}


SCENE = """# A block of the Authume quarry, of the shape {shape}, as Rockable dropped it.
end_time = 19.0
gravity = [0.0, 0.0, -9.81]

[[rock]]
position = [0.0, -290.0, 230.0]
orientation = [1.0, 0.0, 0.0, 0.0]
mass = {mass}
shape = {{ type = "mesh", file = "{mesh}", close_holes = true }}
cluster.{cluster}

[terrain]
file = "terrain.obj"
zones = "zones.asc"
material = "hard"
rest_speed = 0.05
[[terrain.zone]]
number = 1
material = "vegetated"

[[contact]]
between = ["rock", "vegetated"]
{law}
[[contact]]
between = ["rock", "hard"]
{law}
[output]
interval = 0.1
"""
# `rolling_friction_impact` takes the place of Rockable's resistance in each contact, which acts in impacts too.
LAW = """law = "hertz_rock"
young = 3e8
poisson = 0.25
restitution = 0.2
friction = 0.5
rolling_friction = 0.1
rolling_friction_impact = 0.1
"""

class Heights:
    """Heights of the ground in a raster, for many places at once."""

    def __init__(self, ground):
        corners = ground.triangles.reshape(-1, 3)
        self.low = corners[:, :2].min(axis=0)
        counts = np.ceil((corners[:, :2].max(axis=0) - self.low) / CELL).astype(int) + 1
        self.raster = np.full(counts, np.nan)
        for a, b, c in ground.triangles:
            first = np.ceil((np.minimum(np.minimum(a, b), c)[:2] - self.low) / CELL).astype(int)
            last = np.floor((np.maximum(np.maximum(a, b), c)[:2] - self.low) / CELL).astype(int)
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if area == 0.0:
                continue
            i, j = np.meshgrid(np.arange(first[0], last[0] + 1), np.arange(first[1], last[1] + 1), indexing="ij")
            x, y = self.low[0] + CELL * i - a[0], self.low[1] + CELL * j - a[1]
            u = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / area
            v = ((b[0] - a[0]) * y - (b[1] - a[1]) * x) / area
            inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
            z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
            self.raster[i[inside], j[inside]] = np.fmax(self.raster[i[inside], j[inside]], z[inside])

    def __call__(self, places):
        i, j = np.round((places[..., :2] - self.low) / CELL).astype(int).reshape(-1, 2).T
        good = (i >= 0) & (j >= 0) & (i < self.raster.shape[0]) & (j < self.raster.shape[1])
        found = np.full(len(i), np.nan)
        found[good] = self.raster[i[good], j[good]]
        return found.reshape(places.shape[:-1])

def turned(q):
    """An orientation of theirs, y up, as one of ours."""
    half = np.sqrt(0.5)
    w, x, y, z = q
    return [float(half * v) for v in (w - x, x + w, y - z, z + y)]

class Site:
    def __init__(self, given):
        self.given, self.work = given, given.work / "rockable"
        self.work.mkdir(exist_ok=True)
        self.ground = Ground(given.data / "Geometries/STL")
        self.ground.write(self.work / "terrain.obj", self.work / "zones.asc")
        self.heights = Heights(self.ground)
        self.theirs = self.read()
        volume = lambda path: abs(np.linalg.det(surface(path)).sum()) / 6
        self.radius = {shape: np.cbrt(0.75 / np.pi * volume(given.data / f"Geometries/STL/{shape}.stl")) for shape in SHAPES}
        drops = lambda p: np.array([run["place"][0] for key, run in self.theirs.items() if key[0] == p])
        self.middle = {p: drops(p).mean(axis=0) for p in PROFILES}
        for shape in SHAPES:
            path = self.work / f"{shape}.toml"
            mesh = (given.data / f"Geometries/STL/{shape}.stl").resolve()
            scene = lambda cluster: SCENE.format(shape=shape, mesh=mesh, mass=self.mass[shape], cluster=cluster, law=LAW)
            path.write_text(scene(f"spheres = {SPHERES}"))
            path.write_text(scene(f'file = "{falls.spheres(given, path)}"'))

    def read(self):
        """Their runs by profile, shape, drop and orientation: rows of position, velocity, spin and orientation, in our axes."""
        cache = self.work / "theirs.npz"
        if not cache.exists():
            runs = {}
            for path in sorted(self.given.data.glob("SIM_Trajectories/*/*/*/*.txt")):
                profile, shape, drop, turn = path.parts[-4:]
                runs["/".join([profile, shape, drop[-1], path.stem.split("_")[1]])] = np.loadtxt(path)[:ROWS].astype("f4")
            np.savez_compressed(cache, **runs)
        found, self.mass = {}, {}
        with np.load(cache) as runs:
            for name, table in ((name, runs[name].astype(float)) for name in runs):
                profile, shape, drop, turn = name.split("/")
                self.mass[shape] = round(float(-table[0, 15] / GRAVITY), 3)
                parts = {"place": upright(table[:, 1:4]), "velocity": upright(table[:, 4:7]), "spin": upright(table[:, 11:14])}
                found[profile, shape, int(drop), int(turn)] = parts | {"orientation": turned(table[0, 7:11])}
        return found

    def fall(self, key, values, folder):
        """One of ours, from the drop of theirs; nothing if it cannot be trusted."""
        profile, shape, drop, turn = key
        first = self.theirs[key]
        out = folder / "-".join(map(str, key))
        table = out / "history.csv"
        command = [self.given.rockfall, "run", self.work / f"{shape}.toml", "--out", out, "--quiet", "--force"]
        sets = {"rock.0.position": first["place"][0].tolist(), "rock.0.orientation": first["orientation"]}
        for name, value in values.items():
            sets[f"contact.{name}"] = value
        for name, value in sets.items():
            command += ["--set", f"{name}={falls.text(value)}"]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        return self.rows(table) if done.returncode == 0 else None

    @staticmethod
    def rows(table):
        """A run of ours, of its history."""
        with open(table, newline="") as file:
            rows = list(csv.DictReader(file))
        of = lambda *names: np.array([[float(row[f"rock_{name}"]) for name in names] for row in rows])
        parts = {
            "place": of("x_m", "y_m", "z_m"),
            "velocity": of("vx_m_per_s", "vy_m_per_s", "vz_m_per_s"),
            "spin": of("wx_rad_per_s", "wy_rad_per_s", "wz_rad_per_s"),
        }
        ended = max(ROWS - len(rows), 0)  # a rock at rest ends its run, one that has left the terrain too
        left = ended > 0 and np.linalg.norm(parts["velocity"][-1]) > 0.2
        for name, table in parts.items():
            still = table[-1:] if name == "place" else 0.0 * table[-1:]
            parts[name] = np.concatenate([table] + [still] * ended)[:ROWS]
        return parts | {"left": left}

    def seen(self, key, run):
        """The quantities of a run."""
        place, velocity = run["place"], run["velocity"]
        speed = np.linalg.norm(velocity, axis=1)
        way = np.hypot(*(place - place[0])[:, :2].T)
        force = np.linalg.norm(np.diff(velocity, axis=0) / STEP + [0, 0, GRAVITY], axis=1)
        touched = np.argmax(force > 1.0) + 1
        height = (place[:, 2] - self.heights(place))[touched:]
        far = np.hypot(*(place - self.middle[key[0]])[:, :2].T)
        at = np.argmax(far >= LINE[key[0]])
        return {
            "run_out": way[-1],
            "speed": speed.max(),
            "speed_2": speed[20],
            "speed_4": speed[40],
            "energy": 0.5e-3 * self.mass[key[1]] * speed.max() ** 2,
            "height": np.nanmax(height) if np.isfinite(height).any() else np.nan,
            "spin": np.linalg.norm(run["spin"], axis=1).max(),
            "force": 1e-3 * self.mass[key[1]] * force[touched - 1 :].max(),
            "line_speed": speed[at] if far[at] >= LINE[key[0]] else np.nan,
            "rim": np.linalg.norm(run["spin"][40]) * self.radius[key[1]] / speed[40] if speed[40] > 1.0 else np.nan,
            "stopped": float(speed[-1] < MOVING),
            "first": touched * STEP,
        }

    def beside_measured(self, profile):
        """Run-outs of all of theirs against all that were measured."""
        ends = upright(np.loadtxt(self.given.data / f"EXP_endpoints/Endpoints_{profile}.txt")[:, :3])
        return falls.compare(
            np.hypot(*(ends - self.middle[profile])[:, :2].T),
            np.array([np.hypot(*(run["place"][-1] - self.middle[profile])[:2]) for key, run in self.theirs.items() if key[0] == profile]),
        )

    def samples(self, half, values=None, turns=64, name=""):
        """Quantities of all runs of a half by profile: theirs, or ours with these values, with so many orientations evenly among the 64."""
        chosen = set(np.round(np.linspace(1, 64, turns)).astype(int).tolist())
        keys = [key for key in self.theirs if key[2] in HALVES[half] and (values is None or key[3] in chosen)]
        folder = self.work / f"falls-{name or half}"
        one = lambda key: self.theirs[key] if values is None else self.fall(key, values, folder)
        with ThreadPoolExecutor(1 if values is None else self.given.threads) as pool:
            runs = list(pool.map(one, keys))
        failed = sum(run is None for run in runs)
        found = {p: [(key, self.seen(key, run)) for key, run in zip(keys, runs) if run is not None and key[0] == p] for p in PROFILES}
        left = int(sum(run.get("left", False) for run in runs if run is not None))
        return found, failed, left

    def quick(self, values, turns):
        """What the calibration needs, by `rockfall ensemble`, which reads the terrain once: orientations are drawn, nothing is known between the ends."""
        vary = {"orientation": "uniform"} | {f"contact.{name}": value for name, value in values.items()}
        found = {p: {key: [] for key in (*JUDGED, "passing")} for p in PROFILES}
        for profile in PROFILES:
            turn = np.linspace(-np.pi, np.pi, 49)
            line = self.middle[profile][:2] + LINE[profile] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
            for shape in SHAPES:
                releases = []
                for drop in HALVES["a"]:
                    place = self.theirs[profile, shape, drop, 1]["place"][0]
                    height = float(place[2] - self.heights(place)) - 0.4
                    releases.append({"name": f"drop-{drop}", "points": [place[:2].tolist()], "height": round(height, 3), "count": turns})
                path = self.work / f"fit-{profile}-{shape}.toml"
                falls.study(path, f"{shape}.toml", releases, vary, [{"name": "line", "points": line.round(3).tolist()}])
                rows = [row for row in falls.ensemble(self.given, path) if row["status"] == "done"]
                starts, ends, _ = falls.places(rows)
                found[profile]["run_out"] += np.hypot(*(ends - starts).T).tolist()
                with open(path.with_suffix("") / "lines/line.csv", newline="") as file:
                    first = {}
                    for row in csv.DictReader(file):
                        first.setdefault(row["member"], float(row["speed_m_per_s"]))
                found[profile]["line_speed"] += first.values()
                found[profile]["passing"] += [1.0] * len(first) + [0.0] * (len(rows) - len(first))
        return found

    def cost(self, values):
        found = self.quick(values, self.given.members[0])
        costs = {}
        for profile in PROFILES:
            for key in JUDGED:
                their = [it[key] for _, it in self.their_a[profile] if np.isfinite(it[key])]
                mine = found[profile][key]
                costs[f"{profile} {key}"] = falls.kolmogorov_smirnov(np.array(their), np.array(mine))[0] if mine else 1.0
            share = np.mean([np.isfinite(it["line_speed"]) for _, it in self.their_a[profile]])
            costs[f"{profile} passing"] = float(abs(share - np.mean(found[profile]["passing"])))
        medians = {p: float(np.median(found[p]["run_out"])) for p in PROFILES}
        return {"cost": float(np.mean(list(costs.values()))), "costs": costs, "medians": medians, "falls": {p: len(found[p]["run_out"]) for p in PROFILES}}


def main():
    given = falls.arguments("a clone of AuthumeQuarryRockfalls_Data-in-Brief")
    site = Site(given)
    site.their_a, _, _ = site.samples("a")
    tried = falls.calibrate(RANGES, site.cost, given.points, site.work / "tried.json", of=given.of)
    best = tried[0]["values"]
    result = {"site": "rockable", "values": best, "costs": [it["cost"] for it in tried], "calibrated": tried[0], "fit": {}}
    result["deciding"] = {p: falls.deciding(tried, given.points, lambda it: it["medians"][p]) for p in PROFILES}
    result["measured"] = {p: site.beside_measured(p) for p in PROFILES}
    for half in "ba":
        their, _, _ = site.samples(half)
        ours, failed, left = site.samples(half, best, given.members[1], f"final-{half}")
        table = {"failed": failed, "left": left}
        for profile in PROFILES:
            of = lambda rows, key: np.array([it[key] for _, it in rows if np.isfinite(it[key])])
            table[profile] = {key: falls.compare(of(their[profile], key), of(ours[profile], key)) for key in QUANTITIES}
            table[profile]["stopped"] = [float(np.mean(of(rows, "stopped"))) for rows in (their[profile], ours[profile])]
            table[profile]["passing"] = [[len(of(rows, "line_speed")), len(rows)] for rows in (their[profile], ours[profile])]
            same = dict(their[profile])
            pairs = [(same[key], it) for key, it in ours[profile]]
            table[profile]["first_touch_off"] = falls.quantiles([b["first"] - a["first"] for a, b in pairs])
            ranks = [falls.rank([it[k]["run_out"] for it in pairs]) for k in (0, 1)]
            table[profile]["rank_correlation"] = float(np.corrcoef(*ranks)[0, 1])
        result["fit"][half] = table
        falls.write(given.work / "rockable.json", result)

if __name__ == "__main__":
    main()
