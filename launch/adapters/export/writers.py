#!/usr/bin/env python3
"""The structure of a scene, in the format of another program: from `structure.json` to .inp, .mdpa or .msh.

usage: writers.py FORMAT <structure.json >net.FORMAT    (FORMAT: inp, mdpa or msh)

`rockfall export SCENE --to net.inp` has it done in one step, `rockfall export SCENE --to structure.json` writes what is read here. What a format
cannot hold stands at the head of the file, and a line each on standard error. Exit codes: 0, or 2 where a set can have no such name in the format.
Nothing beside Python's standard library is needed. A format is one `Writer`, and its line in `WRITERS`.
"""
from __future__ import annotations

import json
import math
import re
import sys
from decimal import Decimal
from typing import Any, Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

# The version of structure.json that is read here.
VERSION = 1

Object = Dict[str, Any]
"""An object of structure.json; docs/structures.md has all of them with their units."""


class Writer(NamedTuple):
    """A format that is written."""

    name: Callable[[str], Optional[str]]
    """By what it knows a set of this name; None: it can have no such name."""
    lost: Callable[[Object], List[str]]
    """What of the structure it cannot hold, beyond what the structure itself has left out."""
    lines: Callable[[Object, Sequence[str]], Iterator[str]]
    """The lines of the file, with these remarks at its head."""


class Refused(ValueError):
    """It cannot be written, for this reason."""


def number(of: float) -> str:
    """The shortest number that is read as the same one, without an exponent: CalculiX reads 20 characters of a number."""
    text = format(Decimal(repr(float(of))), "f")
    return text[:-2] if text.endswith(".0") else text


def numbers(of: Iterable[float], between: str) -> str:
    return between.join(map(number, of))


def rows(of: Sequence[int], most: int = 16) -> Iterator[str]:
    """Whole numbers, `most` of them on a line."""
    for i in range(0, len(of), most):
        yield ", ".join(map(str, of[i : i + most]))


def bends(section: Object) -> bool:
    return section["form"]["kind"] == "sheet" and bool(section["form"]["bends"])


# Input files of Abaqus and CalculiX: a step of statics under weight, from the structure as modelled. Prestress is that of a rise of the
# temperature by 1, with an expansion of -S/E: both programs take it, for each material its own. A beam is the rectangle of equal E A and E I.


def inp_name(name: str) -> Optional[str]:
    # A set of numbers alone would be a member of sets; longest name: 80.
    if not name or len(name.encode()) > 80 or set(name) & set(',="*\n') or re.fullmatch(r"\+?[0-9]+", name):
        return None
    return "".join(c.upper() if c.isascii() else c for c in name if not c.isspace())


def inp_lost(deck: Object) -> List[str]:
    lost = []
    for section in deck["sections"]:
        form = section["form"]
        if form["kind"] == "truss" and form["tension_only"]:
            lost.append(f"`{section['name']}`: that it carries no compression")
        elif form["kind"] == "beam":
            lost.append(f"`{section['name']}`: its torsion; that of a rectangle counts")
    return lost


def inp_kind(element: Object, section: Object) -> str:
    faces = {"tri3": ("M3D3", "S3"), "quad4": ("M3D4", "S4")}
    if element["kind"] in faces:
        return faces[element["kind"]][bends(section)]
    return "B31" if section["form"]["kind"] == "beam" else "T3D2"


def prestress(section: Object) -> float:
    """Stress of a cable as modelled [Pa]."""
    return float(section["form"].get("prestress", 0.0))


def inp_material(section: Object) -> Iterator[str]:
    name, form, young, density = section["name"], section["form"], section["young"], section["density"]
    scale = 1.0
    if form["kind"] == "beam":
        # That of a rectangle with the same second moments, and so of its modulus and density.
        area, (first, second) = form["area"], form["inertia"]
        scale = area * area / (12.0 * math.sqrt(first * second))
    yield f"*MATERIAL, NAME={name}"
    yield "*ELASTIC"
    yield numbers((young * scale, form.get("poisson", 0.0)), ", ")
    if density > 0.0:
        yield "*DENSITY"
        yield number(density * scale)
    if prestress(section) != 0.0:
        yield "*EXPANSION"
        yield number(-prestress(section) / young)
    of = f"ELSET={name}, MATERIAL={name}"
    if form["kind"] == "truss":
        yield f"*SOLID SECTION, {of}"
        yield number(form["area"])
    elif form["kind"] == "beam":
        yield f"*BEAM SECTION, {of}, SECTION=RECT"
        yield numbers((math.sqrt(12.0 * inertia / form["area"]) for inertia in form["inertia"]), ", ")
        yield numbers(form["axis"], ", ")
    else:
        yield f"*{'SHELL' if bends(section) else 'MEMBRANE'} SECTION, {of}"
        yield number(form["thickness"])


