"""`atwood equations`: the equations of motion of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from atwood.cli.output import print_json
from atwood.cli.scenes import prepare
from atwood.errors import UsageError
from atwood.late import dataclass

if TYPE_CHECKING:
    from atwood.analysis.equation_formulas import Parameters
    from atwood.analysis.equations import EquationsOfMotion
    from atwood.analysis.hamiltonian import Hamiltonian

__all__ = ["EquationsRequest", "show_equations"]


@dataclass(frozen=True)
class EquationsRequest:
    """What was asked for on the command line."""

    scene: str
    settings: Sequence[str]
    starts: Sequence[str]
    as_json: bool
    form: str
    orientation: str
    values: bool
    latex: bool
    markdown: bool
    python: bool
    hamiltonian: bool


def show_equations(request: EquationsRequest) -> None:
    """Write the equations of motion of a scene to standard output."""
    from atwood.analysis.equations import read_equations
    from atwood.pipeline import assemble

    chosen = [name for name in ("latex", "markdown", "python", "as_json") if getattr(request, name)]
    if len(chosen) > 1:
        names = " and ".join(f"--{name.removeprefix('as_')}" for name in chosen)
        raise UsageError(f"{names} do not go together", advice="Give one of them.")
    scene, name = prepare(request.scene, request.settings, request.starts)
    assembly = assemble(scene, form=request.form, orientation=request.orientation, name=name)
    parameters: Parameters = "values" if request.values else "symbolic"
    found: EquationsOfMotion | Hamiltonian
    if request.hamiltonian:
        if request.python:
            raise UsageError("--hamiltonian is not written in Python", advice="Give --latex, --markdown or --json.")
        from atwood.analysis.hamiltonian import read_hamiltonian

        found = read_hamiltonian(assembly, parameters)
    else:
        found = read_equations(assembly, parameters)
    if request.as_json:
        print_json(found.to_dict())
        return
    written = getattr(found, chosen[0])() if chosen else found.text()
    click.echo(written if written.endswith("\n") else f"{written}\n", nl=False)
