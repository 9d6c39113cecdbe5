"""XML with the place of each element, and without entities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

from atwood.errors import UsageError

__all__ = ["XMLElement", "read_xml"]


class XMLElement(ElementTree.Element):
    """An element of an XML file, with what is in it.

    Parameters
    ----------
    tag, attributes
        Its name and its attributes.
    place
        The file and the line where it is written.
    text
        Its text.
    inner
        The elements in it.
    """

    def __init__(
        self,
        tag: str,
        attributes: dict[str, str],
        place: str = "",
        text: str = "",
        inner: Iterable[ElementTree.Element] = (),
    ) -> None:
        super().__init__(tag, attributes)
        self.place, self.text = place, text
        self.extend(inner)

    def __iter__(self) -> Iterator[XMLElement]:
        """Go through what is in it."""
        inner: Any = self[:]
        return iter(inner)

    def get(self, key: str, default: str = "") -> str:  # type: ignore[override]
        """Return an attribute."""
        return self.attrib.get(key, default)

    def findall(  # type: ignore[override]
        self, path: str, namespaces: dict[str, str] | None = None
    ) -> list[XMLElement]:
        """Return what is in it of one kind."""
        found: Any = super().findall(path, namespaces)
        return list(found)


def read_xml(data: bytes, where: str) -> XMLElement:
    """Return the root element of an XML file, which may have neither a document type nor entities.

    Parameters
    ----------
    data
        What is in the file.
    where
        Its name.

    Returns
    -------
    XMLElement
        The root; each element has its ``place``.

    Raises
    ------
    UsageError
        If it is no XML, or declares a document type, in which there could be entities.
    """
    builder, parser = ElementTree.TreeBuilder(element_factory=XMLElement), expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        made: Any = builder.start(tag, attributes)
        made.place = f"{where}:{parser.CurrentLineNumber}"

    def end(tag: str) -> None:
        made: Any = builder.end(tag)
        made.text = made.text or ""

    def refuse(*_: object) -> None:
        raise UsageError(
            "its XML declares a document type, which could hold entities, and none are expanded",
            where=f"{where}:{parser.CurrentLineNumber}",
            advice="Take the DOCTYPE away.",
        )

    parser.StartElementHandler, parser.CharacterDataHandler, parser.EndElementHandler = begin, builder.data, end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        said = expat.ErrorString(error.code)
        raise UsageError(f"it is no XML, or cut off ({said})", where=f"{where}:{error.lineno}") from None
    except (ValueError, LookupError) as error:  # an encoding that Python does not know
        raise UsageError(f"it is no XML ({error})", where=where) from None
    found: Any = builder.close()
    return found  # type: ignore[no-any-return]
