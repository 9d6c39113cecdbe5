/* A bob m on a massless rod l, hanging straight down at angle 0:
 *     q' = u,   m l^2 u' + m g l sin q = 0.
 * Inputs t, y = (q, u), y' (, cj); parameters l, m, g. */
#include "real.h"

#define LINKS 1

int residual(const double *const *in, const double *p, double *scratch, double *const *out)
{
    const double *y = in[1], *yp = in[2], ml = p[1] * p[0];
    double *F = out[0];
    (void)scratch;
    F[0] = yp[0] - y[1];
    F[1] = ml * (p[0] * yp[1] + p[2] * sin(y[0]));
    return 0;
}

/* dF/dy + cj dF/dy', column after column: (0,0), (1,0), (0,1), (1,1). */
int jacobian(const double *const *in, const double *p, double *scratch, double *const *out)
{
    const double cj = in[3][0], ml = p[1] * p[0];
    double *J = out[0];
    (void)scratch;
    J[0] = cj;
    J[1] = ml * p[2] * cos(in[1][0]);
    J[2] = -1.0;
    J[3] = ml * p[0] * cj;
    return 0;
}

static inline void accelerate(const real *q, const real *u, const real *p, real *a)
{
    (void)u;
    a[0] = -p[2] / p[0] * sin(q[0]);
}

#include "as_kernel.h"
