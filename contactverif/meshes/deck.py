"""Input decks of Abaqus and CalculiX, read by keyword, because users of contact name their surfaces there.

Rules for the next editor: a card that makes or moves nodes and is not read is refused by name, and all else that is
skipped is told. Cards of one keyword and name add up in any order, and those of a part are repeated for each instance.
"""

import os
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.meshes.cell_sides import CellSides
from contactverif.meshes.plain_mesh import CORNERS, Group, PlainMesh

# Type of element, kind of cell, and the corners of each face. A solid cell is on the left of its edge, and behind its
# face, which is seen counter-clockwise. So is the body of a thin cell; the normal of a line points to its left.
_TYPES = (
    ("(CP[ES]|CAX)3", "triangle", "S1=12 S2=23 S3=31"),
    ("(CP[ES]|CAX)4", "quad", "S1=12 S2=23 S3=34 S4=41"),
    ("C3D4", "tetra", "S1=132 S2=124 S3=234 S4=143"),
    ("C3D6", "wedge", "S1=132 S2=456 S3=1254 S4=2365 S5=3146"),
    ("C3D8", "hexahedron", "S1=1432 S2=5678 S3=1265 S4=2376 S5=3487 S6=4158"),
    ("(S|STRI|[RM]3D|SFM3D)3", "triangle", "SPOS=123 SNEG=321 S2=123 S1=321 S3=12 S4=23 S5=31"),
    ("(S|[RM]3D|SFM3D)4", "quad", "SPOS=1234 SNEG=4321 S2=1234 S1=4321 S3=12 S4=23 S5=34 S6=41"),
    ("[TR]2D2|RAX2|B21", "line", "SPOS=21 SNEG=12"),
    ("T3D2|B31", "line", "=12"),  # Without a normal: the cells beside such a line tell its side.
    ("C3D(10|15|20|27).*|(CP[ES]|CAX|M3D)[689].*|S[689]R?|STRI6|[TR][23]D3|B[23]2.*", "quadratic", ""),
    (".*", "", ""),
)
_STATES = {"CPS": "plane stress", "CAX": "axisymmetric"}
_SIDES = {1: "vertex", 2: "line", 3: "triangle", 4: "quad"}
_SETS = {"SURFACE": "NAME", "ELSET": "ELSET", "NSET": "NSET"}  # {card: the parameter that names a set}
_LEVELS = {"PART", "INSTANCE", "ASSEMBLY", "ENDPART", "ENDINSTANCE", "ENDASSEMBLY"}
_MESH_CARDS = {"NODE", "ELEMENT", *_SETS, *_LEVELS}
_PARAMETERS = {"NAME", "TYPE", "PART", "INPUT", "SYSTEM", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED", *_SETS}
_PAIRS = {"CONTACTPAIR", "CONTACTINCLUSIONS", "TIE"}  # The others count where there is no *CONTACT PAIR.
_OTHER_CARDS = {*_PAIRS, "MATERIAL", "ELASTIC", "SOLIDSECTION"}  # No parameter of these moves a surface.
# What is not told: output, steps, and laws of the contact, for which the formulation is.
_QUIET = re.compile(r"HEADING|PREPRINT|RESTART|.*(PRINT|FILE|OUTPUT)|(END)?STEP|STATIC|SURFACE(INTERACTION|BEHAVIOR)")
_REFUSED = "NCOPY NGEN NFILL NMAP ELGEN ELCOPY SYSTEM IMPERFECTION ADJUST PARAMETER IMPORT REFINEMESH INCLUDE"
_DEEPEST, _MOST_FILES, _LONGEST = 20, 1000, 10**7  # Sets in sets and files in files; files; a range of numbers.
# A keyword line goes on behind a comma if there are parameters; data may follow such a comma too.
_MORE = r"(?:[^\n]*,[ \t]*\n(?:[ \t]*\n)*(?![ \t]*\*)(?=[^\n]*=|[ \t]*(?:GENERATE|INTERNAL|UNSORTED)\b))*"
_KEYWORD = re.compile(rf"(?im)^[ \t]*\*({_MORE}[^\n]*)")
_INCLUDE = re.compile(r'(?im)^[ \t]*\*[ \t]*(?:(INCLUDE)|NODE|ELEMENT)[ \t]*,.*?\bINPUT[ \t]*=[ \t"]*([^\n",]*).*')
_Key = tuple[str, str]  # SURFACE, ELSET or NSET, and the label of a set.


def _label(name: str) -> str:
    """Return a name as the codes compare it: in capitals and without blanks, but for what is in quotes."""
    return "".join(part if n % 2 else "".join(part.split()).upper() for n, part in enumerate(name.split('"')))


def _is_solid(faces: dict[str, list[int]]) -> bool:
    """Return whether elements have a body behind each face; a shell may have edges as faces, too (`cgx`)."""
    return "S3" in faces and "SPOS" not in faces


@dataclass(frozen=True, slots=True)
class _Card:
    keyword: str
    parameters: dict[str, str]
    data: str
    line: int  # The line on which the data begin, after the keyword.
    instance: str = ""  # The name of the instance and a dot, as in the file.
    prefix: str = ""  # The label of the same.

    def need(self, holds: bool, text: str, line: int = 0) -> None:
        if not holds:
            raise ValueError(f"line {line or self.line}: *{self.keyword}: found {text}")

    def label(self, parameter: str) -> str:
        """Return the label of the name that a parameter gives."""
        self.need(bool(self.parameters.get(parameter)), f"no {parameter}; needed {parameter}=NAME")
        return _label(self.parameters[parameter])

    def rows(self) -> list[tuple[int, list[str]]]:
        """Return the number and the fields of each data line."""
        data = self.data if '"' in self.data else self.data.replace(" ", "").replace("\t", "")
        lines = enumerate(map(str.strip, data.split("\n")), self.line)
        return [(line, text.rstrip(",").split(",")) for line, text in lines if text]

    def numbers(self, line: int, fields: list[str]) -> list[float]:
        """Return numbers, also those with the exponent of Fortran; one that is left out is zero."""
        try:
            values = [float(text.replace("D", "E").replace("d", "E") or 0) for text in fields]
        except ValueError:
            values = [np.inf]
        plain = max(map(abs, values)) < 1e100 and "_" not in "".join(fields)
        self.need(plain, f"{', '.join(fields)}; needed numbers", line)
        return values


def _expand(path: str, files: list[str], depth: int = 0) -> str:
    """Return the text of a file without comments, with the files that it includes in their places."""
    with open(path, "rb") as stream:
        content = stream.read()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    text = re.sub(r"(?m)^[ \t]*\*(\*.*|[ \t]*)$", "", text.replace("\r\n", "\n").replace("\r", "\n"))

    def include(match: re.Match[str]) -> str:
        files.append(os.path.join(os.path.dirname(files[0]), match[2].strip()))
        card = _Card("INCLUDE" if match[1] else "INPUT", {}, "", 1 + text.count("\n", 0, match.start()))
        ends = os.path.isfile(files[-1]) and depth < _DEEPEST and len(files) <= _MOST_FILES
        card.need(ends, f"{match[2]}; needed an ordinary file by the deck, and no files in a circle")
        return ("" if match[1] else match[0] + "\n") + _expand(files[-1], files, depth + 1)

    return _INCLUDE.sub(include, text)


def _read_cards(text: str, warnings: list[str]) -> tuple[list[_Card], dict[str, _Card]]:
    """Return the cards that are read, those of a part once for each instance; and the instances by name."""
    cards, parts, instances = list[_Card](), dict[str, list[_Card]](), dict[str, _Card]()
    skipped, loads = list[str](), list[str]()
    before, *blocks = _KEYWORD.split(text)
    current, name, line = cards, "", 1 + before.count("\n")
    _Card("", {}, "", 1).need(not before.strip(), "text before the first keyword; needed a deck, such as *NODE first")
    for head, data in zip(blocks[::2], blocks[1::2], strict=True):
        line += head.count("\n")
        title, *rest = head.split(",")
        pairs = (part.partition("=") for part in rest if part.strip())
        parameters = {_label(key): value.strip() for key, _, value in pairs}
        keyword = _label(title)
        card = _Card(keyword, parameters, data, line, name, _label(name))
        line += data.count("\n")
        proper = all(key[:1].isalpha() for key in (keyword, *parameters))
        card.need(proper, "a keyword or a parameter that begins with no letter; needed a name")
        needed = "needed a deck with all nodes and elements in their places"
        card.need(keyword not in _REFUSED.split(), f"this card, which makes or moves nodes and is not read; {needed}")
        if keyword in _LEVELS:
            card.need(keyword == "INSTANCE" or not data.strip(), "data lines; needed a keyword")
            current, name = cards, ""
        if keyword == "PART":
            current = parts.setdefault(card.label("NAME"), [])
        elif keyword == "INSTANCE":
            name, part = f"{card.parameters.get('NAME')}.", card.label("PART")
            new = name not in instances and part in parts
            card.need(new, f"NAME={name[:-1]}, PART={part}; needed a new name, and a part from above")
            instances[name] = card
            cards += [replace(each, instance=name, prefix=_label(name)) for each in parts[part]]
        elif keyword in _MESH_CARDS | _OTHER_CARDS:
            current.append(card)
        elif keyword in {"BOUNDARY", "CLOAD", "DLOAD", "DSLOAD"}:
            loads.append(f"*{keyword}")
        elif not _QUIET.fullmatch(keyword):
            skipped.append(f"*{' '.join(title.upper().split())}")
        if keyword in _MESH_CARDS:
            skipped += [f"{key} of *{keyword}" for key in parameters if key not in _PARAMETERS]
    skipped += [f"the part {part}" for part in parts.keys() - {card.label("PART") for card in instances.values()}]
    warnings += [f"Not read: {', '.join(dict.fromkeys(skipped))}."] if skipped else []
    if loads:
        warnings.append(f"Supports and loads are not those of the deck ({', '.join(dict.fromkeys(loads))}).")
    return cards, instances


def _move(points: FloatArray, card: _Card) -> FloatArray:
    """Return points (n, 3) where an instance has them: it is translated first, and then turned about an axis."""
    for line, fields in card.rows():
        values = np.array([*card.numbers(line, fields), 0, 0])
        if len(fields) <= 3:
            points = points + values[:3]
            continue
        length = np.linalg.norm(values[3:6] - values[:3])
        needed = "needed a translation (3 numbers), or two points of an axis and an angle (7)"
        card.need(len(fields) == 7 and bool(length > 0), f"{', '.join(fields)}; {needed}", line)
        axis, arms, angle = (values[3:6] - values[:3]) / length, points - values[:3], np.radians(values[6])
        along = (arms @ axis)[:, None] * axis
        points = values[:3] + along + np.cos(angle) * (arms - along) + np.sin(angle) * np.cross(axis, arms)
    return points


class _Deck:
    """The nodes, elements and sets of a deck. The label of a node or an element is its number behind its instance."""

    def __init__(self, text: str) -> None:
        self.warnings: list[str] = []
        self.cards, self.instances = _read_cards(text, self.warnings)
        self.indices: dict[str, dict[str, int]] = {"NSET": {}, "ELSET": {}}  # Of nodes and elements, by label.
        self.points: list[list[float]] = []
        self.elements: list[tuple[str, str, dict[str, list[int]], list[int]]] = []  # Type, kind, faces, and nodes.
        self.names: dict[_Key, tuple[str, str]] = {}  # The instance with a dot, and the name, as in the file.
        self.sets: dict[_Key, list[_Card | list[int]]] = {}  # Cards, and indices from *NODE and *ELEMENT.
        self.known: dict[_Key, list[int]] = {}  # Indices, for the sets that are known already.
        of_instances: dict[str, list[int]] = {}
        for keyword in ("NODE", "ELEMENT", *_SETS):
            for card in self.cards:
                if card.keyword == keyword == "NODE":
                    self._add(card, "NSET", self._read_nodes(card))
                elif card.keyword == keyword == "ELEMENT":
                    elements = self._read_elements(card)
                    self._add(card, "ELSET", elements)
                    of_instances.setdefault(card.instance, []).extend(elements)
                elif card.keyword == keyword:
                    card.label(_SETS[keyword])
                    self._add(card, keyword, card)
        for name in self.instances:  # Each is a group, too, behind all others.
            key = "ELSET", _label(name[:-1])
            if key not in self.sets:
                self.names[key], self.sets[key] = ("", name[:-1].replace('"', "")), [of_instances.get(name, [])]
        self.places = np.array(self.points).reshape(-1, 3)

    def _add(self, card: _Card, kind: str, part: _Card | list[int]) -> None:
        if name := card.parameters.get(_SETS[kind]):
            key = kind, card.prefix + _label(name)
            self.names.setdefault(key, (card.instance.replace('"', ""), name.replace('"', "").strip()))
            self.sets.setdefault(key, []).append(part)

    def _number(self, kind: str, card: _Card, row: tuple[int, list[str]], values: list[Any], value: object) -> int:
        """Return the index of a node or an element, which is appended to values if its number is new."""
        line, (number, *_) = row
        index = self.indices[kind].setdefault(card.prefix + number, len(values))
        if index == len(values):
            values.append(value)
        proper = values[index] == value and number.isdecimal()
        card.need(proper, f"{number}, which is no number or is in use; needed a number of its own", line)
        return index

    def _read_nodes(self, card: _Card) -> list[int]:
        card.need(_label(card.parameters.get("SYSTEM", "R")) == "R", "SYSTEM; needed rectangular coordinates")
        rows = card.rows()
        for line, fields in rows:
            card.need(len(fields) > 2, f"{', '.join(fields)}; needed a number and two or three coordinates", line)
        points = np.array([card.numbers(line, [*fields, ""][1:4]) for line, fields in rows]).reshape(-1, 3)
        if card.instance:
            points = _move(points, self.instances[card.instance])
        return [self._number("NSET", card, row, self.points, at) for row, at in zip(rows, points.tolist(), strict=True)]

    def _read_elements(self, card: _Card) -> list[int]:
        name, indices, known = card.label("TYPE"), [], self.indices["NSET"]
        kind, text = next(rest for start, *rest in _TYPES if re.fullmatch(f"({start})[RIHSTPMW]*5?", name))
        remedy = "needed elements of first order (Gmsh: -order 1; Abaqus/CAE: Element Type, Linear)"
        card.need(kind != "quadratic", f"quadratic elements {name}; {remedy}")
        faces = {face: [int(n) - 1 for n in corners] for face, corners in (each.split("=") for each in text.split())}
        if not kind or name[:3] in _STATES:
            state = f"{_STATES[name[:3]]}; the state here is plane strain" if kind else "not read"
            self.warnings.append(f"Elements {name} are {state}.")
        width, begin, values = 1 + CORNERS.get(kind, -1), 0, list[str]()
        for line, fields in card.rows():
            begin, values = (begin, values + fields) if values else (line, fields)
            if len(values) < width:
                continue  # The next line goes on.
            proper = not kind or (len(values) % width == 0 and all(map(str.isdecimal, values)))
            card.need(proper, f"{len(values)} numbers; needed {width} for an element {name}", begin)
            for at in range(0, len(values), width) if kind else [0]:
                ends = values[at + 1 : at + width]
                try:
                    nodes = [known[card.prefix + end] for end in ends]
                except KeyError as error:
                    card.need(False, f"node {error}; needed nodes of the deck", begin)
                row = begin, values[at:]
                indices.append(self._number("ELSET", card, row, self.elements, (name, kind, faces, nodes)))
            values = []
        card.need(not values, f"{len(values)} numbers; needed {width} for an element {name}", begin)
        return indices

    def members(self, kind: str, card: _Card, text: str, line: int, depth: int = 0) -> list[int]:
        """Return the indices of nodes or elements, which a card gives by a number or by the name of a set."""
        label = card.prefix + (text if text.isdecimal() else _label(text))
        if label in self.indices[kind]:
            return [self.indices[kind][label]]
        known = (kind, label) in self.sets and depth < _DEEPEST
        card.need(known, f"{text}; needed a number or an {kind} of the deck, and no sets in a circle", line)
        return self.set(kind, label, depth)

    def set(self, kind: str, label: str, depth: int = 0) -> list[int]:
        """Return the indices of the nodes or elements of a set."""
        if (kind, label) not in self.known:
            members: dict[int, None] = {}
            for part in self.sets[kind, label]:
                if isinstance(part, list):
                    members |= dict.fromkeys(part)
                    continue
                card = replace(part, prefix=part.label("INSTANCE") + ".") if "INSTANCE" in part.parameters else part
                for line, fields in card.rows():
                    if "GENERATE" in card.parameters:
                        first, last, step = map(int, card.numbers(line, [*fields, "1", ""][:3]))
                        proper = step > 0 and last - first in range(_LONGEST)
                        card.need(proper, f"{', '.join(fields)}; needed a first number, a last one, and a step", line)
                        numbers = list(map(str, range(first, last + 1, step)))
                        fields = [each for each in numbers if card.prefix + each in self.indices[kind]]
                        if len(fields) < len(numbers):
                            self.warnings.append(
                                f"{kind} {label}: {len(fields)} of {len(numbers)} numbers are in the deck."
                            )
                    for each in filter(None, fields):
                        members |= dict.fromkeys(self.members(kind, card, each, line, depth + 1))
            self.known[kind, label] = list(members)
        return self.known[kind, label]

    def cells(self, elements: Iterable[int]) -> Group:
        """Return the nodes of elements, those of each kind as an array (n, n_corners)."""
        cells: dict[str, list[list[int]]] = {}
        for element in elements:
            _, kind, _, nodes = self.elements[element]
            cells.setdefault(kind, []).append(nodes)
        return {kind: np.array(nodes) for kind, nodes in cells.items() if kind}

    def boundary(self, elements: Iterable[int]) -> dict[frozenset[int], list[int]]:
        """Return the sides that have one of these solid cells, which is behind them, by their corners."""
        cells = self.cells(element for element in elements if _is_solid(self.elements[element][2]))
        points = self.places[:, :2] if {*cells} <= {"triangle", "quad"} else self.places
        sides = CellSides.collect(cells, points).outer.values()
        return {frozenset(side): side for part in sides for side in part.tolist()}

    def surface(self, label: str) -> Group:
        """Return the sides of a surface by kind."""
        sides, owners, whole = list[list[int]](), list[int](), list[int]()  # Elements with a face, or all free faces.
        for card in self.sets["SURFACE", label]:
            assert isinstance(card, _Card)
            form = _label(card.parameters.get("TYPE", "ELEMENT"))
            if form not in ("NODE", "ELEMENT") or {"COMBINE", "CROP"} & set(card.parameters):
                return {}  # An analytical surface, or one that is made of others.
            for line, (member, *rest) in card.rows():
                if form == "NODE":
                    sides += [[node] for node in self.members("NSET", card, member, line)]
                    continue
                face = _label((*rest, "")[0])
                for element in self.members("ELSET", card, member, line):
                    name, _, faces, nodes = self.elements[element]
                    proper = face in faces or (not face and _is_solid(faces))
                    needed = f"needed {', '.join(faces) or 'elements that are read'}"
                    card.need(proper, f"face {face or 'none'} of elements {name}; {needed}", line)
                    (owners if face in faces else whole).append(element)
                    if face in faces:
                        sides.append([nodes[corner] for corner in faces[face]])
                        card.need(len({*sides[-1]}) == len(sides[-1]), f"{name} with a node twice on {face}", line)
        if (owners or whole) and any(len(side) == 1 for side in sides):  # CalculiX may have two surfaces of a name.
            self.warnings.append(f"The surface {label} of nodes is not read, but that of faces.")
            sides = [side for side in sides if len(side) > 1]
        behind = self.boundary(owners)
        outer = self.boundary(range(len(self.elements))) if whole else {}
        sides = [behind.get(frozenset(side), side) for side in sides]
        sides += [side for key, side in self.boundary(whole).items() if key in outer]
        each = dict.fromkeys(map(tuple, sides))
        if len(each) < len(sides):
            self.warnings.append(f"The surface {label} has {len(sides) - len(each)} of its sides twice.")
        return {_SIDES[n]: np.array([side for side in each if len(side) == n]) for n in sorted({*map(len, each)})}


def read_deck(path: str, place: str) -> PlainMesh:
    """Read an input deck of Abaqus or CalculiX; it may include files of its `place`, where it may lie compressed.

    Groups are surfaces and sets. One of an instance is ``INSTANCE.NAME``, and ``NAME`` if no other instance has that
    name. A set with the name of a surface ends with "(ELSET)" or "(NSET)". A ValueError says why the deck cannot be
    read; its lines are counted with included files in their places.
    """
    deck = _Deck(_expand(path, [place]))
    _Card("ELEMENT", {}, "", 1).need(bool(deck.elements), "no elements; needed a deck with *NODE and *ELEMENT")
    groups: dict[str, Group] = {}
    keys: dict[_Key, str] = {}  # The names of groups.
    for kind, label in sorted(deck.sets, key=lambda key: [*_SETS].index(key[0])):
        if kind == "NSET":
            group = {"vertex": np.array([[node] for node in deck.set(kind, label)])}
        else:
            group = deck.surface(label) if kind == "SURFACE" else deck.cells(deck.set(kind, label))
        if any(map(len, group.values())):
            name = "".join(deck.names[kind, label])
            keys[kind, label] = name + f" ({kind})" * (name in groups)
            groups[keys[kind, label]] = group
        else:
            deck.warnings.append(f"{kind} {label} has no members that are read.")
    if (unused := len(deck.points) - len({node for *_, nodes in deck.elements for node in nodes})) > 0:
        deck.warnings.append(f"{unused} nodes belong to no element.")  # Of a deck that was cut, say.
    owners = Counter(name for _, name in {*deck.names.values()})
    for key, full_name in keys.items():
        if owners[deck.names[key][1]] == 1:
            groups.setdefault(deck.names[key][1], groups[full_name])
    pairs, others = list[tuple[str, str]](), list[tuple[str, str]]()
    laws, sections, material = dict[str, tuple[float, float]](), dict[str, str](), ""
    for card in deck.cards:
        rows = card.rows() if card.keyword in _OTHER_CARDS else []
        if card.keyword in _PAIRS:
            for line, fields in rows:
                if len(fields) == 1:
                    deck.warnings.append(f"Not read: the contact of {fields[0]} with itself.")
                    continue
                names = [keys.get(("SURFACE", card.prefix + _label(text)), "") for text in fields[:2]]
                is_pair = card.keyword == "CONTACTPAIR"
                unknown = ", ".join(text for text, name in zip(fields, names, strict=False) if not name)
                needed = "needed two surfaces of the deck, the slave first"
                card.need(
                    not (unknown and is_pair), f"{unknown}, which is no surface of faces or nodes; {needed}", line
                )
                if all(names):
                    (pairs if is_pair else others).append((names[0], names[1]))
            deck.warnings += ["*CONTACT PAIR: ADJUST is not read; no node is moved."] * ("ADJUST" in card.parameters)
        elif card.keyword == "MATERIAL":
            material = card.label("NAME")
        elif card.keyword == "ELASTIC" and rows and _label(card.parameters.get("TYPE", "ISO"))[:3] == "ISO":
            table = [card.numbers(line, [*fields, ""]) for line, fields in rows]
            laws.setdefault(material, (table[0][0], table[0][1]))
        elif card.keyword == "SOLIDSECTION" and (name := keys.get(("ELSET", card.prefix + card.label("ELSET")), "")):
            sections[name] = card.label("MATERIAL")
    deck.warnings += [f"{name}: no isotropic *ELASTIC of {law}." for name, law in sections.items() if law not in laws]
    return PlainMesh(
        points=deck.places if deck.places[:, 2].any() else deck.places[:, :2],
        cells=deck.cells(range(len(deck.elements))),
        groups=groups,
        pairs=tuple(pairs or others),
        materials={name: laws[law] for name, law in sections.items() if law in laws},
        warnings="".join(f"{text}\n" for text in dict.fromkeys(deck.warnings)),
    )
