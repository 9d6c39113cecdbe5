"""Atwood: mechanics from parts."""

from atwood.expr import *  # noqa
from atwood.model.component import Component
from atwood.model.composite import Model, connect
from atwood.model.connectors import Connector, Frame, Groove, Point, connector
from atwood.model.fields import parameter, signal
from atwood.model.laws import *  # noqa
from atwood.model.laws import Load, force
from atwood.model.scene import Scene
from atwood.model.vector import Vector, as_vector, cross, dot, norm
