/* Andrews' squeezing mechanism: seven bodies, three groups of two links behind its crank, whose angle is q.
 * Hairer and Wanner, Solving Ordinary Differential Equations II, section VII.7; letters as there.
 * Parameters: the motor's torque, the stiffness and the natural length of the spring. */
#include "planar.h"

#define LINKS 1

#define fourth(x) ((x) * (x) * (x) * (x))

static inline void accelerate(const real *q, const real *u, const real *p, real *out)
{
    const real rr = 0.007, ra = 0.00092, d = 0.028, da = 0.0115, ss = 0.035, e = 0.02, ea = 0.01421, zt = 0.04;
    const real ta = 0.02308, tb = 0.00916, zf = 0.02, fa = 0.01421, uu = 0.04, ua = 0.01228, ub = 0.00449;
    const real sa = 0.01874, sb = 0.01043, sc = 0.018, sd = 0.02, xc = 0.014, yc = 0.072;
    const real s = sin(q[0]), c = cos(q[0]);
    const place O = fixed(0, 0), A = fixed(-0.06934, -0.00227), B = fixed(-0.03635, 0.03273);
    const place F = turned(O, rr, s, c), E = meeting(F, B, d, ss, 1);
    const place G = meeting(E, A, e, zt, -1), H = meeting(E, A, zf, uu, 1);
    const place D = carried(B, E, sc / ss, sd / ss);
    sums all = {0, 0, p[0]};
    add(&all, O, F, turned(O, ra, s, c), 0.04325, 2.194e-6 / fourth(rr), 0);
    add(&all, F, E, carried(F, E, da / d, 0), 0.00365, 4.41e-7 / fourth(d), 0);
    add(&all, B, E, carried(B, E, sa / ss, sb / ss), 0.02373, 5.255e-6 / fourth(ss), 0);
    add(&all, E, G, carried(E, G, ea / e, 0), 0.00706, 5.667e-7 / fourth(e), 0);
    add(&all, A, G, carried(A, G, ta / zt, tb / zt), 0.0705, 1.169e-5 / fourth(zt), 0);
    add(&all, E, H, carried(E, H, fa / zf, 0), 0.00706, 5.667e-7 / fourth(zf), 0);
    add(&all, A, H, carried(A, H, ua / uu, -ub / uu), 0.05498, 1.912e-5 / fourth(uu), 0);
    const real x = D.x - xc, y = D.y - yc, length = sqrt(x * x + y * y);
    all.force -= p[1] * (1 - p[2] / length) * (x * D.dx + y * D.dy);
    out[0] = (all.force - all.half * u[0] * u[0]) / all.inertia;
}
