/* Two bobs on massless rods, absolute angles a, b from the vertical, d = a - b, M = m1 + m2:
 *     M l1 a'' + m2 l2 (b'' cos d + b'^2 sin d) + M g sin a = 0      (times l1)
 *     l2 b'' + l1 (a'' cos d - a'^2 sin d) + g sin b = 0             (times m2 l2)
 * Inputs t, y = (a, b, a', b'), y' (, cj), or t, q, u; parameters l1, m1, l2, m2, g. */
#include "real.h"

#define LINKS 2

int residual(const double *const *in, const double *p, double *scratch, double *const *out)
{
    const double *y = in[1], *yp = in[2];
    const double l1 = p[0], l2 = p[2], m2 = p[3], M = p[1] + p[3], g = p[4];
    const double d = y[0] - y[1], s = sin(d), c = cos(d), k = m2 * l1 * l2;
    double *F = out[0];
    (void)scratch;
    F[0] = yp[0] - y[2];
    F[1] = yp[1] - y[3];
    F[2] = k * (yp[3] * c + y[3] * y[3] * s) + M * l1 * (l1 * yp[2] + g * sin(y[0]));
    F[3] = k * (yp[2] * c - y[2] * y[2] * s) + m2 * l2 * (l2 * yp[3] + g * sin(y[1]));
    return 0;
}

/* By columns: (0,0) (2,0) (3,0) | (1,1) (2,1) (3,1) | (0,2) (2,2) (3,2) | (1,3) (2,3) (3,3). */
int jacobian(const double *const *in, const double *p, double *scratch, double *const *out)
{
    const double *y = in[1], *yp = in[2], cj = in[3][0];
    const double l1 = p[0], l2 = p[2], m2 = p[3], M = p[1] + p[3], g = p[4];
    const double d = y[0] - y[1], k = m2 * l1 * l2, ks = k * sin(d), kc = k * cos(d), kccj = kc * cj;
    const double x = kc * y[3] * y[3] - ks * yp[3], z = kc * y[2] * y[2] + ks * yp[2];
    double *J = out[0];
    (void)scratch;
    J[0] = cj;
    J[1] = x + M * l1 * g * cos(y[0]);
    J[2] = -z;
    J[3] = cj;
    J[4] = -x;
    J[5] = z + m2 * l2 * g * cos(y[1]);
    J[6] = -1.0;
    J[7] = M * l1 * l1 * cj;
    J[8] = kccj - 2.0 * ks * y[2];
    J[9] = -1.0;
    J[10] = kccj + 2.0 * ks * y[3];
    J[11] = m2 * l2 * l2 * cj;
    return 0;
}

/* Two unknowns, by Cramer's rule, with one division. */
static inline void accelerate(const real *q, const real *u, const real *p, real *a)
{
    const real l1 = p[0], l2 = p[2], m2 = p[3], M = p[1] + p[3], g = p[4];
    const real d = q[0] - q[1], s = sin(d), c = cos(d);
    const real r1 = m2 * l2 * u[1] * u[1] * s + M * g * sin(q[0]); /* M l1 a'' + m2 l2 c b'' = -r1 */
    const real r2 = l1 * u[0] * u[0] * s - g * sin(q[1]);          /* l1 c a'' + l2 b'' = r2 */
    const real f = 1.0 / (l1 * l2 * (M - m2 * c * c));
    a[0] = -(r1 + m2 * c * r2) * l2 * f;
    a[1] = (M * r2 + c * r1) * l1 * f;
}

#include "as_kernel.h"
