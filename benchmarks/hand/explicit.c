/* Dormand and Prince's method of order 8(5,3) with error estimates of orders 5 and 3, for q'' = a(q, u):
 * E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, sections II.4 and II.10.
 * A whole run is one call; the last step ends at the end.  MECHANISM is the file with the accelerations. */
#include MECHANISM
#include "dormand_prince.h"

enum { SIZE = 2 * LINKS };
#define EACH for (int i = 0; i < SIZE; i++)

static inline void rates(const double *y, const double *p, double *k)
{
    for (int i = 0; i < LINKS; i++)
        k[i] = y[LINKS + i];
    accelerate(y, y + LINKS, p, k + LINKS);
}

#define RATES(t, y, p, k) ((void)(t), rates(y, p, k))
#include "first_step.h"

/* Integrate y = (q, u) from 0 to an end; return 0, or 1 if the steps become too small.
 * Counts: steps, rejected steps, evaluations. */
int integrate(double end, double rtol, double atol, const double *p, double *y_in_out, long *counts)
{
    double y[SIZE], z[SIZE], k1[SIZE], k2[SIZE], k3[SIZE], k4[SIZE], k5[SIZE], k6[SIZE], k7[SIZE], k8[SIZE], k9[SIZE],
        k10[SIZE], k11[SIZE], k12[SIZE];
    double t = 0.0, h;
    int rejected = 0;
    long steps = 0, failures = 0;
    EACH y[i] = y_in_out[i];
    rates(y, p, k1);
    h = first_step(y, k1, rtol, atol, end, 0.0, p);
    while (t < end) {
        double e3 = 0.0, e5 = 0.0, error, factor;
        const int last = t + 1.01 * h >= end;
        if (last)
            h = end - t;
        if (h <= 1e-15 * fabs(t))
            return 1;
        EACH z[i] = y[i] + h * (A21 * k1[i]);
        rates(z, p, k2);
        EACH z[i] = y[i] + h * (A31 * k1[i] + A32 * k2[i]);
        rates(z, p, k3);
        EACH z[i] = y[i] + h * (A41 * k1[i] + A43 * k3[i]);
        rates(z, p, k4);
        EACH z[i] = y[i] + h * (A51 * k1[i] + A53 * k3[i] + A54 * k4[i]);
        rates(z, p, k5);
        EACH z[i] = y[i] + h * (A61 * k1[i] + A64 * k4[i] + A65 * k5[i]);
        rates(z, p, k6);
        EACH z[i] = y[i] + h * (A71 * k1[i] + A74 * k4[i] + A75 * k5[i] + A76 * k6[i]);
        rates(z, p, k7);
        EACH z[i] = y[i] + h * (A81 * k1[i] + A84 * k4[i] + A85 * k5[i] + A86 * k6[i] + A87 * k7[i]);
        rates(z, p, k8);
        EACH z[i] = y[i] + h * (A91 * k1[i] + A94 * k4[i] + A95 * k5[i] + A96 * k6[i] + A97 * k7[i] + A98 * k8[i]);
        rates(z, p, k9);
        EACH z[i] = y[i] + h * (A101 * k1[i] + A104 * k4[i] + A105 * k5[i] + A106 * k6[i] + A107 * k7[i]
                                + A108 * k8[i] + A109 * k9[i]);
        rates(z, p, k10);
        EACH z[i] = y[i] + h * (A111 * k1[i] + A114 * k4[i] + A115 * k5[i] + A116 * k6[i] + A117 * k7[i]
                                + A118 * k8[i] + A119 * k9[i] + A1110 * k10[i]);
        rates(z, p, k11);
        EACH z[i] = y[i] + h * (A121 * k1[i] + A124 * k4[i] + A125 * k5[i] + A126 * k6[i] + A127 * k7[i]
                                + A128 * k8[i] + A129 * k9[i] + A1210 * k10[i] + A1211 * k11[i]);
        rates(z, p, k12);
        EACH
        {
            const double sum = B1 * k1[i] + B6 * k6[i] + B7 * k7[i] + B8 * k8[i] + B9 * k9[i] + B10 * k10[i]
                             + B11 * k11[i] + B12 * k12[i];
            const double third = sum - BH1 * k1[i] - BH2 * k9[i] - BH3 * k12[i];
            const double fifth = E1 * k1[i] + E6 * k6[i] + E7 * k7[i] + E8 * k8[i] + E9 * k9[i] + E10 * k10[i]
                               + E11 * k11[i] + E12 * k12[i];
            z[i] = y[i] + h * sum;
            const double over = 1.0 / (atol + rtol * fmax(fabs(y[i]), fabs(z[i])));
            e3 += third * third * over * over;
            e5 += fifth * fifth * over * over;
        }
        error = e5 > 0.0 ? h * e5 / sqrt((e5 + 0.01 * e3) * SIZE) : 0.0;
        factor = sqrt(sqrt(sqrt(error))) / 0.9;
        if (error <= 1.0) {
            double next = h / fmin(3.0, fmax(1.0 / 6.0, factor));
            steps++;
            t = last ? end : t + h;
            EACH y[i] = z[i];
            rates(y, p, k1);
            h = rejected ? fmin(next, h) : next;
            rejected = 0;
        } else {
            failures++;
            rejected = 1;
            h /= error < INFINITY ? fmin(3.0, factor) : 4.0;
        }
    }
    EACH y_in_out[i] = y[i];
    counts[0] = steps;
    counts[1] = failures;
    counts[2] = 2 + 12 * steps + 11 * failures;
    return 0;
}
