"""`atwood info`: the mechanism report."""

from __future__ import annotations

from atwood.arguments import FLAG, NAME
from atwood.cli.command import Request, command
from atwood.cli.output import print_json, writer
from atwood.cli.parts import is_a_part, show_part
from atwood.cli.scenes import prepare


def show_info(request: Request) -> None:
    """Say what SCENE is made of: bodies, joints, freedom, constraints, and what its equations cost.

    With the name of a part, such as Pivot, or what textbooks or Modelica call it, such as Revolute: its connectors,
    parameters, inputs and quantities.
    """
    if is_a_part(request.scene):
        show_part(request.scene, request.as_json, bool(request.settings or request.start_values or request.moved))
        return
    from atwood.reporting import report
    from atwood.reporting.text import described, parameters

    model, name = prepare(request.scene, request.settings, request.start_values)
    found = report(model, name, orientation=request.orientation)
    if request.as_json:
        print_json(found.to_dict())
        return
    out = writer()
    out.show(described(found))
    out.line()
    if request.moved:
        out.line((str(found.initialization), ""))
    else:
        out.show(parameters(found))


COMMAND = command("info", show_info, more={"moved": (FLAG, False), "orientation": (NAME, "quaternion")})
