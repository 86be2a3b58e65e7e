"""What a configuration of preCICE says of one participant: its mesh, its data, its coupling scheme."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Iterator, List, Optional, Sequence, Tuple, Union
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from rockfall import Fault

SCHEME = "coupling-scheme:"


@dataclass(frozen=True)
class Names:
    """A participant of a coupling scheme."""

    config: str
    """The configuration's file."""
    participant: str
    mesh: str
    """The mesh that it provides."""
    reads: List[str]
    """Data that it reads from that mesh."""
    writes: List[str]
    """Data that it writes to it."""
    scheme: str
    """`serial-implicit` and so on."""
    order: Tuple[str, str]
    """Participants of the scheme; the first computes a window first, if it is a serial one."""
    window: float
    """Length of a window [s]; 0 or below: the first participant says it."""
    end_time: float
    """End of the run [s]."""

    @classmethod
    def read(cls, config: Union[str, "os.PathLike[str]"], participant: str) -> Names:
        """Read the configuration's file. What is wrong with it is raised as a `Fault` of the kind `input`."""
        try:
            with open(config, encoding="utf-8") as file:
                return cls.parse(file.read(), os.fspath(config), participant)
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise Fault(f"--config {config}: {why}", "input") from None

    @classmethod
    def parse(cls, text: str, config: str, participant: str) -> Names:
        """From the text of a configuration; a ValueError says what is missing."""
        root = _tree(text)
        participants = {of.get("name", ""): of for of in root.iter("participant")}
        if participant not in participants:
            raise ValueError(f"no participant is called {participant}; there are {', '.join(participants)}")
        own = participants[participant]
        meshes = [of.get("name", "") for of in own.iter("provide-mesh")]
        if not meshes:
            raise ValueError(f'{participant} provides no mesh: <provide-mesh name="..."/> is missing')
        if len(meshes) > 1:
            raise ValueError(f"{participant} provides {len(meshes)} meshes; one is coupled")
        scheme, order = _scheme(root, participant)
        end_time = _number(scheme, "max-time", 0.0)
        if end_time <= 0.0:
            raise ValueError(f'the coupling scheme of {participant} has no <max-time value="..."/>')
        return cls(
            config,
            participant,
            meshes[0],
            [of.get("name", "") for of in own.iter("read-data")],
            [of.get("name", "") for of in own.iter("write-data")],
            "" if scheme is None else scheme.tag[len(SCHEME) :],
            order,
            _number(scheme, "time-window-size", 0.0),
            end_time,
        )

    @property
    def is_implicit(self) -> bool:
        """Whether windows are repeated until they converge."""
        return self.scheme.endswith("implicit")

    @property
    def goes_ahead(self) -> bool:
        """Whether it computes a window without having seen what the other one does in it."""
        return not self.is_implicit and (self.scheme.startswith("parallel") or self.order[0] == self.participant)

    @property
    def other(self) -> str:
        """The other participant."""
        return self.order[1] if self.order[0] == self.participant else self.order[0]


def named(data: Sequence[str], word: str) -> Iterator[Tuple[str, bool]]:
    """Of the data those whose names begin with `word`; and whether they are of the end of a window, as names that end in `-End` say."""
    return ((name, name.endswith("-End")) for name in data if name.startswith(word))


def _tree(text: str) -> Element:
    """Not by `xml.etree` alone: prefixes of the tags, as `coupling-scheme:`, are no XML namespaces, which nothing declares."""
    tree, parser = TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = tree.start, tree.end
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"this is not XML, as configurations of preCICE are: {error}") from None
    return tree.close()


def _scheme(root: Element, participant: str) -> Tuple[Optional[Element], Tuple[str, str]]:
    """The coupling scheme of which it is a participant, with its order."""
    for scheme in (of for of in root.iter() if of.tag.startswith(SCHEME)):
        of = scheme.find("participants")
        order = ("", "") if of is None else (of.get("first", ""), of.get("second", ""))
        if participant in order:
            return scheme, order
    return None, ("", "")


def _number(scheme: Optional[Element], tag: str, default: float) -> float:
    of = None if scheme is None else scheme.find(tag)
    value = None if of is None else of.get("value")
    if not value:
        return default
    try:
        return float(value)
    except ValueError:
        raise ValueError(f'<{tag} value="{value}">: this is not a number') from None
