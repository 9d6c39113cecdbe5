"""What sticks until it is pulled too hard, slips either way, and sticks again when it comes to rest."""

from __future__ import annotations

from atwood import Component, Scalar, event, parameter


class StickSlip(Component):
    """The modes of dry friction, and what leads from one to another; parts say how fast they slip, and what holds."""

    modes = ("sticks", "slips_ahead", "slips_back")
    mode_parameter = "starts"

    starts: str = parameter("sticks", choices=("sticks", "slips_ahead", "slips_back"), doc="How it starts.")

    def slip(self) -> Scalar:
        """Return how fast one side slides over the other."""
        raise NotImplementedError

    def most(self) -> Scalar:
        """Return the largest friction, of which the constraint force `grip` is held."""
        raise NotImplementedError

    @event(modes=("sticks",), direction=1, unit="N", target="slips_ahead", message="it slips ahead")
    def lets_go_ahead(self) -> Scalar:
        """Return by how much it is pulled ahead too hard."""
        return -self.reaction("grip") - self.most()

    @event(modes=("sticks",), direction=1, unit="N", target="slips_back", message="it slips back")
    def lets_go_back(self) -> Scalar:
        """Return by how much it is pulled back too hard."""
        return self.reaction("grip") - self.most()

    @event(modes=("slips_ahead",), direction=-1, unit="m/s", target="sticks", message="it comes to rest")
    def stops_ahead(self) -> Scalar:
        """Return the slip."""
        return self.slip()

    @event(modes=("slips_back",), direction=1, unit="m/s", target="sticks", message="it comes to rest")
    def stops_back(self) -> Scalar:
        """Return the slip."""
        return self.slip()
