/* A four-bar (crank a, m1; coupler b, m2; rocker c, m3; pivots d apart) whose coupler alone turns fully, so that the
 * coupler's angle is q: the crank has a dead centre at each end of its swing.  Parameters as in four_bar.c. */
#include "planar.h"

#define LINKS 1

static inline void accelerate(const real *q, const real *u, const real *p, real *out)
{
    const real a = p[0], b = p[1], c = p[2], d = p[3], m1 = p[4], m2 = p[5], m3 = p[6], g = p[7];
    const real S = sin(q[0]), C = cos(q[0]);
    const place left = fixed(0, 0), right = fixed(d, 0);
    const place near = meeting(left, turned(right, -b, S, C), a, c, SIDE); /* the far pin, less the coupler */
    const place far = turned(near, b, S, C);
    sums all = {0, 0, 0};
    add(&all, left, near, carried(left, near, 0.5, 0), m1, m1 / (12 * a * a), g);
    add(&all, near, far, carried(near, far, 0.5, 0), m2, m2 / (12 * b * b), g);
    add(&all, right, far, carried(right, far, 0.5, 0), m3, m3 / (12 * c * c), g);
    out[0] = (all.force - all.half * u[0] * u[0]) / all.inertia;
}