def inp_step(deck: Object) -> Iterator[str]:
    yield from ("*STEP, NLGEOM, INC=1000", "*STATIC", "0.1, 1")
    if any(prestress(section) != 0.0 for section in deck["sections"]):
        yield "*TEMPERATURE"
        yield from (f"{node['number']}, 1" for node in deck["nodes"])
    if deck["gravity"]:
        x, y, z = deck["gravity"]
        size = math.sqrt(x * x + y * y + z * z)
        yield "*DLOAD"
        for section in deck["sections"]:
            if section["density"] > 0.0:
                yield f"{section['name']}, GRAV, {numbers((size, x / size, y / size, z / size), ', ')}"
    yield from ("*NODE FILE", "U", "*END STEP")


def inp_lines(deck: Object, head: Sequence[str]) -> Iterator[str]:
    yield from (f"** {line}" for line in head)
    yield "*NODE"
    yield from (f"{node['number']}, {numbers(node['at'], ', ')}" for node in deck["nodes"])
    last = ""
    for element in deck["elements"]:
        own = inp_kind(element, deck["sections"][element["section"]])
        if own != last:
            yield f"*ELEMENT, TYPE={own}"
            last = own
        yield from rows([element["number"], *element["nodes"]])
    for keyword, sets in (("NSET", deck["node_sets"]), ("ELSET", deck["element_sets"])):
        for one in sets:
            yield f"*{keyword}, {keyword}={one['name']}"
            yield from rows(one["members"])
    for section in deck["sections"]:
        yield from inp_material(section)
    if any(prestress(section) != 0.0 for section in deck["sections"]):
        yield "*INITIAL CONDITIONS, TYPE=TEMPERATURE"
        yield from (f"{node['number']}, 0" for node in deck["nodes"])
    if deck["supports"]:
        yield "*BOUNDARY"
    for support in deck["supports"]:
        for held in support["held"]:
            # Directions by sets; turns node by node, since only ends of beams have them.
            names = support["turning"] if held[0] == "r" else [support["set"]]
            dof = DIRECTIONS.index(held) + 1
            yield from (f"{name}, {dof}" for name in names)
    yield from inp_step(deck)


DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")

# Meshes of Kratos, for its structural mechanics: properties with their laws, weight and what is held as data of nodes.

# Poisson's ratio of beams [1]: only their torsion knows it, which is stated as G J.
POISSON = 0.3


def mdpa_name(name: str) -> Optional[str]:
    fits = name and not any(c.isspace() for c in name) and "//" not in name and "/*" not in name
    return name if fits else None


def mdpa_kind(element: Object, section: Object) -> str:
    corners = {"tri3": 3, "quad4": 4}.get(element["kind"])
    if corners:
        return f"{'ShellThinElementCorotational' if bends(section) else 'MembraneElement'}3D{corners}N"
    form = section["form"]
    if form["kind"] == "beam":
        return "CrBeamElement3D2N"
    is_truss = form["kind"] == "truss" and not form["tension_only"]
    return "TrussElement3D2N" if is_truss else "CableElement3D2N"


def mdpa_properties(section: Object) -> Iterator[Tuple[str, str]]:
    form = section["form"]
    yield "YOUNG_MODULUS", number(section["young"])
    yield "DENSITY", number(section["density"])
    if form["kind"] == "truss":
        yield "CROSS_AREA", number(form["area"])
        yield "TRUSS_PRESTRESS_PK2", number(form["prestress"])
        yield "CONSTITUTIVE_LAW", "TrussConstitutiveLaw"
    elif form["kind"] == "beam":
        yield "CROSS_AREA", number(form["area"])
        yield "I33", number(form["inertia"][0])
        yield "I22", number(form["inertia"][1])
        yield "TORSIONAL_INERTIA", number(form["torsion"] * 2.0 * (1.0 + POISSON))
        yield "POISSON_RATIO", number(POISSON)
        yield "CONSTITUTIVE_LAW", "BeamConstitutiveLaw"
    else:
        yield "THICKNESS", number(form["thickness"])
        yield "POISSON_RATIO", number(form["poisson"])
        yield "CONSTITUTIVE_LAW", "LinearElasticPlaneStress2DLaw"


