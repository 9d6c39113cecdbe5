"""A page as one file: what it shows as data, and the modules that show it, packed so that nothing is fetched."""

from __future__ import annotations

import base64
import functools
import gzip
import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from atwood.codegen.cache import default_cache, make_key

_HERE = Path(__file__).parent

_MODULES = ("elements", "track", "shapes", "view", "plots", "live", "page")
"""Modules of JavaScript, each after those that it imports."""

_TYPES = {"f": "f4", "d": "f8", "i": "i4"}
"""Kinds of arrays as the page knows them."""


class Numbers:
    """Arrays one after another, each where its numbers may begin in memory."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def put(self, array: Any) -> dict[str, Any]:
        """Add an array, and return where it is."""
        values = np.ascontiguousarray(array)
        if values.dtype.kind in "iub":
            values = values.astype(np.int32)
        # Of each row the first bytes of all numbers, then their second ones: what is alike stands together.
        row = values.shape[-1]
        single = values.astype(values.dtype.newbyteorder("<")).reshape(-1, row, 1).view(np.uint8)
        raw = np.ascontiguousarray(single.transpose(0, 2, 1)).tobytes()
        found = {"$": _TYPES[values.dtype.char], "at": self._size, "count": int(values.size), "row": row}
        self._pieces += [raw, bytes(-len(raw) % 8)]
        self._size += len(raw) + len(self._pieces[-1])
        return found

    def all(self) -> bytes:
        """Return all of them."""
        return b"".join(self._pieces)


def _plain(value: Any, numbers: Numbers) -> Any:
    """Return data with its arrays put among the numbers; short ones stay as they are."""
    if isinstance(value, np.ndarray):
        return value.ravel().tolist() if value.size <= 12 and np.all(np.isfinite(value)) else numbers.put(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(one, numbers) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one, numbers) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def kept_text(name: str, parts: Iterable[object], make: Callable[[], str]) -> str:
    """Return a text that is the same for all pages, from the cache where it was made before."""
    cache, key = default_cache(), make_key(["page", name, *parts])
    found = None if cache is None else cache.read(key)
    if found is not None:
        return found.decode()
    made = make()
    if cache is not None:
        cache.write(key, made.encode())
    return made


@functools.cache
def _library() -> str:
    """Return the library that draws, packed."""
    text = (_HERE / "vendor" / "three.js").read_text(encoding="utf-8")
    return kept_text("library", [text], lambda: _packed(json.dumps({"three": text}).encode()))


def library_script() -> str:
    """Return a script with the library that draws, for pages of one site that share it."""
    return f'window.atwoodLibrary = "{_library()}";\n'


def page_style() -> str:
    """Return the style of all pages."""
    return (_HERE / "page.css").read_text(encoding="utf-8")


def _script(*names: str) -> str:
    return "".join((_HERE / "javascript" / f"{name}.js").read_text(encoding="utf-8") for name in names)


def widget_script() -> str:
    """Return the module that shows packets in a notebook."""
    return _script("unpack", "widget")


def pack(payload: Mapping[str, Any], modules: Mapping[str, str]) -> dict[str, str]:
    """Return the packets of a page: the library that draws, the modules, arrays, and the other data."""
    numbers = Numbers()
    told = json.dumps(_plain(payload, numbers), allow_nan=False)
    texts = {name: _script(name) for name in _MODULES}
    return {
        "library": _library(),
        "modules": _packed(json.dumps({**modules, **texts}).encode()),
        "numbers": _packed(numbers.all()),
        "payload": _packed(told.encode()),
    }


def write_document(payload: Mapping[str, Any], still: str, modules: Mapping[str, str], library: str = "") -> str:
    """Return the page.

    Parameters
    ----------
    payload
        What it shows, with arrays in it.
    still
        The still picture, as SVG.
    modules
        Further modules of this page alone.
    library
        Where `library_script` is, for a page that does not hold it itself.
    """
    loader, style = _script("unpack", "load"), page_style()
    # Only the loader's own text may run, and what it unpacks from the page; nothing may be fetched.
    digest = base64.b64encode(hashlib.sha256(loader.encode()).digest()).decode()
    shared = "'self' file: " if library else ""
    scripts = f"script-src {shared}'sha256-{digest}' blob:"
    policy = f"default-src 'none'; {scripts}; style-src 'unsafe-inline'; img-src data: blob:"
    packed = pack(payload, modules)
    if library:
        del packed["library"]
    holders = "".join(f'<script type="text/plain" id="{name}">{text}</script>\n' for name, text in packed.items())
    if library:
        holders += f'<script src="{escape(library)}"></script>\n'
    title = escape(str(payload["title"]))
    return (
        '<!doctype html>\n<html lang="en" data-mode="loading">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}; media-src blob:">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        f'<div id="page"></div>\n<figure id="still">{still}<figcaption>{title}</figcaption></figure>\n'
        f"{holders}<script>{loader}</script>\n</body>\n</html>\n"
    )
