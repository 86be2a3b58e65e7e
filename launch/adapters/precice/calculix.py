#!/usr/bin/env python3
"""CalculiX with its public adapter as the structure of a run, through preCICE: a command for a scene.

usage: calculix.py [FOLDER] ...    (FOLDER is made, and its files stay)

As in rockfall run SCENE --set "processes.fem='$PWD/launch/adapters/precice/calculix.py'". Needs rockfall, rockfall-precice and ccx_preCICE in PATH.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib

NET = pathlib.Path(__file__).resolve().parent / "net"
SOLVER = "ccx_preCICE -i net -precice-participant Structure"


def configure(scene, folder, xml):
    """Write the configuration `xml` of preCICE with times and windows of the scene, which has every default; they are returned [s]."""
    with open(scene, "rb") as file:
        of = tomllib.load(file)
    window, end = of["coupling"]["time_window"], of["end_time"]
    text = re.sub('max-time value="[^"]*"', 'max-time value="%r"' % end, (NET / xml).read_text())
    text = re.sub('window-size value="[^"]*"', 'window-size value="%r"' % window, text)
    (folder / "precice.xml").write_text(text.replace('exchange-directory="."', 'exchange-directory="%s"' % folder))
    return window, end


def prepare(scene, folder, xml):
    """Write what CalculiX reads, beside the configuration."""
    with open(scene, "rb") as file:
        damping = tomllib.load(file)["structure"].get("damping", 0.0)
    if damping:
        print("structure.damping is %g, CalculiX has none in such a step: write 0.0" % damping, file=sys.stderr)
        sys.exit(2)
    window, end = configure(scene, folder, xml)
    files = [folder / "modelled.mdpa", folder / "rest.mdpa"]
    for file, options in zip(files, ([], ["--at-rest"])):
        subprocess.run(["rockfall", "export", scene, "--to", file, *options], check=True, capture_output=True)
    with (folder / "net.inp").open("w") as deck:
        subprocess.run([NET / "deck", *files, str(window), str(end)], check=True, stdout=deck)
    shutil.copy(NET / "calculix.yml", folder / "config.yml")


if __name__ == "__main__":
    *own, serve, scene = sys.argv[1 : sys.argv.index("serve") + 2]
    folder = pathlib.Path(own[0] if own else tempfile.mkdtemp()).resolve()
    folder.mkdir(exist_ok=True)
    prepare(scene, folder, "stand-in.xml")
    start = "cd %s && %s >ccx.log%s" % (folder, SOLVER, "" if own else "; rm -r %s" % folder)
    words = ["--config", str(folder / "precice.xml"), "--participant", "Contact", "--start", start, *sys.argv[sys.argv.index("serve") :]]
    os.execvp("rockfall-precice", ["rockfall-precice", *words])
