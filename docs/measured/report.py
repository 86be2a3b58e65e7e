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


def curve(axes, sample, colour, label, **style):
    """Share of a sample that is at most so large."""
    sample = np.sort(sample)
    share = np.arange(1, len(sample) + 1) / len(sample)
    axes.step(np.append(sample[0], sample), np.append(0.0, share), where="post", color=colour, label=label, **style)


def finish(axes, title, quantity, legend):
    axes.set(title=title, xlabel=quantity, ylim=(0, 1.02))
    axes.set_xlim(left=0)
    axes.legend(loc=legend, fontsize=6.5, frameon=False)


def panel(axes, title, fit, more=()):
    """Measured and predicted of the half that was not used."""
    for sample, colour, label in more:
        curve(axes, sample, colour, label, linewidth=1.0, linestyle="--")
    curve(axes, fit["computed"], COMPUTED, f"predicted ({len(fit['computed'])})", linewidth=1.6)
    curve(axes, fit["measured"], MEASURED, f"measured ({len(fit['measured'])})", linewidth=1.6)
    for share, (low, high) in zip((0.1, 0.5, 0.9), fit["measured_intervals"]):
        axes.plot([low, high], [share, share], color=MEASURED, linewidth=0.8, marker="|", markersize=5)
    finish(axes, title, "run-out [m]", "upper left")


def impacts(axes, title, key, fit, preset, power=1, quantity=""):
    """The same of impacts: all orientations of all of them against what was measured."""
    curve(axes, np.array(preset["of"][key]["grid"]) ** power, PRESET, "preset meadow", linewidth=1.0, linestyle="--")
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


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--picture", type=Path, required=True)
    given = parser.parse_args()
    plt.rcParams.update({"font.size": 8, "svg.fonttype": "none", "svg.hashsalt": "rockfall"})
    figure, axes = plt.subplots(2, 3, figsize=(10.5, 6.2))
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

    axes[0, 0].set_ylabel("share of falls")
    axes[1, 0].set_ylabel("share of impacts")
    figure.tight_layout()
    figure.savefig(given.picture, metadata={"Date": None})


main()
