"""Chant Sura: calibrate the ground on the impacts of one half of the measured runs, predict those of the other.

    git clone https://github.com/ofuhrer/rust_rockfall
    python docs/measured/chant_sura.py --data rust_rockfall --work out/measured --points 10 0 0 --of 12 --members 8 8

That repository derived its files (data/processed/chant_sura_2020) from Caviezel et al. (2020), Induced Rockfall Dataset #2 (Chant Sura),
EnviDat, doi:10.16904/envidat.174, WSL Data Policy: nothing of it is part of this project. The table of six impacts is of Caviezel et al.
(2019), Earth Surf. Dynam. 7, 199, CC BY 4.0. The studies and the results go to `out/measured/chant_sura`.

The terrain that is there is 4.7 m wide and 7.7 m long, so that no run stays on it: each impact is computed by itself, from the measured
velocity and spin before it, in many orientations. Speeds after it are compared at the height of the touch, as free flight has it:
v^2 + 2 g (z - z of the touch) is the same where the rock took off and farther on.
"""

import csv
import math

import falls
import numpy as np
from falls import Range

SPHERES = 32
DENSITY = 2670.0  # of the rocks [kg/m3], as the repository has it
FORMS = {"W": "221", "e": "111"}  # the wheel and the cube, by the letter in a run's name
LEAST = 0.5  # m: from the touch to the circle where the computed rock is taken, at least; measured take-offs are at 0.1 to 0.9 m
SCAR = 2.0  # m: the same for the table, that has no take-off; scars there were 1.4 to 1.8 m long (Lu et al. 2019)
GRAVITY = 9.81
QUANTITIES = ("speed", "jump", "rotation")

RANGES = {
    "friction": Range(0.1, 0.9),
    "restitution": Range(0.1, 0.7),
    "ground_modulus": Range(3e6, 1e8, proportional=True),
    "scarring_drag": Range(0.0, 3.0),
}

SCENE = """# An impact at Chant Sura.
end_time = 0.5
gravity = {gravity}

[[rock]]
position = {position}
mass = {mass}
velocity = {velocity}
angular_velocity = {spin}
shape = {{ type = "norm_rock", form = "{form}", volume = {volume} }}
cluster.{cluster}

[terrain]
file = "{terrain}"

[[contact]]
preset = "meadow"
rolling = "spring"
rolling_friction = 0.1
rolling_damping = 0.3

[dem]
steps_per_contact = 25

[limits]
penetration = 1.0
"""


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def numbers(row, *keys):
    return np.array([float(row[key] or "nan") for key in keys])


class Crop:
    """The terrain: a grid, heights at its places, linear between them."""

    def __init__(self, path):
        lines = path.read_text().splitlines()
        head = {line.split()[0].lower(): float(line.split()[1]) for line in lines[:6]}
        self.cell = head["cellsize"]
        self.corner = np.array([head["xllcorner"], head["yllcorner"]]) + self.cell / 2
        self.heights = np.array([line.split() for line in lines[6:] if line.strip()], dtype=float)[::-1]

    def height(self, places):
        """Height of the ground [m]; nan beside it."""
        at = (np.asarray(places)[..., :2] - self.corner) / self.cell
        i, j = np.floor(at[..., 0]).astype(int), np.floor(at[..., 1]).astype(int)
        inside = (i >= 0) & (j >= 0) & (i < self.heights.shape[1] - 1) & (j < self.heights.shape[0] - 1)
        i, j, u, v = np.where(inside, i, 0), np.where(inside, j, 0), at[..., 0] - i, at[..., 1] - j
        z = self.heights
        found = (1 - v) * ((1 - u) * z[j, i] + u * z[j, i + 1]) + v * ((1 - u) * z[j + 1, i] + u * z[j + 1, i + 1])
        return np.where(inside, found, math.nan)

    def jump(self, place, velocity, height):
        """Largest height over the ground [m] of a flight from a place that is `height` above it, as far as this terrain goes."""
        time = np.linspace(0.0, 2.0, 401)[:, None]
        way = place + time * velocity + [0.0, 0.0, -GRAVITY / 2] * time**2
        gap = way[:, 2] - self.height(way)
        gap += height - gap[0]
        ends = np.flatnonzero(~np.isfinite(gap) | ((gap < 0.0) & (time[:, 0] > 0.05)))
        return float(np.max(gap[: ends[0] if len(ends) else None], initial=0.0))


def at_touch(velocity, rise):
    """Speed at the height of the touch of what flies `rise` [m] above it [m/s]."""
    return math.sqrt(max(float(velocity @ velocity) + 2.0 * GRAVITY * rise, 0.0))


