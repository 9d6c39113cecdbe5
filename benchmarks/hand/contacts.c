/* Four scenes with events: order 8(5,3), steps chosen by their errors, dense output of order 7, and events located on it
 * to rounding.  METHOD is the pair with its coefficients written out; SCENE: 1 ball in a box, 2 mass on a belt, 3 coupled
 * clutches, 4 block on a slope. */
#include <math.h>

#if SCENE == 1
enum { SIZE = 4, EVENTS = 4 };
#elif SCENE == 2
enum { SIZE = 2, EVENTS = 2 };
#elif SCENE == 3
enum { SIZE = 8, EVENTS = 9 };
#else
enum { SIZE = 2, EVENTS = 1 };
#endif
#define EACH for (int i = 0; i < SIZE; i++)

static int state[3];         /* 0 open or free, 1 and -1 slips forwards and backwards, 2 sticks */
static double begins, ends; /* of what a function of time is made of */

#if SCENE == 1
static inline void rates(double t, const double *y, double *k)
{
    (void)t;
    k[0] = y[2], k[1] = y[3], k[2] = k[3] = 0.0;
}

static inline void events(double t, const double *y, double *g)
{
    (void)t;
    g[0] = y[0] - 0.05, g[1] = 0.95 - y[0], g[2] = y[1] - 0.05, g[3] = 0.65 - y[1];
}

static void change(int which, double t, double *y)
{
    (void)t;
    y[which / 2] = which == 0 || which == 2 ? 0.05 : which == 1 ? 0.95 : 0.65;
    y[2 + which / 2] = -y[2 + which / 2];
}
#elif SCENE == 2
static inline void rates(double t, const double *y, double *k)
{
    (void)t;
    k[0] = y[1];
    k[1] = state[0] == 2 ? 0.0 : -100.0 * y[0] - state[0] * 0.4 * 9.81;
}

static inline void events(double t, const double *y, double *g)
{
    (void)t;
    g[0] = state[0] == 2 ? 0.6 * 9.81 - fabs(100.0 * y[0]) : 1.0;
    g[1] = state[0] == 2 ? 1.0 : state[0] * (y[1] - 0.2);
}

static void change(int which, double t, double *y)
{
    (void)t;
    if (which == 0)
        state[0] = y[0] > 0.0 ? -1 : 1;
    else if (fabs(100.0 * y[0]) <= 0.6 * 9.81)
        state[0] = 2, y[1] = 0.2;
    else
        state[0] = -state[0];
}
#elif SCENE == 3
static inline double level(int i, double t)
{
    return i == 0 ? sin(0.4 * M_PI * t + 0.5 * M_PI) : begins >= (i == 1 ? 0.4 : 0.9) ? 1.0 : 0.0;
}

/* Torques of the clutches: given where they slip; what sticks has equal accelerations on both sides. */
static inline void torques(double t, double *c)
{
    const double motor = 10.0 * sin(10.0 * M_PI * t);
    double d[3], r[3];
    for (int i = 0; i < 3; i++) {
        d[i] = state[i] == 2 ? 2.0 : 1.0;
        r[i] = state[i] == 2 ? (i == 0 ? motor : 0.0) : state[i] * 10.0 * level(i, t);
        if (i > 0 && state[i] == 2) {
            const double above = state[i - 1] == 2 ? 1.0 : 0.0;
            r[i] += r[i - 1] / d[i - 1];
            d[i] -= above / d[i - 1];
        }
    }
    c[2] = r[2] / d[2];
    c[1] = (r[1] + (state[1] == 2 ? c[2] : 0.0)) / d[1];
    c[0] = (r[0] + (state[0] == 2 ? c[1] : 0.0)) / d[0];
}

static inline void rates(double t, const double *y, double *k)
{
    double c[3];
    torques(t, c);
    for (int i = 0; i < 4; i++)
        k[i] = y[4 + i];
    k[4] = 10.0 * sin(10.0 * M_PI * t) - c[0], k[5] = c[0] - c[1], k[6] = c[1] - c[2], k[7] = c[2];
}

static inline void events(double t, const double *y, double *g)
{
    double c[3];
    torques(t, c);
    for (int i = 0; i < 3; i++) {
        const double most = 11.0 * level(i, t);
        g[3 * i] = state[i] == 2 ? most - c[i] : 1.0;
        g[3 * i + 1] = state[i] == 2 ? most + c[i] : 1.0;
        g[3 * i + 2] = state[i] * state[i] == 1 ? state[i] * (y[4 + i] - y[5 + i]) : 1.0;
    }
}

static void change(int which, double t, double *y)
{
    const int i = which / 3;
    double c[3];
    (void)y;
    if (which % 3 < 2) {
        state[i] = which % 3 == 0 ? 1 : -1;
        return;
    }
    const int before = state[i];
    state[i] = 2;
    torques(t, c);
    if (fabs(c[i]) > 11.0 * level(i, t))
        state[i] = -before;
}
#else
static inline void rates(double t, const double *y, double *k)
{
    (void)t;
    k[0] = y[1];
    k[1] = state[0] == 2 ? 0.0 : -9.81 * (sin(0.3) + state[0] * 0.4 * cos(0.3));
}

