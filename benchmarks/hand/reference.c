/* The solution that all others are measured against: the extrapolated midpoint rule (Gragg, Bulirsch, Stoer) in 128
 * bits, of order 24.  E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition,
 * section II.9.  It shares nothing with the methods it judges but the mechanism. */
#include MECHANISM

enum { SIZE = 2 * LINKS, ROWS = 12 };
#define EACH for (int i = 0; i < SIZE; i++)

static void rates(const real *y, const real *p, real *k)
{
    for (int i = 0; i < LINKS; i++)
        k[i] = y[LINKS + i];
    accelerate(y, y + LINKS, p, k + LINKS);
}

/* The midpoint rule over H in n steps, smoothed. */
static void midpoint(const real *y, const real *k, const real *p, real H, int n, real *out)
{
    const real h = H / n;
    real a[SIZE], b[SIZE], f[SIZE];
    EACH a[i] = y[i];
    EACH b[i] = y[i] + h * k[i];
    for (int step = 1; step < n; step++) {
        rates(b, p, f);
        EACH
        {
            const real c = a[i] + 2 * h * f[i];
            a[i] = b[i];
            b[i] = c;
        }
    }
    rates(b, p, f);
    EACH out[i] = (a[i] + b[i] + h * f[i]) / 2;
}

/* Integrate y = (q, u) from 0 to an end; return the number of steps, or -1 if they become too small. */
long reference(double end_at, double tolerance, const double *parameters, int count, double *y_in_out)
{
    const real end = end_at;
    real p[count], y[SIZE], k[SIZE], table[ROWS][SIZE], t = 0, H = end / 100;
    long steps = 0;
    for (int i = 0; i < count; i++)
        p[i] = parameters[i];
    EACH y[i] = y_in_out[i];
    while (t < end) {
        real error = 0;
        const int last = t + H >= end;
        if (last)
            H = end - t;
        if (H < 1e-12 * end_at)
            return -1;
        rates(y, p, k);
        for (int row = 0; row < ROWS; row++) {
            midpoint(y, k, p, H, 2 * row + 2, table[row]);
            for (int column = row - 1; column >= 0; column--) { /* the table's last row is kept, from right to left */
                const real r = (real)(row + 1) / (column + 1), share = 1 / (r * r - 1);
                EACH table[column][i] = table[column + 1][i] + (table[column + 1][i] - table[column][i]) * share;
            }
        }
        EACH
        {
            const real apart = fabs(table[0][i] - table[1][i]), size = fabs(table[0][i]);
            error = fmax(error, size > 1 ? apart / size : apart);
        }
        if (error <= tolerance) {
            t = last ? end : t + H;
            EACH y[i] = table[0][i];
            steps++;
        }
        const double factor = 0.8 * pow(tolerance / (double)error, 1.0 / (2 * ROWS - 1));
        H *= factor > 2.0 ? 2.0 : factor > 0.2 ? factor : 0.2;
    }
    EACH y_in_out[i] = (double)y[i];
    return steps;
}
