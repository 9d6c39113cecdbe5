"""What an expert would write by hand for every scene, counted, and met.

The counts follow from the equations in the comments. What depends on parameters alone is computed once and counts
nothing. A flop is an addition, subtraction, multiplication, division or sign.
"""

from dataclasses import dataclass

import pytest

from atwood_library.scenes import SCENES

from ..helpers.runs import EVERYDAY, prepare


@dataclass(frozen=True)
class ByHand:
    coordinates: int
    speeds: int
    multipliers: int
    constraints: int
    states: int
    flops: int
    trig: int = 0
    solves: int = 0


TABLE: dict[tuple[str, str], ByHand] = {
    # theta' - w; m l^2 w' + m g l sin(theta): 1 + 3
    ("simple-pendulum", "reduced"): ByHand(1, 1, 0, 0, 2, flops=4, trig=1),
    # X = x/l, Z = z/l: 2; mu X, mu Z, la X, la Z: 4; x' - vx + mu X and z: 4; m vx' - la X: 2; m vz' + m g - la Z: 3;
    # (x x + z z)/(2 l) - l/2: 5; X vx + Z vz: 3
    ("simple-pendulum", "dae"): ByHand(2, 2, 1, 1, 6, flops=23),
    # s, c of (th1 - th2): 1 flop, 2 trig; S = m2 l1 l2 s, C = m2 l1 l2 c: 2; thi' - wi: 2;
    # A w1' + C w2' + S (w2 w2) + P sin(th1): 5 mul, 3 add; C w1' + B w2' - S (w1 w1) + Q sin(th2): 8
    ("double-pendulum", "reduced"): ByHand(2, 2, 0, 0, 4, flops=21, trig=4),
    # r2 - r1: 2; X, Z of both rods: 4; mu and la times them: 8; positions' rows: 3+3+2+2; m a rows: 3+4+2+3;
    # lengths: 5+5; rates: X1 vx1 + Z1 vz1: 3, X2 (vx2 - vx1) + Z2 (vz2 - vz1): 5.
    ("double-pendulum", "dae"): ByHand(4, 4, 2, 2, 12, flops=54),
    # S = m l sin, C = m l cos: 2; x' - v, th' - w: 2; (M+m) v' + C w' - S (w w): 6; C v' + m l^2 w' + g S: 5
    ("pendulum-on-cart", "reduced"): ByHand(2, 2, 0, 0, 4, flops=15, trig=2),
    # r2 - r1: 2; X, Z: 2; mu and la times them: 4; positions' rows: 2, 3 (the rail's mu), 2, 2;
    # cart: M a + la X: 2, M a + M g + la Z - N: 4 (with products made: mul, add, add, sub); bob: 2, 3;
    # length: 5; rail: z and vz themselves: 0; rate: 5. Locking the cart's rotation leaves nothing: a point has none.
    ("pendulum-on-cart", "dae"): ByHand(4, 4, 2, 2, 12, flops=38),
    # xi' - vi: 2; m a1 + (k1 + k2) x1 - k2 x2 - c1: 3 mul, 3 add; the same for m2
    ("mass-spring-chain", "reduced"): ByHand(2, 2, 0, 0, 4, flops=14),
    ("mass-spring-chain", "dae"): ByHand(2, 2, 0, 0, 4, flops=14),
    # z' - v; (m1 + m2) v' + (m1 - m2) g
    ("atwood", "reduced"): ByHand(1, 1, 0, 0, 2, flops=3),
    # zi' - vi + mu: 4; mi ai + mi g + la: 6; z1 + z2 + L: 2; v1 + v2: 1
    ("atwood", "dae"): ByHand(2, 2, 1, 1, 6, flops=13),
    # zi' - vi: 2; (m1 + 4 m3) a1 + 2 m3 a2 + (m1 - 2 m3) g: 4; 2 m3 a1 + (m2 + m3) a2 + (m2 - m3) g: 4
    ("double-atwood", "reduced"): ByHand(2, 2, 0, 0, 4, flops=10),
    # positions' rows: 2 + 4 (zp' - vp - mu1 + 2 mu2) + 2 + 2; mi ai + mi g + T: 9; the pulley T1 - 2 T2: 2;
    # z1 + zp + L1: 2; v1 + vp: 1; 2 zp - z2 - z3 - L2: 4; 2 vp - v2 - v3: 3
    ("double-atwood", "dae"): ByHand(4, 4, 2, 2, 12, flops=31),
    # th1' - w1 for the independent angle: 1; li ci, li si: 6; closing the loop: 3 + 2; its rate: 5 + 5;
    # C, S of (th1 - th2), which crank and coupler share: 1 + 2; A a1 + C a2 + S (w2 w2) + P c1: 8; the same: 8;
    # the rocker B a3 + Q c3: 3; solving for the two forces in the cut: 2 signs in the matrix; r1 - G1 . f: 4
    ("four-bar", "reduced"): ByHand(3, 3, 0, 2, 6, flops=50, trig=8, solves=1),
    # hi ci, hi si of three half links: 6; pivots: 2 + 6 + 6 + 3; their rates: 6 products, 2 + 6 + 6 + 2;
    # forces on the centres: (3 + 4) for each; J alpha less the moments of the sums of both ends' forces: 7 each;
    # positions' rows: 6 x 3; angles' rows: 3 x 8, one of them by 1/L^2
    ("four-bar", "dae"): ByHand(9, 9, 8, 8, 34, flops=129, trig=6),
    # th1' - w1: 1; l1 s1 + l2 s2: 3; l1 c1, l2 c2: 2; rate: 3; C, S of (th1 - th2): 1 + 2; two rows of 8;
    # r1 - G1 (r2/G2): 3
    ("slider-crank", "reduced"): ByHand(2, 2, 0, 1, 4, flops=31, trig=6),
    # hi ci, hi si: 4; pivots: 2 + 6 + 4; guide: z itself; rates: 4 products, 2 + 6 + 4; forces: 7 + 7, piston 2 + 4;
    # moments: 7 + 7; positions' rows: 6 + 6 + 2 + 3; angles' rows: 8 + 8, one by 1/L^2
    ("slider-crank", "dae"): ByHand(8, 8, 7, 7, 30, flops=99, trig=4),
    # for each link: l c, l s: 2; th' - w: 1; accelerations from the link above: w w, 4 products, 4 sums: 9 (the first
    # adds g and nothing else: 8); sums of m a from the end: 4 (the last: 2); l c Fz' + l s Fx': 3. So 19 N - 3.
    ("chain", "reduced"): ByHand(10, 10, 0, 0, 20, flops=187, trig=20),
    # As the double pendulum: 2 (N-1) + 2 N + 4 N + (6 (N-1) + 4) + (7 (N-1) + 5) + 5 N + (5 N - 2) = 31 N - 8.
    ("chain", "dae"): ByHand(20, 20, 10, 10, 60, flops=302),
    # th' - w: 1; m l^2 w' + m g l sin(th) - (m l A W^2) sin(W t) cos(th): W t, 4 products, 2 sums
    ("driven-pendulum", "reduced"): ByHand(1, 1, 0, 0, 2, flops=8, trig=3),
    # r2 - r1: 2; X, Z: 2; mu and la times them: 4; positions' rows of the driven point: 3 + 3, of the bob: 2 + 2;
    # forces on the driven point, which has no mass: 1 + 1; bob: 2 + 3; x - A sin(W t): 3; z; v - A W cos(W t): 2;
    # length 5, rate 5.
    ("driven-pendulum", "dae"): ByHand(4, 4, 3, 3, 14, flops=40, trig=2),
}


