"""Draws docs/measured-falls.svg and prints the tables of docs/measured-falls.md, of what tschamut.py has written.

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


def curve(axes, sample, colour, label, **style):
    """Share of a sample that is at most so large."""
    sample = np.sort(sample)
    share = np.arange(1, len(sample) + 1) / len(sample)
    axes.step(sample, share, where="post", color=colour, label=label, **style)


def panel(axes, title, fit, more=()):
    """Measured and predicted of the half that was not used."""
    for sample, colour, label in more:
        curve(axes, sample, colour, label, linewidth=1.0, linestyle="--")
    curve(axes, fit["computed"], COMPUTED, f"predicted ({len(fit['computed'])})", linewidth=1.6)
    curve(axes, fit["measured"], MEASURED, f"measured ({len(fit['measured'])})", linewidth=1.6)
    for share, (low, high) in zip((0.1, 0.5, 0.9), fit["measured_intervals"]):
        axes.plot([low, high], [share, share], color=MEASURED, linewidth=0.8, marker="|", markersize=5)
    axes.set(title=title, xlabel="run-out [m]", ylim=(0, 1.02))
    axes.set_xlim(left=0)
    axes.legend(loc="upper left", fontsize=7, frameon=False)


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
    "| sample | measured falls | measured 10 / 50 / 90 % | their 95 % intervals | computed | distance (two measured samples) "
    "| KS distance (p) |\n|---|---|---|---|---|---|---|"
)


def values(result, deciding):
    """Calibrated numbers, and the rank correlation of each with the median over the whole range."""
    print("\n| key | calibrated | rank correlation with the median |\n|---|---|---|")
    for name, value in result["values"].items():
        found = [f"{part[name]:+.2f}" if name in part else "kept" for part in deciding]
        print(f"| `{name}` | {value:g} | {' / '.join(found)} |")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--picture", type=Path, required=True)
    given = parser.parse_args()
    result = json.loads((given.work / "tschamut.json").read_text())
    plt.rcParams.update({"font.size": 8, "svg.fonttype": "none", "svg.hashsalt": "rockfall"})
    figure, axes = plt.subplots(2, 2, figsize=(8.0, 6.0))
    fit, preset = result["fit"], result["preset"]
    more = [(preset["computed"], PRESET, "preset meadow, uncalibrated"), (fit["a"]["whole"]["measured"], OTHER, "measured, calibrated half")]
    panel(axes[0, 0], "All blocks of the half that was not used", fit["b"]["whole"], more)
    for place, (name, part) in zip((axes[0, 1], axes[1, 0], axes[1, 1]), fit["b"]["blocks"].items()):
        panel(place, f"Of these block {name}", part)
    figure.tight_layout()
    figure.savefig(given.picture, metadata={"Date": None})

    print(HEAD)
    print(row("half that was calibrated", fit["a"]["whole"]))
    print(row("other half, predicted", fit["b"]["whole"]))
    for name, part in fit["b"]["blocks"].items():
        print(row(f"of these block {name}", part))
    print(row("other half, preset `meadow`", preset))
    print("runs:", result["runs"], "not to be trusted:", fit["a"]["bad"], fit["b"]["bad"])
    print("share at the cut, preset:", np.mean(np.array(preset["computed"]) >= max(preset["computed"])))
    print("\n| key | calibrated | rank correlation with the median |\n|---|---|---|")
    for name, value in result["values"].items():
        found = f"{result['deciding'][name]:+.2f}" if name in result["deciding"] else "of the preset, kept"
        print(f"| `{name}` | {value:g} | {found} |")


main()
