"""Authume quarry: calibrate the ground on one half of the measured falls, predict the other.

    git clone https://github.com/richefeu/AuthumeQuarryRockfalls_Data-in-Brief
    python docs/measured/authume.py --data AuthumeQuarryRockfalls_Data-in-Brief --work out/measured --points 16 8 4 --members 1 3 --again 6 3

That repository states no licence: nothing of it is part of this project. Its y axis points up. The studies and the results go to
`out/measured/authume`.
"""

import math

import falls
import numpy as np
from falls import Range

SPHERES = 32
CELL = 0.25  # of the raster of zones [m]
DENSITY = 2650.0  # of the blocks [kg/m3], assumed; their masses are measured
SHAPES = ("SP1A", "SP2A", "SP3A")  # blocks of the site that were scanned; SP2B is SP2A in another size
PROFILES = ("P1", "P2")
# Zone of the terrain model, and its number in the raster. The rocky slope has the ground of the hard surfaces.
ZONES = (("Blue", 1), ("Gray", 0), ("Red", 0))

# What is calibrated, and within which bounds: table of contact (0 vegetated, 1 hard) and key.
RANGES = {
    f"{zone}.{key}": it
    for zone in (0, 1)
    for key, it in (
        ("friction", Range(0.1, 0.8)),
        ("restitution", Range(0.1, 0.6)),
        ("rolling_friction", Range(0.05, 0.5)),
        ("rolling_friction_impact", Range(0.0, 1.5)),
    )
}

SCENE = """# A block of the Authume quarry, of the shape {shape}.
end_time = 60.0
gravity = [0.0, 0.0, -9.81]

[[rock]]
position = {position}
density = {density}
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
preset = "meadow"
{rolling}
[[contact]]
between = ["rock", "hard"]
preset = "scree"
{rolling}
[dem]
steps_per_contact = 25

[limits]
penetration = 1.0
"""

ROLLING = """rolling = "spring"
rolling_friction = 0.1
rolling_damping = 0.3
"""


def upright(points):
    """Their axes to ours: y up to z up."""
    points = np.asarray(points, dtype=float)
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def surface(path):
    """Triangles of an STL file in text."""
    with open(path) as file:
        corners = [line.split()[1:] for line in file if line.split()[:1] == ["vertex"]]
    return upright(np.array(corners, dtype=float).reshape(-1, 3, 3))


class Ground:
    """Terrain model: triangles, and the number of the zone of each."""

    def __init__(self, folder):
        parts = [surface(folder / f"DTM_{zone}_zone.stl") for zone, _ in ZONES]
        self.triangles = np.concatenate(parts)
        self.numbers = np.concatenate([np.full(len(part), number) for part, (_, number) in zip(parts, ZONES)])

    def write(self, surface, zones):
        """A surface with corners that are shared, and the raster of the zones."""
        corners, order = np.unique(self.triangles.reshape(-1, 3).round(4), axis=0, return_inverse=True)
        faces = order.reshape(-1, 3) + 1
        sound = [face for face in faces if len(set(face)) == 3]
        lines = ["v " + " ".join(map(str, corner)) for corner in corners]
        surface.write_text("\n".join(lines + ["f " + " ".join(map(str, face)) for face in sound]) + "\n")
        low, high = corners.min(axis=0)[:2], corners.max(axis=0)[:2]
        counts = np.ceil((high - low) / CELL).astype(int) + 1
        raster = np.zeros((counts[1], counts[0]), int)
        for triangle, number in zip(self.triangles, self.numbers):
            first = np.floor((triangle[:, :2].min(axis=0) - low) / CELL).astype(int)
            last = np.ceil((triangle[:, :2].max(axis=0) - low) / CELL).astype(int) + 1
            i, j = np.meshgrid(np.arange(first[0], last[0]), np.arange(first[1], last[1]))
            i, j = i[(i < counts[0]) & (j < counts[1])], j[(i < counts[0]) & (j < counts[1])]
            a, b, c = triangle[:, :2]
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if area == 0.0:
                continue
            x, y = low[0] + CELL * i - a[0], low[1] + CELL * j - a[1]
            u = (x * (c[1] - a[1]) - y * (c[0] - a[0])) / area
            v = ((b[0] - a[0]) * y - (b[1] - a[1]) * x) / area
            inside = (u >= 0) & (v >= 0) & (u + v <= 1)
            raster[j[inside], i[inside]] = number
        head = f"ncols {counts[0]}\nnrows {counts[1]}\nxllcenter {low[0]}\nyllcenter {low[1]}\ncellsize {CELL}\nNODATA_value -9999\n"
        zones.write_text(head + "\n".join(" ".join(map(str, row)) for row in raster[::-1]) + "\n")

    def height(self, places):
        """Height of the ground at places [m]; nan beside it."""
        a, b, c = (self.triangles[:, k] for k in range(3))
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        found = []
        for x, y in np.asarray(places)[:, :2]:
            with np.errstate(all="ignore"):
                u = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (y - a[:, 1]) * (c[:, 0] - a[:, 0])) / area
                v = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])) / area
            inside = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6) & (area != 0)
            z = (a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2]))[inside]
            found.append(z.max() if len(z) else math.nan)
        return np.array(found)


