"""XML files of robots: roots, numbers and names in them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from atwood import UsageError
from atwood.xml_files import XMLElement, read_xml as read_data

__all__ = ["XMLElement", "name_of", "number", "numbers", "only", "read_xml"]


def read_xml(file: Path, *roots: str) -> XMLElement:
    """Return the root element of a file, which may be one of some.

    Raises
    ------
    UsageError
        If the file cannot be read, is no XML, declares a document type, or has another root element.
    """
    try:
        data = file.read_bytes()
    except OSError as error:
        raise UsageError(f"the file cannot be read ({error.strerror})", where=str(file)) from None
    found = read_data(data, str(file))
    if found.tag not in roots:
        raise UsageError(f"its root element is <{found.tag}> and not <{roots[0]}>", where=found.place)
    return found


def numbers(node: XMLElement, name: str, count: int | None, default: Any = None) -> tuple[float, ...]:
    """Return the numbers of an attribute; `default` where there is none, which is refused without a default."""
    text = node.attrib.get(name)
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


def number(node: XMLElement, name: str, default: float | None = None) -> float:
    """Return the number of an attribute."""
    return numbers(node, name, 1, None if default is None else (default,))[0]


def name_of(node: XMLElement, attribute: str = "name") -> str:
    """Return the name in an attribute, which must be there."""
    name = node.get(attribute).strip()
    if not name:
        raise UsageError(f"<{node.tag}> has no {attribute!r}", where=node.place)
    return name


def only(node: XMLElement, tag: str) -> XMLElement | None:
    """Return the child of a kind, None if there is none; two are refused."""
    found = node.findall(tag)
    if len(found) > 1:
        raise UsageError(f"<{node.tag}> has {len(found)} elements <{tag}>", where=found[1].place)
    return found[0] if found else None
