"""Writing to the terminal: strict JSON and rich text."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["console", "print_json", "strict", "warn"]


def print_json(data: Mapping[str, Any]) -> None:
    """Write strict JSON to standard output.

    Parameters
    ----------
    data
        Plain data; numbers that are not finite become null.
    """
    click.echo(json.dumps(strict(data), indent=2, allow_nan=False))


def strict(value: Any) -> Any:
    """Return data as strict JSON knows it."""
    if isinstance(value, Mapping):
        return {str(key): strict(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(one) for one in value]
    if isinstance(value, float):  # NumPy's floats are floats too
        return float(value) if math.isfinite(value) else None
    if value is None or isinstance(value, (str, bool, int)):
        return value
    return strict(value.item()) if hasattr(value, "item") else str(value)


def console() -> Console:
    """Return the console for texts on standard output; where there is no terminal it is 120 columns wide."""
    from rich.console import Console

    made = Console(highlight=False)
    if not made.is_terminal and "COLUMNS" not in os.environ:
        made = Console(highlight=False, width=120)
    return made


def warn(text: str) -> None:
    """Write a line to standard error."""
    click.echo(text, err=True)
