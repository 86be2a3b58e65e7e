"""Draws docs/measured-falls.svg and prints the tables of docs/measured-falls.md, of what the scripts of the sites have written.

    python docs/measured/report.py --work out/measured --picture docs/measured-falls.svg
"""

import argparse
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

MEASURED, COMPUTED, OTHER, PRESET = "black", "#c1272d", "#7f7f7f", "#2b6cb0"
HALVES = {"a": "impacts that were calibrated", "b": "**other half, predicted**", "first": "first impacts of all runs", "table": "table of six, predicted"}


STYLE = {MEASURED: "-", COMPUTED: (0, (5, 1.5)), OTHER: (0, (4, 1.5, 1, 1.5)), PRESET: (0, (1, 1))}  # legible without colours


def curve(axes, sample, colour, label, **style):
    """Share of a sample that is at most so large."""
    sample = np.sort(sample) if len(sample) < 200 else np.percentile(sample, np.linspace(0, 100, 150))  # keeps the file small
    share = np.arange(1, len(sample) + 1) / len(sample)
    axes.step(np.append(sample[0], sample), np.append(0.0, share), where="post", color=colour, label=label, linestyle=STYLE[colour], **style)


def finish(axes, title, quantity, legend):
    axes.set(title=title, xlabel=quantity, ylim=(0, 1.02))
    axes.set_xlim(left=0)
    axes.legend(loc=legend, fontsize=6.5, frameon=False)


def panel(axes, title, fit, more=()):
    """Measured and predicted of the half that was not used."""
    for sample, colour, label in more:
        curve(axes, sample, colour, label, linewidth=1.2)
    curve(axes, fit["computed"], COMPUTED, f"predicted ({len(fit['computed'])})", linewidth=1.6)
    curve(axes, fit["measured"], MEASURED, f"measured ({len(fit['measured'])})", linewidth=1.6)
    for share, (low, high) in zip((0.1, 0.5, 0.9), fit["measured_intervals"]):
        axes.plot([low, high], [share, share], color=MEASURED, linewidth=0.8, marker="|", markersize=5)
    finish(axes, title, "run-out [m]", "upper left")


def impacts(axes, title, key, fit, preset, power=1, quantity=""):
    """The same of impacts: all orientations of all of them against what was measured."""
    curve(axes, np.array(preset["of"][key]["grid"]) ** power, PRESET, "preset meadow", linewidth=1.2)
    curve(axes, np.array(fit["of"][key]["grid"]) ** power, COMPUTED, "predicted, all orientations", linewidth=1.6)
    measured = np.array(fit["of"][key]["measured"]) ** power
    curve(axes, measured, MEASURED, f"measured ({len(measured)})", linewidth=1.6)
    finish(axes, title, quantity, "lower right")


def numbers(values, digits):
    return " / ".join(f"{value:.{digits}f}" for value in values)


def row(name, fit, digits=1):
    spread = " / ".join(f"{a:.{digits}f} to {b:.{digits}f}" for a, b in fit["measured_intervals"])
    return (
        f"| {name} | {len(fit['measured'])} | {numbers(fit['measured_quantiles'], digits)} | {spread} | "
        f"{numbers(fit['computed_quantiles'], digits)} | {fit['distance']:.{digits + 1}f} ({fit['noise']:.{digits + 1}f}) | "
        f"{fit['ks']:.2f} ({fit['ks_probability']:.2g}) |"
    )


HEAD = (
    "| sample | falls | measured 10 / 50 / 90 % | 95 % intervals | computed | distance of the quantiles, and of two measured samples "
    "| KS distance (p) |\n|---|---|---|---|---|---|---|"
)


def values(result, deciding):
    """Calibrated numbers, and the rank correlation of each with the median over the whole range."""
    print("\n| key | calibrated | rank correlation with the median |\n|---|---|---|")
    for name, value in result["values"].items():
        found = [f"{part[name]:+.2f}" if name in part else "of the preset, kept" for part in deciding]
        print(f"| `{name}` | {value:g} | {' / '.join(found)} |")


