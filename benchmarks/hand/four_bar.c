/* A crank (a, m1), a coupler (b, m2) and a rocker (c, m3), all uniform, on pivots at a distance d in a horizontal line.
 * In terms of the crank's angle q alone; (x, y) is the coupler and (X, Y) the rocker from its pivot to the coupler, k
 * and n are their rates for a unit of the crank's:
 *     M q'' + M'/2 q'^2 + V' = 0
 * Parameters a, b, c, d, m1, m2, m3, g. */
#include "real.h"

#define LINKS 1

static inline void accelerate(const real *q, const real *u, const real *p, real *out)
{
    const real a = p[0], b = p[1], c = p[2], d = p[3], m1 = p[4], m2 = p[5], m3 = p[6], g = p[7];
    const real S = a * sin(q[0]), C = a * cos(q[0]);
    const real ex = d - C, ey = -S, over = 1.0 / (ex * ex + ey * ey);
    const real along = 0.5 * ((b * b - c * c) * over + 1.0), across = sqrt(b * b * over - along * along);
    const real x = along * ex - across * ey, y = along * ey + across * ex, X = x - ex, Y = y - ey;
    const real det = 1.0 / (x * Y - y * X), k = (S * X - C * Y) * det, n = (S * x - C * y) * det;
    const real kk = k * k, nn = n * n, dot = x * X + y * Y;
    const real dk = (C * X + S * Y + kk * dot - nn * c * c) * det;
    const real dn = (C * x + S * y + kk * b * b - nn * dot) * det;
    const real v = -S - 0.5 * k * y, w = C + 0.5 * k * x; /* rates of the coupler's centre */
    const real dv = -C - 0.5 * (dk * y + kk * x), dw = -S + 0.5 * (dk * x - kk * y);
    const real M2 = m2 * b * b * (1.0 / 12.0), M3 = m3 * c * c * (1.0 / 3.0);
    const real M = m1 * a * a * (1.0 / 3.0) + m2 * (v * v + w * w) + M2 * kk + M3 * nn;
    const real half = m2 * (v * dv + w * dw) + M2 * k * dk + M3 * n * dn;
    const real pull = 0.5 * m1 * C + m2 * w + 0.5 * m3 * n * X;
    out[0] = -(half * u[0] * u[0] + g * pull) / M;
}