def read(folder, crop):
    """Impacts on the terrain. The first of a run is that after the release."""
    found = []
    for part in ("extended", "heldout"):
        rows = table(folder / f"observed_trajectories_contact_{part}.csv")
        first = {row["segment_id"]: row for row in reversed(rows)}
        last = {row["segment_id"]: row for row in rows}
        for event in table(folder / f"observed_contact_events_{part}.csv"):
            before, after = last[event["source_segment_id"]], first[event["next_segment_id"]]
            touch, start = (numbers(row, "x_m", "y_m", "raw_z_m") for row in (before, after))
            velocity, leaving = (numbers(row, "vx_mps", "vy_mps", "vz_mps") for row in (before, after))
            spin = numbers(before, *(f"omega_{axis}_radps" for axis in "xyz"))
            if not np.isfinite(crop.height(touch)):
                continue
            found.append(
                {
                    "name": event["event_id"],
                    "run": event["source_trajectory_id"],
                    "later": not event["source_segment_id"].endswith("seg00"),
                    "form": FORMS[event["source_trajectory_id"][4]],
                    "mass": round(float(event["mass_kg"])),
                    "touch": touch,
                    "velocity": velocity,
                    "spin": spin if np.all(np.isfinite(spin)) else np.zeros(3),
                    "distance": max(float(np.hypot(*(start - touch)[:2])), LEAST),
                    "speed": at_touch(leaving, start[2] - touch[2]),
                    "jump": crop.jump(start, leaving, 0.0),
                    "rotation": float(after["rotational_j"] or "nan"),
                }
            )
    runs = sorted({it["run"] for it in found if it["later"]})
    for it in found:
        it["half"] = "ab"[runs.index(it["run"]) % 2] if it["later"] else "first"
    return found


def read_table(path):
    """The six impacts of the article, on a plane: z is along its normal. Directions before are a guess of the repository."""
    found = []
    for row in table(path):
        normal, tangent, speed = numbers(row, "incoming_normal_speed_mps", "incoming_tangent_speed_mps", "incoming_total_speed_mps")
        found.append(
            {
                "name": "table_" + row["impact_id"],
                "half": "table",
                "form": "221",
                "mass": 780,
                "touch": np.array([5.0, 5.0, 0.0]),
                "velocity": np.array([tangent, 0.0, -normal]),
                "spin": np.zeros(3),
                "distance": SCAR,
                "speed": speed * math.sqrt(float(row["published_energy_transition_ratio"])),
            }
        )
    return found


