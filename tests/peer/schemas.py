#!/usr/bin/env python3
"""Scenes, studies, kits, calibrations and the manual's TOML against the schemas, by two validators that are not ours: jsonschema and taplo.

    pip install jsonschema; npm install @taplo/cli       (either alone will do; what is not there is skipped)
    tests/peer/schemas.py [--taplo PROGRAM]              exit code 1 where something does not fit

Whole files are validated as they are; blocks of pages that show a few tables alone are validated without "required".
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROCKFALL = ROOT / "target/release/rockfall"
# Mistakes that docs/reference.md documents as refused at sight.
MISTAKES = {"scene": [
    'end_time = "long"',
    "end_tiem = 1.0",
    "end_time = 1.0\ngravity = [0.0, 0.0]",
    "end_time = 1.0\n[coupling]\nscheme = \"storng\"",
    "end_time = 1.0\n[[rock]]\nposition = [0, 0, 0]\nshape = { type = \"cubus\", size = 1.0 }",
    "end_time = 1.0\n[[contact]]\nrestitution = 0.5",
    "end_time = 1.0\n[fem]\ntime_step = \"1e-5\"",
    "end_time = 1.0\n[output]\nfeilds = 0.1",
], "kit": [
    "[kit]\nclass = 3",
    "[kit]\nclass = 9\n[structure]",
    "[kit]\nclass = \"A\"\n[structure]",
    "[kit]\nenergy = -1e5\n[structure]",
    "[kit]\nenergy = 0.0\n[structure]",
    "[kit]\nmaker = \"x\"\n[structure]",
    "[[kit]]\nname = \"x\"\n[structure]",
    "[structure]\n[[rock]]\nmass = 1.0",
    "[structure]\n[structure.generator]\ntype = \"barier\"",
    "[structure]\n[structure.generator]\ntype = \"barrier\"\nheigth = 3.0",
    "[structure]\n[structure.generator]\ntype = \"barrier\"\nnet = \"ring\"",
    "[structure]\n[[structure.parts]]\nname = \"net\"\nelement = \"rings\"",
], "study": [
    "scene = \"a.toml\"",
    "scene = \"a.toml\"\nseed = \"one\"\n[[release]]\npoints = [[0.0, 0.0]]",
    "scene = \"a.toml\"\nsampling = \"lhs\"\n[[release]]\npoints = [[0.0, 0.0]]",
    "scene = \"a.toml\"\n[release]\npoints = [[0.0, 0.0]]",
    "scene = \"a.toml\"\n[[release]]\nnumber = 3",
]}


def schema(*arguments):
    return json.loads(subprocess.run([ROCKFALL, "schema", *arguments], check=True, capture_output=True).stdout)


def lenient(part):
    """The schema of a part of a file: nothing is required in it but the tag of a table."""
    if isinstance(part, dict):
        out = {k: lenient(v) for k, v in part.items() if not (k == "required" and isinstance(v, list))}
        for name in ("oneOf", "anyOf"):
            if name in part and not all("const" in str(option) for option in part[name]):
                out["anyOf"] = out.pop(name)
        return out
    return [lenient(item) for item in part] if isinstance(part, list) else part


def whole_files():
    for file in sorted((ROOT / "launch/kits").glob("*.toml")):
        yield file, file.read_text(), "kit"
    scenes = ROOT / "launch/scenes"
    for file in sorted(scenes.rglob("*.toml")):
        text = file.read_text()
        yield file, text, "study" if re.search(r"^\[\[release\]\]", text, re.M) else "scene"
    for file in sorted((ROOT / "interface-defs/bindings/templates").rglob("*.toml")):
        if file.name != "Cargo.toml":
            yield file, file.read_text(), "scene"


def resolved(directory):
    """What `rockfall check --resolved` fills in."""
    for name in ["walenstadt-exp1", "cable-net", "slope-fall", "sphere-on-cable"]:
        file = directory / f"{name}.toml"
        command = [ROCKFALL, "check", ROOT / f"launch/scenes/{name}.toml", "--resolved", file]
        subprocess.run(command, check=True, capture_output=True)
        yield file, file.read_text(), "scene"


def blocks():
    for page in sorted((ROOT / "docs").glob("*.md")):
        for number, block in enumerate(re.findall(r"```toml\n(.*?)```", page.read_text(), re.S), 1):
            kind = "study" if re.search(r"^(\[\[release|\[vary|\[\[line|\[maps|scene *=|\[line)", block, re.M) else "scene"
            kind = "kit" if re.search(r"^\[kit\]", block, re.M) else kind
            kind = "calibration" if page.name == "calibrate.md" else kind
            yield f"{page.name}, block {number}", block, kind


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--taplo", default=shutil.which("taplo"), help="program of taplo")
    taplo = parser.parse_args().taplo
    try:
        from jsonschema import Draft202012Validator
    except ImportError:
        Draft202012Validator = None
        print("skipped: jsonschema is not installed")
    if not taplo:
        print("skipped: taplo is not installed")
    kinds = ["study", "calibration", "kit"]
    schemas = {"scene": schema()} | {kind: schema(f"--{kind}") for kind in kinds}
    wrong, count = [], 0
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary)

        def faults(text, of):
            found = []
            if Draft202012Validator:
                errors = Draft202012Validator(of).iter_errors(tomllib.loads(text))
                found += [f"jsonschema: {'.'.join(map(str, e.absolute_path))}: {e.message[:160]}" for e in errors]
            if taplo:
                (directory / "schema.json").write_text(json.dumps(of))
                (directory / "file.toml").write_text(text)
                command = [taplo, "lint", "--schema", f"file://{directory}/schema.json", "file.toml"]
                done = subprocess.run(command, cwd=directory, capture_output=True, text=True)
                if done.returncode != 0:
                    found.append("taplo: " + done.stderr.strip()[-400:])
            return found

        for name, text, kind in [*whole_files(), *resolved(directory), *blocks()]:
            count += 1
            of = schemas[kind] if isinstance(name, pathlib.Path) else lenient(schemas[kind])
            wrong += [f"{name}: {fault}" for fault in faults(text, of)]
        for kind, text in [(kind, text) for kind, texts in MISTAKES.items() for text in texts]:
            count += 1
            found = faults(text, schemas[kind])
            expected = bool(Draft202012Validator) + bool(taplo)
            if len({fault.split(":")[0] for fault in found}) < expected:
                wrong.append(f"not every validator refuses: {text!r}")
    print("\n".join(wrong) or f"{count} files, blocks and mistakes: as expected")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