static inline void events(double t, const double *y, double *g)
{
    (void)t;
    g[0] = state[0] == 2 ? 1.0 : state[0] * y[1];
}

static void change(int which, double t, double *y)
{
    (void)which, (void)t;
    if (0.4 * cos(0.3) >= sin(0.3))
        state[0] = 2, y[1] = 0.0;
    else
        state[0] = -state[0];
}
#endif

#include METHOD

#define RATES(t, y, p, k) ((void)(p), rates(t, y, k))
#include "first_step.h"

/* The first event in a step: its number and its time, by regula falsi (Illinois) on the dense output; -1 for none. */
static int locate(double t, double h, const double *y, double d[][SIZE], const double *old, const double *new_,
                  const int *fresh, double *when, double *there)
{
    int which = -1;
    *when = h;
    for (int e = 0; e < EVENTS; e++) {
        double a = 0.0, b = h, ga = fresh[e] ? 1.0 : old[e], gb = new_[e], g[EVENTS], z[SIZE];
        if (!(gb < 0.0) || (!fresh[e] && ga <= 0.0))
            continue;
        for (int n = 0, side = 0; n < 100 && b - a > 4e-16 * (t + h); n++) {
            double x = fresh[e] && a == 0.0 ? 0.5 * (a + b) : (a * gb - b * ga) / (gb - ga);
            if (!(x > a && x < b))
                x = 0.5 * (a + b);
            dense(x / h, y, d, z);
            events(t + x, z, g);
            if (g[e] <= 0.0) {
                b = x, gb = g[e];
                if (side == -1)
                    ga *= 0.5;
                side = -1;
            } else {
                a = x, ga = g[e];
                if (side == 1)
                    gb *= 0.5;
                side = 1;
            }
            if (g[e] == 0.0)
                break;
        }
        if (b < *when || which < 0) {
            which = e, *when = b;
            dense(b / h, y, d, there);
        }
    }
    return which;
}

/* Run from 0 to an end in pieces between times; return the number of events. */
long integrate(double end, double rtol, double atol, const double *times, double *y, const int *at_start, long *steps)
{
    double k[STAGES + 1][SIZE], z[SIZE], d[TERMS][SIZE], old[EVENTS], new_[EVENTS], there[SIZE] = {0};
    int fresh[EVENTS] = {0};
    double t = 0.0, h;
    long found = 0, taken = 0;
    for (int i = 0; i < 3; i++)
        state[i] = at_start[i];
    for (begins = 0.0; begins < end; begins = ends) {
        int rejected = 0;
        ends = *times < end ? *times++ : end;
#if SCENE == 3
        for (int i = 1; i < 3; i++)
            if (state[i] == 0 && level(i, begins) > 0.0)
                state[i] = y[4 + i] > y[5 + i] ? 1 : y[4 + i] < y[5 + i] ? -1 : 2;
#endif
        rates(t, y, k[0]);
        events(t, y, old);
        h = first_step(y, k[0], rtol, atol, ends - t, t, 0);
        while (t < ends) {
            const int last = t + 1.01 * h >= ends;
            double error, factor;
            int which;
            if (last)
                h = ends - t;
            attempt(t, h, y, k, z);
            error = h * error_of(y, z, k, rtol, atol);
            factor = sqrt(sqrt(sqrt(error))) / 0.9;
            if (!(error <= 1.0)) {
                h /= error < INFINITY ? fmin(3.0, factor) : 4.0;
                rejected = 1;
                continue;
            }
            taken++;
            rates(t + h, z, k[END]);
            events(t + h, z, new_);
            which = -1;
            for (int e = 0; e < EVENTS; e++)
                which = new_[e] < 0.0 ? e : which;
            if (which >= 0) {
                double when;
                densify(t, h, y, z, k, d);
                which = locate(t, h, y, d, old, new_, fresh, &when, there);
                if (which >= 0) {
                    t += when;
                    EACH y[i] = there[i];
                    change(which, t, y);
                    found++;
                    rates(t, y, k[0]);
                    events(t, y, old);
                    for (int e = 0; e < EVENTS; e++)
                        fresh[e] = fabs(old[e]) < 1e-10;
                    h = first_step(y, k[0], rtol, atol, ends - t, t, 0);
                    rejected = 0;
                    continue;
                }
            }
            t = last ? ends : t + h;
            EACH y[i] = z[i], k[0][i] = k[END][i];
            for (int e = 0; e < EVENTS; e++)
                old[e] = new_[e], fresh[e] = 0;
            error = h / fmin(3.0, fmax(1.0 / 6.0, factor));
            h = rejected ? fmin(error, h) : error;
            rejected = 0;
        }
    }
    *steps = taken;
    return found;
}