class Site:
    """Drops, measured ends, and the studies of both halves."""

    def __init__(self, given):
        self.given = given
        self.work = given.work / "authume"
        self.work.mkdir(exist_ok=True)
        table = lambda name: np.loadtxt(given.data / name)
        self.ground = Ground(given.data / "Geometries/STL")
        self.ground.write(self.work / "terrain.obj", self.work / "zones.asc")
        self.drops = {p: upright(table(f"Drop_conditions/positions_{p}.xyz")) for p in PROFILES}
        ends = {p: table(f"EXP_endpoints/Endpoints_{p}.txt") for p in PROFILES}
        self.ends = {(p, half): upright(ends[p][start::2, :3]) for p in PROFILES for start, half in enumerate("ab")}
        self.masses = {half: np.concatenate([ends[p][start::2, 3] for p in PROFILES]) for start, half in enumerate("ab")}
        for shape in SHAPES:
            path = self.work / f"{shape}.toml"
            mesh = (given.data / f"Geometries/STL/{shape}.stl").resolve()
            position = (self.drops["P1"][0] + [0.0, 0.0, 20.0]).tolist()
            scene = lambda cluster, rolling: SCENE.format(
                shape=shape, mesh=mesh, position=position, density=DENSITY, cluster=cluster, rolling=rolling
            )
            path.write_text(scene(f"spheres = {SPHERES}", ROLLING))
            spheres = f'file = "{falls.spheres(given, path)}"'
            path.write_text(scene(spheres, ROLLING))
            (self.work / f"preset-{shape}.toml").write_text(scene(spheres, ""))

    def offset(self, profile):
        """How far the measured ends lie above the terrain model [m]."""
        ends = np.concatenate([self.ends[profile, half] for half in "ab"])
        return ends[:, 2] - self.ground.height(ends)

    def seen(self, profile, ends):
        """Run-out [m], reach angle over the ground [degrees], and distance to the side [m] of ends, from the middle of the drops.

        Heights are those of the ground at both places, for the measured ones lie in a frame of their own.
        """
        ends, middle = np.asarray(ends)[:, :2], self.drops[profile].mean(axis=0)[:2]
        way = ends - middle
        run_out = np.hypot(*way.T)
        fall = self.ground.height([middle])[0] - self.ground.height(ends)
        return {"run_out": run_out, "reach": np.degrees(np.arctan2(fall, run_out)), "side": way[:, 1]}

    def measured(self, profile, half):
        return self.seen(profile, self.ends[profile, half])

    def computed(self, half, values, each, name="fit", scene=""):
        """The same of `each` falls per shape, drop and member of the calibration; how many are not to be trusted or left the terrain."""
        releases = []
        for profile, places in self.drops.items():
            heights = places[:, 2] - self.ground.height(places)
            releases += [
                {"name": f"{profile}-{k}", "points": [place[:2].tolist()], "height": round(float(height) - 0.5, 3), "count": 2 * each}
                for k, (place, height) in enumerate(zip(places, heights))
            ]
        vary = {"orientation": "uniform", "mass": {"choice": self.masses[half].tolist()}}
        vary |= {f"contact.{key}": value for key, value in values.items()}
        rows = []
        for shape in SHAPES:
            path = self.work / f"{name}-{half}-{shape}.toml"
            falls.study(path, f"{scene}{shape}.toml", releases, vary)
            rows += falls.ensemble(self.given, path)
        found, bad, left = {}, 0, 0
        for profile in PROFILES:
            own = [row for row in rows if row["release"].startswith(profile)]
            left += sum(row["ending"] == "left" for row in own)
            _, ends, failed = falls.places(own)
            found[profile], bad = self.seen(profile, ends), bad + failed
        return found, bad, left

    def cost(self, values, each=None):
        found, bad, left = self.computed("a", values, each or self.given.members[0])
        costs = {p: falls.distance(self.measured(p, "a")["run_out"], found[p]["run_out"]) for p in PROFILES}
        shown = {p: falls.quantiles(found[p]["run_out"]) for p in PROFILES}
        return {"cost": float(np.mean(list(costs.values()))), "costs": costs, "quantiles": shown, "bad": bad, "left": left}


def main():
    given = falls.arguments("a clone of AuthumeQuarryRockfalls_Data-in-Brief")
    site = Site(given)
    tried = falls.calibrate(RANGES, site.cost, given.points, site.work / "tried.json", of=given.of)
    deciding = {p: falls.deciding(tried, given.points, lambda it: it["quantiles"][p][1]) for p in PROFILES}
    tried = falls.confirm(tried, site.cost, given.again, site.work / "again.json")
    best = tried[0]["values"]
    result = {"site": "authume", "values": best, "fit": {}, "costs": [it["cost"] for it in tried], "calibrated": tried[0]}
    result["offset"] = {p: falls.quantiles(site.offset(p)) for p in PROFILES}
    result["measured_a"] = {p: falls.quantiles(site.measured(p, "a")["run_out"]) for p in PROFILES}
    result["noise_a"] = {p: falls.noise(site.measured(p, "a")["run_out"]) for p in PROFILES}
    result["deciding"] = deciding
    for case, values, scene in (("b", best, ""), ("preset", {}, "preset-")):
        found, bad, left = site.computed("b", values, given.members[1], f"final-{case}", scene)
        result["fit"][case] = {"bad": bad, "left": left}
        for profile in PROFILES:
            seen = site.measured(profile, "b")
            result["fit"][case][profile] = {key: falls.compare(seen[key], found[profile][key]) for key in seen}
        falls.write(given.work / "authume.json", result)


if __name__ == "__main__":
    main()
