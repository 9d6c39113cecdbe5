/* Bricard's mechanism, five bars of a square section and six hinges, in terms of the angle q of the first hinge: the
 * other angles close the loop by Newton's method, from those of the last call and their slopes.  One of the six
 * equations follows from the others, so each step is one of least squares.  Parameters: mass, length, width, g. */
#include "real.h"
#include <string.h>

#define LINKS 1

enum { BARS = 5, FREE = 4 };
typedef real vec[3];

static const double DIRECTION[BARS][3] = {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}, {-1, 0, 0}, {0, 0, 1}};
static const double AXIS[BARS + 1][3] = {{0, 0, 1}, {0, -1, 0}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}, {1, 0, 0}};

static inline void cross(const vec a, const vec b, vec c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static inline real dot(const vec a, const vec b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* v turned about the unit axis n. */
static inline void turn(const vec v, const vec n, real s, real c, vec out)
{
    vec w;
    const real along = (1 - c) * dot(n, v);
    cross(n, v, w);
    for (int i = 0; i < 3; i++)
        out[i] = c * v[i] + s * w[i] + along * n[i];
}

/* The chain for its angles: axes of the hinges, directions of the bars, places of the hinges. */
static void chain(const real *angle, real length, vec *axis, vec *bar, vec *at)
{
    vec base[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; /* the last bar's axes */
    memset(at[0], 0, sizeof(vec));
    for (int k = 0; k <= BARS; k++) {
        for (int i = 0; i < 3; i++)
            axis[k][i] = AXIS[k][0] * base[0][i] + AXIS[k][1] * base[1][i] + AXIS[k][2] * base[2][i];
        if (k == BARS)
            break;
        const real s = sin(angle[k]), c = cos(angle[k]);
        for (int j = 0; j < 3; j++) {
            vec v = {base[j][0], base[j][1], base[j][2]};
            turn(v, axis[k], s, c, base[j]);
        }
        for (int i = 0; i < 3; i++) {
            bar[k][i] = DIRECTION[k][0] * base[0][i] + DIRECTION[k][1] * base[1][i] + DIRECTION[k][2] * base[2][i];
            at[k + 1][i] = at[k][i] + length * bar[k][i];
        }
    }
}

/* The least-squares solution of J x = right, six rows, by Cholesky's factors of J'J, which are made if asked for. */
static void solve(real J[6][FREE], real L[FREE][FREE], const real *right, real *x, int make)
{
    if (make)
        for (int i = 0; i < FREE; i++)
            for (int j = 0; j <= i; j++) {
                real sum = 0;
                for (int r = 0; r < 6; r++)
                    sum += J[r][i] * J[r][j];
                for (int k = 0; k < j; k++)
                    sum -= L[i][k] * L[j][k];
                L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
            }
    for (int i = 0; i < FREE; i++) {
        real sum = 0;
        for (int r = 0; r < 6; r++)
            sum += J[r][i] * right[r];
        for (int k = 0; k < i; k++)
            sum -= L[i][k] * x[k];
        x[i] = sum / L[i][i];
    }
    for (int i = FREE - 1; i >= 0; i--) {
        for (int k = i + 1; k < FREE; k++)
            x[i] -= L[k][i] * x[k];
        x[i] /= L[i][i];
    }
}

/* The chain, and how its end moves with the angles of hinges 2 to 5: its place, and the direction of its axis. */
static void equations(const real *angle, real l, vec *axis, vec *bar, vec *at, real J[6][FREE])
{
    vec v, w;
    chain(angle, l, axis, bar, at);
    for (int k = 0; k < FREE; k++) {
        for (int i = 0; i < 3; i++)
            v[i] = at[BARS][i] - at[k + 1][i];
        cross(axis[k + 1], v, w);
        for (int i = 0; i < 3; i++)
            J[i][k] = w[i];
        cross(axis[k + 1], axis[BARS], w);
        for (int i = 0; i < 3; i++)
            J[3 + i][k] = l * w[i];
    }
}

static inline void accelerate(const real *q, const real *u, const real *p, real *out)
{
    static real known[BARS], slope[BARS];
    const real mass = p[0], l = p[1], width = p[2], g = p[3];
    const real across = mass * (l * l + width * width) / 12, along = mass * width * width / 6;
    const vec end = {0, -l, 0};
    vec axis[BARS + 1], bar[BARS], at[BARS + 1], v, w;
    real J[6][FREE], L[FREE][FREE], right[6], step[FREE], angle[BARS], rate[BARS], bend[BARS], moved = 1;
    if (q[0] == 0 && u[0] == 0) { /* a new run: where it starts */
        memset(known, 0, sizeof known);
        memset(slope, 0, sizeof slope);
    }
    memcpy(angle, known, sizeof angle);
    const int parts = 1 + (int)fmin(fabs(q[0] - known[0]) / 0.2, 50); /* Newton's method begins nearby */
    int part = 0;
    do {
        moved = 1;
        angle[0] += (q[0] - known[0]) / parts;
        for (int k = 1; k < BARS; k++)
            angle[k] += slope[k] * (q[0] - known[0]) / parts * (part == 0);
        for (int iteration = 0; iteration < 20; iteration++) {
            equations(angle, l, axis, bar, at, J);
            if (moved < 1e-9) /* the last step has left its square */
                break;
            for (int i = 0; i < 3; i++) {
                right[i] = end[i] - at[BARS][i];
                right[3 + i] = l * (AXIS[BARS][i] - axis[BARS][i]);
            }
            solve(J, L, right, step, 1);
            moved = 0;
            for (int k = 0; k < FREE; k++) {
                angle[k + 1] += step[k];
                moved = fmax(moved, fabs(step[k]));
            }
        }
    } while (++part < parts);
    angle[0] = q[0];
    /* Slopes by q: the same equations, for the motion of the first hinge; then their own slopes. */
    cross(axis[0], at[BARS], v);
    cross(axis[0], axis[BARS], w);
    for (int i = 0; i < 3; i++) {
        right[i] = -v[i];
        right[3 + i] = -l * w[i];
    }
    solve(J, L, right, step, 1);
    rate[0] = 1, bend[0] = 0;
    memcpy(rate + 1, step, sizeof step);
    for (int pass = 0; pass < 2; pass++) { /* without, then with the slopes' slopes */
        vec spin = {0, 0, 0}, spun = {0, 0, 0}, speed = {0, 0, 0}, sped = {0, 0, 0}, a, b;
        real inertia = 0, half = 0, lift = 0;
        for (int k = 0; k < BARS; k++) {
            vec own = {axis[k][0] * rate[k], axis[k][1] * rate[k], axis[k][2] * rate[k]};
            cross(spin, own, a);
            for (int i = 0; i < 3; i++) {
                spun[i] += a[i] + (pass ? bend[k] * axis[k][i] : 0);
                spin[i] += own[i];
            }
            vec reach = {l * bar[k][0], l * bar[k][1], l * bar[k][2]}, centre, gained;
            cross(spin, reach, a);
            cross(spin, a, b);
            cross(spun, reach, v);
            for (int i = 0; i < 3; i++) {
                centre[i] = speed[i] + a[i] / 2;
                gained[i] = sped[i] + (b[i] + v[i]) / 2;
                speed[i] += a[i];
                sped[i] += b[i] + v[i];
            }
            if (pass) {
                const real turning = dot(bar[k], spin);
                inertia += mass * dot(centre, centre) + across * dot(spin, spin) + (along - across) * turning * turning;
                half += mass * dot(centre, gained) + across * dot(spin, spun)
                        + (along - across) * turning * dot(bar[k], spun);
                lift += mass * centre[2];
            }
        }
        if (pass) {
            out[0] = -(half * u[0] * u[0] + g * lift) / inertia;
            break;
        }
        cross(spin, axis[BARS], a);
        cross(spin, a, b);
        cross(spun, axis[BARS], v);
        for (int i = 0; i < 3; i++) {
            right[i] = -sped[i];
            right[3 + i] = -l * (b[i] + v[i]);
        }
        solve(J, L, right, bend + 1, 0);
    }
    if (moved < 1e-9) {
        memcpy(known, angle, sizeof angle);
        memcpy(slope, rate, sizeof rate);
    }
}
