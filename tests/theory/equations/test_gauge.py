"""The rate of a function added to L leaves the equations, and changes momenta and H as books say."""

from __future__ import annotations

import pytest
import sympy
from click.testing import CliRunner
from sympy import cos, diff

from atwood import UsageError, conserved, equations, hamiltonian, simulate
from atwood.cli import main
from atwood_library.scenes import ChargedParticle, DoublePendulum, FreeBody, Kepler, RotatingHoopDriven, SimplePendulum

t = sympy.Symbol("t")

CASES = [
    (SimplePendulum, "m*l*theta*t"),
    (DoublePendulum, "m_1*l_1**2*cos(theta_1 - theta_2)*t**2"),
    (Kepler, "m*x*z/(1 + t**2)"),
    (RotatingHoopDriven, "theta**2*sin(t)"),
    (ChargedParticle, "q*B*x*z/2"),
]


def read(text: str, eq: object) -> sympy.Expr:
    known = {one.func.__name__: one for one in eq.coordinates} | {str(one): one for one in eq.values}
    return sympy.sympify(text, known | {"t": t})


@pytest.mark.sample(3)
@pytest.mark.parametrize(("kind", "gauge"), CASES, ids=[one.__name__ for one, _ in CASES])
def test_the_equations_stay_and_momenta_and_h_change(kind: type, gauge: str) -> None:
    """``p + df/dq`` in place of p, and ``H(q, p - df/dq) - df/dt``; of a sympy expression as of text."""
    plain, other = equations(kind()), equations(kind(), gauge=gauge)
    f = read(gauge, plain)
    assert other.rows == plain.rows
    assert sympy.expand(other.lagrangian - plain.lagrangian - diff(f, t), trig=True) == 0
    for q, p, before in zip(plain.coordinates, other.momenta, plain.momenta, strict=True):
        assert sympy.expand(p - before - diff(f, q), trig=True) == 0
    h, changed = hamiltonian(kind()), hamiltonian(kind(), gauge=f)
    slopes = [diff(f, q) for q in h.coordinates]
    moved = h.expression.subs({p: p - one for p, one in zip(h.momenta, slopes, strict=True)}, simultaneous=True)
    still = {q: sympy.Symbol(q.func.__name__) for q in h.coordinates}
    by_time = diff(f.subs(still), t).subs({one: q for q, one in still.items()})
    assert sympy.simplify(sympy.expand(changed.expression - moved + by_time)) == 0


def test_h_of_a_gauge_follows_the_same_motion() -> None:
    """Hamilton's equations of both are those of the run."""
    result = simulate(SimplePendulum(), t_end=1.0, outputs=5)
    h = hamiltonian(SimplePendulum(), gauge="m*l*theta*t")
    angle, rate = result["rod.angle"], result["rod.angular_velocity"]
    for time, q, v in zip(result.time, angle, rate, strict=True):
        p = h.momenta_at([q], [v], time)
        assert p == pytest.approx([v + time])
        assert h.velocities_at([q], p, time) == pytest.approx([v])
    assert not h.is_conserved


def test_a_gauge_shows_an_ignorable_coordinate() -> None:
    """The symmetric gauge of a uniform field becomes Landau's, in which p_x is conserved."""
    assert "p:particle.position.x" not in conserved(ChargedParticle())
    found = conserved(ChargedParticle(), gauge="q*B*x*z/2")
    assert "p:particle.position.x" in found
    assert found["p:particle.position.x"].proven


def test_what_is_no_function_of_place_and_time_is_refused() -> None:
    theta = equations(SimplePendulum()).coordinates[0]
    with pytest.raises(UsageError, match="depends on velocities"):
        equations(SimplePendulum(), gauge=diff(theta, t))
    with pytest.raises(UsageError, match="foo is no symbol of the scene"):
        hamiltonian(SimplePendulum(), gauge="foo*t")
    with pytest.raises(UsageError, match="in Euler angles"):
        equations(FreeBody(), gauge="t")
    assert equations(SimplePendulum(), gauge=2 * cos(theta)).text().count("L₁ = ") == 1


@pytest.mark.parametrize("command", ["equations", "hamiltonian", "conserved"])
def test_commands_take_it(command: str) -> None:
    arguments = [command, "charged-particle", "--gauge", "q*B*x*z/2"]
    assert "q B z" in CliRunner().invoke(main, arguments, catch_exceptions=False).output
