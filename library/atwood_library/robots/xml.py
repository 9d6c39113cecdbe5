"""XML with the place of each element, and without entities: what robots' files are written in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from atwood import UsageError

__all__ = ["Node", "name_of", "number", "numbers", "only", "read_xml"]


@dataclass
class Node:
    """An element: its attributes, its text, what is in it, and the file and the line where it is written."""

    tag: str
    attributes: dict[str, str]
    place: str
    text: str = ""
    inner: list[Node] = field(default_factory=list)

    def __iter__(self) -> Iterator[Node]:
        return iter(self.inner)

    def get(self, name: str, default: str = "") -> str:
        """Return an attribute."""
        return self.attributes.get(name, default)

    def findall(self, tag: str) -> list[Node]:
        """Return what is in it of one kind."""
        return [one for one in self.inner if one.tag == tag]


def read_xml(file: Path, *roots: str) -> Node:
    """Return the root element of a file.

    Parameters
    ----------
    file
        The file.
    *roots
        What its root element may be.

    Raises
    ------
    UsageError
        If the file cannot be read, is no XML, declares a document type (and with it perhaps entities), or has another
        root element.
    """
    try:
        data = file.read_bytes()
    except OSError as error:
        raise UsageError(f"the file cannot be read ({error.strerror})", where=str(file)) from None
    stack: list[Node] = []
    found: list[Node] = []
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag, attributes, f"{file}:{parser.CurrentLineNumber}")
        (stack[-1].inner if stack else found).append(node)
        stack.append(node)

    def text(data: str) -> None:
        stack[-1].text += data

    def refuse(*_: Any) -> None:
        raise UsageError(
            "it declares a document type, which could hold entities, and none are expanded",
            where=f"{file}:{parser.CurrentLineNumber}",
            advice="Take the DOCTYPE away.",
        )

    parser.StartElementHandler, parser.CharacterDataHandler = begin, text
    parser.EndElementHandler = lambda tag: stack.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise UsageError(
            f"it is no XML, or cut off ({expat.ErrorString(error.code)})", where=f"{file}:{error.lineno}"
        ) from None
    except (ValueError, LookupError) as error:  # an encoding that Python does not know
        raise UsageError(f"it is no XML ({error})", where=str(file)) from None
    if found[0].tag not in roots:
        raise UsageError(f"its root element is <{found[0].tag}> and not <{roots[0]}>", where=found[0].place)
    return found[0]


def numbers(node: Node, name: str, count: int | None, default: Any = None) -> tuple[float, ...]:
    """Return the numbers of an attribute; `default` where there is none, which is refused without a default."""
    text = node.attributes.get(name)
    if text is None:
        if default is None:
            raise UsageError(f"<{node.tag}> has no {name!r}", where=node.place)
        return tuple(default)
    try:
        found = tuple(math.nan if "_" in word else float(word) for word in text.split())  # 1_0 is Python's alone
    except ValueError:
        found = (math.nan,)
    if not all(map(math.isfinite, found)) or (count is not None and len(found) != count):
        wanted = "numbers" if count is None else f"{count} number{'s' if count > 1 else ''}"
        raise UsageError(f"{name!r} of <{node.tag}> should be {wanted} and is {text[:60]!r}", where=node.place)
    return found


def number(node: Node, name: str, default: float | None = None) -> float:
    """Return the number of an attribute."""
    return numbers(node, name, 1, None if default is None else (default,))[0]


def name_of(node: Node, attribute: str = "name") -> str:
    """Return the name in an attribute, which must be there."""
    name = node.get(attribute).strip()
    if not name:
        raise UsageError(f"<{node.tag}> has no {attribute!r}", where=node.place)
    return name


def only(node: Node, tag: str) -> Node | None:
    """Return the child of a kind, None if there is none; two are refused."""
    found = node.findall(tag)
    if len(found) > 1:
        raise UsageError(f"<{node.tag}> has {len(found)} elements <{tag}>", where=found[1].place)
    return found[0] if found else None
