/* A crank (r, m1) and a connecting rod (l, m2), both uniform, and a piston on a horizontal guide through the crank's
 * pivot.  In terms of the crank's angle q alone, with k = dphi/dq of the rod's angle phi, r sin q + l sin phi = 0:
 *     M q'' + M'/2 q'^2 + V' = 0
 * Parameters r, l, m1, m2, piston's mass, g. */
#include "real.h"

#define LINKS 1

static inline void accelerate(const real *q, const real *u, const real *p, real *a)
{
    const real r = p[0], l = p[1], m1 = p[2], m2 = p[3], m3 = p[4], g = p[5];
    const real s = r * sin(q[0]), c = r * cos(q[0]);
    const real y = -s, x = sqrt(l * l - y * y), over = 1.0 / x; /* of the rod from its pin to the piston */
    const real k = -c * over, dk = (s + y * k * k) * over;
    const real v = -s - 0.5 * y * k, w = 0.5 * c, V = -s - y * k; /* rates of the rod's centre and of the piston */
    const real turn = x * k * k + y * dk, dv = -c - 0.5 * turn, dw = -0.5 * s, dV = -c - turn;
    const real moment = m2 * l * l * (1.0 / 12.0);
    const real M = m1 * r * r * (1.0 / 3.0) + m2 * (v * v + w * w) + moment * k * k + m3 * V * V;
    const real half = m2 * (v * dv + w * dw) + moment * k * dk + m3 * V * dV;
    a[0] = -(half * u[0] * u[0] + 0.5 * g * (m1 + m2) * c) / M;
}