def test_the_table_is_complete() -> None:
    assert set(TABLE) == {(name, form) for name in EVERYDAY for form in ("reduced", "dae")}


@pytest.mark.parametrize(("name", "form"), TABLE)
def test_not_more_than_by_hand(name: str, form: str) -> None:
    expected = TABLE[name, form]
    prepared = prepare(SCENES[name](), form)
    program, equations = prepared.plan.program, prepared.assembly.own_equations
    assert len(equations.coordinates) == expected.coordinates
    assert len(equations.speeds) == expected.speeds
    assert len(equations.constraints) == expected.constraints
    assert program.multipliers == expected.multipliers
    assert program.extra == expected.multipliers  # the stabilised form has a second set, which shifts positions
    assert program.size == expected.states
    counts = program.operations
    flops = sum(counts.get(kind, 0) for kind in ("add", "sub", "mul", "div", "neg"))
    trig = sum(counts.get(kind, 0) for kind in ("sin", "cos"))
    assert flops <= expected.flops
    assert trig <= expected.trig
    assert counts.get("solve", 0) <= expected.solves
    assert set(counts) <= {"add", "sub", "mul", "div", "neg", "sin", "cos", "solve"}


def test_no_trigonometry_where_nothing_turns() -> None:
    for name in ("atwood", "double-atwood", "mass-spring-chain"):
        for form in ("reduced", "dae"):
            assert TABLE[name, form].trig == 0