def mdpa_block(head: str, lines: Sequence[Any]) -> Iterator[str]:
    """A block of lines, unless there are none."""
    if lines:
        yield f"Begin {head}"
        yield from map(str, lines)
        yield f"End {head.split(' ')[0]}"


def mdpa_lines(deck: Object, head: Sequence[str]) -> Iterator[str]:
    yield from (f"// {line}" for line in head)
    for i, section in enumerate(deck["sections"], 1):
        yield f"Begin Properties {i} // {section['name']}"
        yield from map(" ".join, mdpa_properties(section))
        yield "End Properties"
    yield from mdpa_block("Nodes", [f"{node['number']} {numbers(node['at'], ' ')}" for node in deck["nodes"]])
    blocks: List[Tuple[str, List[str]]] = []
    for element in deck["elements"]:
        own = mdpa_kind(element, deck["sections"][element["section"]])
        if not blocks or blocks[-1][0] != own:
            blocks.append((own, []))
        blocks[-1][1].append(" ".join(map(str, [element["number"], element["section"] + 1, *element["nodes"]])))
    for own, lines in blocks:
        yield from mdpa_block(f"Elements {own}", lines)
    beams = [(e["number"], deck["sections"][e["section"]]["form"]) for e in deck["elements"]]
    axes = [f"{element} [3] ({numbers(form['axis'], ', ')})" for element, form in beams if form["kind"] == "beam"]
    yield from mdpa_block("ElementalData LOCAL_AXIS_2", axes)
    for direction in DIRECTIONS:
        turns = direction[0] == "r"
        held = [support["turning" if turns else "nodes"] for support in deck["supports"] if direction in support["held"]]
        variable = f"{'ROTATION' if turns else 'DISPLACEMENT'}_{direction[-1].upper()}"
        yield from mdpa_block(f"NodalData {variable}", [f"{node} 1 0" for node in sorted(set().union(*held))])
    for component, g in zip("XYZ", deck["gravity"] or ()):
        if g != 0.0:
            lines = [f"{node['number']} 0 {number(g)}" for node in deck["nodes"]]
            yield from mdpa_block(f"NodalData VOLUME_ACCELERATION_{component}", lines)
    elements = {one["name"]: one["members"] for one in deck["element_sets"]}
    for one in deck["node_sets"]:
        yield f"Begin SubModelPart {one['name']}"
        yield from mdpa_block("SubModelPartNodes", one["members"])
        yield from mdpa_block("SubModelPartElements", elements.get(one["name"], ()))
        yield "End SubModelPart"


# Meshes of Gmsh, version 2.2: names of sets as physical groups, sets of nodes as groups of points; nothing of what they are made.

# Number and dimension of each shape.
MSH_KINDS = {"line2": (1, 1), "tri3": (2, 2), "quad4": (3, 2), "line3": (8, 1), "tri6": (9, 2)}
POINT = 15


def msh_name(name: str) -> Optional[str]:
    return name if name and name.strip() == name and not set(name) & set('"\n') else None


def msh_own_nodes(deck: Object) -> Dict[str, List[int]]:
    """For each set of elements their nodes, in the order of the file."""
    place = {node["number"]: i for i, node in enumerate(deck["nodes"])}
    nodes_of = {element["number"]: element["nodes"] for element in deck["elements"]}
    sets = {one["name"]: {node for element in one["members"] for node in nodes_of[element]} for one in deck["element_sets"]}
    return {name: sorted(nodes, key=place.__getitem__) for name, nodes in sets.items()}


def msh_lost(deck: Object) -> List[str]:
    own = msh_own_nodes(deck)
    lost = ["what parts are made of, prestress, supports and loads: names of sets are all that the format has"]
    for one in deck["node_sets"]:
        if own.get(one["name"], one["members"]) != one["members"]:
            lost.append(f"the nodes of `{one['name']}` that are no nodes of its elements, or not all")
    return lost


