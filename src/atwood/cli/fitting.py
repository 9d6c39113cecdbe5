"""`atwood fit`: parameters and start values of a scene from measurements."""

from __future__ import annotations

import click

from atwood.cli.command import PICTURE, Request, command
from atwood.cli.output import answer
from atwood.cli.scenes import check_applies, prepare
from atwood.errors import UsageError
from atwood.study.sensitivities.fit import fit


def fit_scene(request: Request) -> None:
    """Fit parameters and start values of SCENE to the measurements in DATA.

    DATA is one CSV file or several, with the time in the first column. Other columns are called by the paths of
    quantities, perhaps with a unit in brackets: bob.position.x [mm].
    """
    if not request.vary and not request.start:
        raise UsageError("nothing is varied", advice="Write --vary PATH or --vary PATH=LOW:HIGH.")
    scene, _ = prepare(request.scene, request.settings, request.start_values)
    check_applies(scene, request.form or "reduced", "ggl")
    found = fit(scene, list(request.data), **request.of(fit, leave=("data",)))
    if request.plot is not None:
        found.plot(file=request.plot)
    answer(request.as_json, found.to_data(), found.tables(), plotted=request.plot)


COMMAND = command("fit", fit_scene, fit, more={"plot": PICTURE}, names={"start": "--vary-start"})
COMMAND.params.insert(1, click.Argument(["data"], nargs=-1, required=True))