def tschamut(result):
    print(HEAD)
    print(row("half that was calibrated", result["fit"]["a"]["whole"]))
    print(row("**other half, predicted**", result["fit"]["b"]["whole"]))
    for name, part in result["fit"]["b"]["blocks"].items():
        print(row(f"of these block {name}", part))
    print(row("other half, `preset = \"meadow\"` alone", result["preset"]))
    print("runs:", result["runs"], "not to be trusted:", result["fit"]["a"]["bad"], result["fit"]["b"]["bad"])
    print("share at the cut, preset:", np.mean(np.array(result["preset"]["computed"]) >= max(result["preset"]["computed"])))
    values(result, [result["deciding"]])


def authume(result):
    print(HEAD)
    for profile in ("P1", "P2"):
        best = result["calibrated"]
        made = f"{numbers(best['quantiles'][profile], 1)} | {best['costs'][profile]:.2f} ({result['noise_a'][profile]:.2f})"
        print(f"| {profile} half that was calibrated | | {numbers(result['measured_a'][profile], 1)} | | {made} | |")
        for case, name in (("b", "**other half, predicted**"), ("preset", "other half, presets alone")):
            # What left the terrain has no height, and no reach angle.
            for key in ("run_out", "reach", "side") if result["fit"][case]["left"] == 0 else ("run_out", "side"):
                print(row(f"{profile} {name}: {key}", result["fit"][case][profile][key]))
    print("offset of the ends:", result["offset"], "not to be trusted, left:", [(it["bad"], it["left"]) for it in result["fit"].values()])
    print("costs:", np.round(result["costs"], 2))
    values(result, list(result["deciding"].values()))


def chant_sura(result):
    print(
        "| impacts | quantity | number | measured 10 / 50 / 90 % | computed, all orientations | median off, bias | within 10 to 90 % "
        "| preset: computed, off, bias |\n|---|---|---|---|---|---|---|---|"
    )
    for half, name in [it for it in HALVES.items() if it[0] in result["fit"]]:
        for key, it in result["fit"][half]["of"].items():
            digits, plain = (0 if key == "rotation" else 2), result["preset"][half]["of"][key]
            print(
                f"| {name} | {key} | {len(it['measured'])} | {numbers(it['measured_quantiles'], digits)} | {numbers(it['computed_quantiles'], digits)} | "
                f"{it['off']:.{digits}f}, {it['bias']:+.{digits}f} | {it['within']} | "
                f"{numbers(plain['computed_quantiles'], digits)}, {plain['off']:.{digits}f}, {plain['bias']:+.{digits}f} |"
            )
    print("not to be trusted:", {half: it["bad"] for half, it in result["fit"].items()}, "costs:", np.round(result["costs"], 3))
    values(result, [result["deciding"]])


def codes(axes, title, key, fit, quantity, legend="lower right"):
    """Rockable and ours, at both places of the quarry."""
    for profile, width in (("P1", 0.9), ("P2", 2.0)):
        it = fit[profile][key]
        curve(axes, it["measured"], MEASURED, f"Rockable, {profile} ({len(it['measured'])})", linewidth=width)
        curve(axes, it["computed"], COMPUTED, f"rockfall, {profile} ({len(it['computed'])})", linewidth=width)
    finish(axes, title, quantity, legend)