def msh_lines(deck: Object, head: Sequence[str]) -> Iterator[str]:
    own = msh_own_nodes(deck)
    points = sorted((one for one in deck["node_sets"] if one["name"] not in own), key=lambda one: one["name"])
    kinds = {element["number"]: MSH_KINDS[element["kind"]] for element in deck["elements"]}
    # A group is of one dimension: a set of both is two of one name.
    groups: Dict[Tuple[int, str], int] = {}
    groups_of: Dict[int, List[int]] = {}
    for one in points:
        groups[0, one["name"]] = len(groups) + 1
    for one in sorted(deck["element_sets"], key=lambda one: one["name"]):
        for element in one["members"]:
            group = groups.setdefault((kinds[element][1], one["name"]), len(groups) + 1)
            groups_of.setdefault(element, []).append(group)
    yield from ("$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Comments", *head, "$EndComments")
    yield from ("$PhysicalNames", str(len(groups)))
    yield from (f'{dimension} {group} "{name}"' for (dimension, name), group in sorted(groups.items()))
    yield from ("$EndPhysicalNames", "$Nodes", str(len(deck["nodes"])))
    yield from (f"{node['number']} {numbers(node['at'], ' ')}" for node in deck["nodes"])
    # An element in several groups is written once for each, and points are behind all others.
    first: List[str] = []
    again: List[str] = []
    for element in deck["elements"]:
        entity, kind = element["section"] + 1, kinds[element["number"]][0]
        nodes = " ".join(map(str, element["nodes"]))
        group, *others = groups_of.get(element["number"], [0])
        first.append(f"{element['number']} {kind} 2 {group} {entity} {nodes}")
        again += [f"{kind} 2 {other} {entity} {nodes}" for other in others]
    for one in points:
        group = groups[0, one["name"]]
        again += [f"{POINT} 2 {group} {group} {node}" for node in one["members"]]
    last = max((element["number"] for element in deck["elements"]), default=0)
    yield from ("$EndNodes", "$Elements", str(len(first) + len(again)), *first)
    yield from (f"{i} {row}" for i, row in enumerate(again, last + 1))
    yield "$EndElements"


WRITERS = {
    "inp": Writer(inp_name, inp_lost, inp_lines),
    "mdpa": Writer(mdpa_name, lambda deck: [], mdpa_lines),
    "msh": Writer(msh_name, msh_lost, msh_lines),
}


def check_names(deck: Object, writer: Writer) -> None:
    """Each set must have a name of its own in the format."""
    for sets in (deck["node_sets"], deck["element_sets"]):
        names: Dict[str, str] = {}
        for name in (one["name"] for one in sets):
            known = writer.name(name)
            if known is None:
                raise Refused(f"the set `{name}` can have no such name in this format")
            if known in names:
                raise Refused(f"the sets `{names[known]}` and `{name}` have one name in this format")
            names[known] = name


def write(deck: Object, form: str) -> Tuple[str, List[str]]:
    """The text of `deck` in a format, and what of it the format cannot hold. Raises `Refused`."""
    if form not in WRITERS:
        raise Refused(f"there is no format {form!r}: known are {', '.join(WRITERS)}")
    if deck.get("version") != VERSION:
        raise Refused(f"version {VERSION} of structure.json is read, this is {deck.get('version')}")
    writer = WRITERS[form]
    check_names(deck, writer)
    lost = writer.lost(deck)
    held = ", ".join(f"`{support['set']}`" for support in deck["supports"])
    head = [
        f"structure of a rockfall scene, {'at rest at t = 0' if deck['at_rest'] else 'as modelled'}; m, kg, s, N",
        'rockfall reads it with mesh = "FILE" in [structure], in place of generator, place, nodes and cells, and renumber = false for '
        f"the same numbers to the last bit; {'held are ' + held if held else 'nothing is held'}",
        *(f"not in this file: {what}" for what in deck["left_out"] + lost),
    ]
    return "".join(line + "\n" for line in writer.lines(deck, head)), lost


def main() -> None:
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        stream.reconfigure(encoding="utf-8")  # type: ignore[union-attr]
    try:
        text, lost = write(json.load(sys.stdin), sys.argv[1])
    except Refused as refused:
        print(refused, file=sys.stderr)
        sys.exit(2)
    sys.stdout.write(text)
    for what in lost:
        print(what, file=sys.stderr)


if __name__ == "__main__":
    main()