class Site:
    """The impacts, and a study of each."""

    def __init__(self, given):
        self.given = given
        self.work = given.work / "chant_sura"
        self.work.mkdir(exist_ok=True)
        folder = given.data / "data/processed/chant_sura_2020"
        terrain = (folder / "terrain_rf16_contact_extended.asc").resolve()
        self.crop = Crop(terrain)
        plane = (self.work / "plane.asc").resolve()
        rows = "\n".join(" ".join(["0"] * 41) for _ in range(11))
        plane.write_text(f"ncols 41\nnrows 11\nxllcenter 0\nyllcenter 0\ncellsize 1\nNODATA_value -9999\n{rows}\n")
        self.impacts = read(folder, self.crop)
        self.impacts += read_table(given.data / "calibration/data/scarring_single_impact/chant_sura_esurf_2019_impacts.csv")
        spheres = {}
        for it in self.impacts:
            path, kind = self.work / f"{it['name']}.toml", (it["form"], it["mass"])
            flat = it["half"] == "table"
            slope = math.radians(30.0) if flat else 0.0  # assumed: an impact is over before gravity does much
            what = {
                "gravity": [GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope)],
                "position": (it["touch"] + [0.0, 0.0, 5.0]).tolist(),
                "mass": it["mass"],
                "velocity": it["velocity"].tolist(),
                "spin": it["spin"].tolist(),
                "form": it["form"],
                "volume": it["mass"] / DENSITY,
                "terrain": plane if flat else terrain,
            }
            if kind not in spheres:
                path.write_text(SCENE.format(cluster=f"spheres = {SPHERES}", **what))
                spheres[kind] = falls.spheres(given, path)
            path.write_text(SCENE.format(cluster=f'file = "{spheres[kind]}"', **what))

    def computed(self, it, values, members, name):
        """Of each orientation what it has at the circle; a rock that does not come so far has no speed. How many are not to be trusted."""
        path = self.work / f"{name}-{it['name']}.toml"
        angles = np.linspace(0.0, 2.0 * math.pi, 37)
        circle = it["touch"][:2] + it["distance"] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        release = {"points": [it["touch"][:2].tolist()], "count": members}
        vary = {"orientation": "uniform"} | {f"contact.0.{key}": value for key, value in values.items()}
        falls.study(path, f"{it['name']}.toml", [release], vary, [{"name": "circle", "points": circle.tolist()}])
        rows = falls.ensemble(self.given, path)
        good = {row["member"]: float(row["z_m"]) for row in rows if row["status"] == "done"}
        found = {row: dict.fromkeys(QUANTITIES, 0.0) for row in good}
        for row in reversed(table(path.with_suffix("") / "lines/circle.csv")):  # the first crossing counts
            if row["member"] in good:
                place, velocity = numbers(row, "x_m", "y_m", "z_m"), numbers(row, *(f"v{axis}_m_per_s" for axis in "xyz"))
                flat = it["half"] == "table"
                jump = 0.0 if flat else self.crop.jump(place, velocity, float(row["passing_height_m"]))
                speed = float(np.linalg.norm(velocity)) if flat else at_touch(velocity, place[2] - good[row["member"]])
                found[row["member"]] = {"speed": speed, "jump": jump, "rotation": float(row["rotation_energy_J"])}
        return {key: [it[key] for it in found.values()] for key in QUANTITIES}, len(rows) - len(good)

    def all(self, half, values, members, name):
        """Each impact with what was computed of it."""
        found = []
        for it in self.impacts:
            if it["half"] == half:
                sample, bad = self.computed(it, values, members, name)
                before = float(np.linalg.norm(it["velocity"]))
                measured = {key: it.get(key) for key in QUANTITIES if it.get(key) is not None and math.isfinite(it[key])}
                found.append({"name": it["name"], "before": before, "measured": measured, "computed": sample, "bad": bad})
        return found

    def cost(self, values):
        """Distance of the medians from what was measured, in shares of the mean that was: speed and jump."""
        found = self.all("a", values, self.given.members[0], "fit")
        shares = {}
        for key in ("speed", "jump"):
            measured = np.array([it["measured"][key] for it in found])
            medians = np.array([np.median(it["computed"][key]) for it in found])
            shares[key] = float(np.mean(np.abs(medians - measured)) / np.mean(measured))
        ratio = [np.median(it["computed"]["speed"]) / it["before"] for it in found]
        return {"cost": float(np.mean(list(shares.values()))), "shares_of": shares, "ratio": float(np.median(ratio)), "bad": sum(it["bad"] for it in found)}


def summary(found):
    """What a table says of a set of impacts; of speeds the ratio after to before."""
    all_of = {}
    for key in QUANTITIES:
        known = [it for it in found if key in it["measured"]]
        if not known:
            continue
        scale = lambda it: it["before"] if key == "speed" else 1.0
        measured = np.array([it["measured"][key] / scale(it) for it in known])
        samples = [np.array(it["computed"][key]) / scale(it) for it in known]
        every = np.concatenate(samples)
        medians = np.array([np.median(sample) for sample in samples])
        within = [float(np.percentile(sample, 10)) <= value <= float(np.percentile(sample, 90)) for sample, value in zip(samples, measured)]
        all_of[key] = {
            "measured": [float(v) for v in measured],
            "medians": [float(v) for v in medians],
            "low_high": [[float(v) for v in np.percentile(sample, (10, 90))] for sample in samples],
            "measured_quantiles": falls.quantiles(measured),
            "computed_quantiles": falls.quantiles(every),
            "off": float(np.mean(np.abs(medians - measured))),
            "bias": float(np.mean(medians - measured)),
            "within": int(sum(within)),
            "grid": [float(v) for v in np.percentile(every, falls.GRID)],
        }
    return {"impacts": len(found), "bad": sum(it["bad"] for it in found), "of": all_of}


def main():
    given = falls.arguments("a clone of rust_rockfall")
    site = Site(given)
    tried = falls.calibrate(RANGES, site.cost, given.points, site.work / "tried.json", of=given.of)
    best = tried[0]["values"]
    result = {"site": "chant_sura", "values": best, "costs": [it["cost"] for it in tried], "fit": {}, "preset": {}}
    result["deciding"] = falls.deciding(tried, given.points, lambda it: it["ratio"])
    for half in ("b", "table", "a", "first"):
        for case, values in (("fit", best), ("preset", {})):
            result[case][half] = summary(site.all(half, values, given.members[1], case + "-final"))
            falls.write(given.work / "chant_sura.json", result)


if __name__ == "__main__":
    main()
