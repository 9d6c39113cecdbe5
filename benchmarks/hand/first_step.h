/* Hairer's first step, from the sizes of the first two derivatives, for a state of SIZE numbers.
 * RATES(t, y, p, k) gives the rates of a state at a time, with parameters. */
static double first_step(const double *y, const double *k, double rtol, double atol, double most, double t,
                         const double *p)
{
    double d0 = 0.0, d1 = 0.0, d2 = 0.0, h, steepest, z[SIZE], kz[SIZE];
    EACH
    {
        const double over = 1.0 / (atol + rtol * fabs(y[i]));
        d0 += y[i] * y[i] * over * over;
        d1 += k[i] * k[i] * over * over;
    }
    h = d0 < SIZE * 1e-10 || d1 < SIZE * 1e-10 ? 1e-6 : 0.01 * sqrt(d0 / d1);
    h = fmin(h, most);
    EACH z[i] = y[i] + h * k[i];
    RATES(t + h, z, p, kz);
    EACH
    {
        const double d = (kz[i] - k[i]) / (atol + rtol * fabs(y[i]));
        d2 += d * d;
    }
    steepest = fmax(sqrt(d1 / SIZE), sqrt(d2 / SIZE) / h);
    steepest = steepest <= 1e-15 ? fmax(1e-6, 1e-3 * h) : sqrt(sqrt(sqrt(0.01 / steepest)));
    return fmin(fmin(100.0 * h, steepest), most);
}
