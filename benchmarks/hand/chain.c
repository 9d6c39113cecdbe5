/* Accelerations of a planar chain of LINKS point masses on massless rods, in O(LINKS).
 *
 * With w = 1/m, T the tension, e the direction of a rod, and c, s the cosine and sine of the angle from a rod to the
 * next one, the length of rod i says e_i . (a_i - a_{i-1}) = -l_i u_i^2:
 *     -w_{i-1} c_{i-1} T_{i-1} + (w_{i-1} + w_i) T_i - w_i c_i T_{i+1} = l_i u_i^2,
 * for the first rod w_0 = 0 and g cos q_1 more on the right.  Across the rod
 *     l_i q_i'' = w_i s_i T_{i+1} - w_{i-1} s_{i-1} T_{i-1},   for the first rod - g sin q_1 more.
 * Inputs t, q, u; parameters l (LINKS), 1/l (LINKS), w (LINKS), g. */
#include "real.h"

static inline void accelerate(const real *q, const real *u, const real *p, real *a)
{
    const real *l = p, *over = p + LINKS, *w = p + 2 * LINKS, g = p[3 * LINKS];
    real ws[LINKS], wc[LINKS], slope[LINKS], T[LINKS + 1];
    real before = 0.0, carried = g * cos(q[0]), wb = 0.0;
    for (int i = 0; i < LINKS; i++) { /* eliminate from the wall outwards: T_i = T_i + slope_i T_{i+1} */
        real d, f;
        if (i < LINKS - 1) {
            d = q[i + 1] - q[i];
            ws[i] = w[i] * sin(d);
            wc[i] = w[i] * cos(d);
        } else
            ws[i] = wc[i] = 0.0;
        f = 1.0 / (wb + w[i] - before);
        T[i] = (l[i] * u[i] * u[i] + carried) * f;
        slope[i] = wc[i] * f;
        before = wc[i] * slope[i];
        carried = wc[i] * T[i];
        wb = w[i];
    }
    for (int i = LINKS - 2; i >= 0; i--)
        T[i] += slope[i] * T[i + 1];
    T[LINKS] = 0.0;
    a[0] = (ws[0] * T[1] - g * sin(q[0])) * over[0];
    for (int i = 1; i < LINKS; i++)
        a[i] = (ws[i] * T[i + 1] - ws[i - 1] * T[i - 1]) * over[i];
}

#include "as_kernel.h"