def rockable(result):
    print("\n| quantity | place | falls: Rockable, ours | Rockable 10 / 50 / 90 % | ours | KS distance (p) | of the calibrated half |\n|---|---|---|---|---|---|---|")
    for key in ("run_out", "speed_2", "speed_4", "speed", "energy", "height", "spin", "force", "line_speed", "rim"):
        for profile in ("P1", "P2"):
            it, other = (result["fit"][half][profile][key] for half in "ba")
            digits = {"force": 0, "energy": 0, "rim": 2}.get(key, 1)
            print(
                f"| {key} | {profile} | {len(it['measured'])}, {len(it['computed'])} | {numbers(it['measured_quantiles'], digits)} | "
                f"{numbers(it['computed_quantiles'], digits)} | {it['ks']:.2f} ({it['ks_probability']:.1g}) | {other['ks']:.2f} |"
            )
    for half in "ba":
        for profile in ("P1", "P2"):
            it = result["fit"][half][profile]
            print(half, profile, {key: it[key] for key in ("stopped", "passing", "first_touch_off", "rank_correlation")}, result["fit"][half]["failed"], result["fit"][half]["left"])
    print(HEAD)
    for profile in ("P1", "P2"):
        print(row(f"{profile}, all runs of Rockable against all that was measured", result["measured"][profile]))
    print("costs:", np.round(result["costs"], 3))
    values(result, list(result["deciding"].values()))


def transfer(result):
    print("\n| predicted | by | 10 / 50 / 90 % | distance (of two measured samples) | KS distance (p) |\n|---|---|---|---|---|")
    for site, table in [("Tschamut", result["tschamut"])] + [(f"Authume {p}", result["authume"][p]) for p in ("P1", "P2")]:
        for name, it in table.items():
            if isinstance(it, dict) and "ks" in it:
                print(f"| {site} | {name} | {numbers(it['computed_quantiles'], 1)} | {it['distance']:.1f} ({it['noise']:.1f}) | {it['ks']:.2f} ({it['ks_probability']:.1g}) |")
    print("not to be trusted, left:", result["tschamut"]["bad"], result["authume"]["bad"], result["authume"]["left"])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--picture", type=Path, required=True)
    given = parser.parse_args()
    plt.rcParams.update({"font.size": 8, "svg.fonttype": "none", "svg.hashsalt": "rockfall"})
    figure, axes = plt.subplots(3, 3, figsize=(10.5, 9.2))
    load = lambda site: json.loads((given.work / f"{site}.json").read_text())

    result = load("tschamut")
    more = [(result["preset"]["computed"], PRESET, "preset meadow"), (result["fit"]["a"]["whole"]["measured"], OTHER, "measured, calibrated half")]
    panel(axes[0, 0], "Tschamut: run-out, the half not used", result["fit"]["b"]["whole"], more)
    tschamut(result)

    result = load("authume")
    for place, profile in zip(axes[0, 1:], ("P1", "P2")):
        case = {name: result["fit"][name][profile]["run_out"] for name in ("b", "preset")}
        more = [(case["preset"]["computed"], PRESET, "presets")]
        panel(place, f"Authume {profile}: run-out, the half not used", case["b"], more)
    authume(result)

    result = load("chant_sura")
    fit, preset = result["fit"], result["preset"]
    impacts(axes[1, 0], "Chant Sura: impacts of the half not used", "speed", fit["b"], preset["b"], quantity="speed after over before")
    impacts(axes[1, 1], "Chant Sura: jumps of the half not used", "jump", fit["b"], preset["b"], quantity="jump height [m]")
    impacts(axes[1, 2], "Chant Sura: six impacts of 780 kg", "speed", fit["table"], preset["table"], 2, "energy of translation after over before")
    chant_sura(result)

    result = load("rockable")
    fit = result["fit"]["b"]
    codes(axes[2, 0], "Rockable: run-out, drops not used", "run_out", fit, "run-out after 19 s [m]")
    codes(axes[2, 1], "Rockable: speed, drops not used", "speed_4", fit, "speed after 4 s [m/s]")
    codes(axes[2, 2], "Rockable: spin, drops not used", "spin", fit, "largest spin [rad/s]")
    rockable(result)
    if (given.work / "transfer.json").exists():
        transfer(load("transfer"))

    axes[0, 0].set_ylabel("share of falls")
    axes[1, 0].set_ylabel("share of impacts")
    figure.tight_layout()
    figure.savefig(given.picture, metadata={"Date": None})


main()
