/* A net of ROWS x COLUMNS point masses on springs in the plane, hung up by a spring at each column, with gravity.
 * Coordinates x, z of mass (i, j) at 2 (i COLUMNS + j).  Parameters: mass, stiffness, length without force, g. */
#include "real.h"

#define MASSES (ROWS * COLUMNS)
#define LINKS (2 * MASSES)

static inline void pull(const real *from, const real *to, real k, real l, real *f)
{
    const real x = to[0] - from[0], z = to[1] - from[1], share = k * (1 - l / sqrt(x * x + z * z));
    f[0] = share * x;
    f[1] = share * z;
}

static inline void accelerate(const real *q, const real *u, const real *p, real *a)
{
    const real over = 1 / p[0], k = p[1] * over, l = p[2], g = p[3];
    real f[2];
    (void)u;
    for (int n = 0; n < MASSES; n++) {
        a[2 * n] = 0;
        a[2 * n + 1] = -g;
    }
    for (int i = 0; i < ROWS; i++)
        for (int j = 0; j < COLUMNS; j++) {
            const int n = i * COLUMNS + j;
            if (i == 0) {
                const real hook[2] = {j * l, 0};
                pull(q + 2 * n, hook, k, l, f);
                a[2 * n] += f[0], a[2 * n + 1] += f[1];
            }
            for (int down = 0; down < 2; down++) {
                const int m = down ? n + COLUMNS : n + 1;
                if (down ? i + 1 == ROWS : j + 1 == COLUMNS)
                    continue;
                pull(q + 2 * n, q + 2 * m, k, l, f);
                a[2 * n] += f[0], a[2 * n + 1] += f[1];
                a[2 * m] -= f[0], a[2 * m + 1] -= f[1];
            }
        }
}
