/* Planar linkages of one angle q: places with their first and second derivatives by q, groups of two links by the
 * intersection of circles, and the sums of M q'' + M'/2 q'^2 = Q. */
#include "real.h"

typedef struct {
    real x, y, dx, dy, ddx, ddy;
} place;

typedef struct {
    real inertia, half, force; /* M, M'/2, Q */
} sums;

static inline place fixed(real x, real y)
{
    return (place){x, y, 0, 0, 0, 0};
}

/* The end of a link of length l whose angle is q, from p. */
static inline place turned(place p, real l, real s, real c)
{
    return (place){p.x + l * c, p.y + l * s, p.dx - l * s, p.dy + l * c, p.ddx - l * c, p.ddy - l * s};
}

/* Where links of lengths l and n, which begin at p and r, meet; to the left of the line from p to r for side 1. */
static inline place meeting(place p, place r, real l, real n, real side)
{
    const real ex = r.x - p.x, ey = r.y - p.y, over = 1 / (ex * ex + ey * ey);
    const real along = ((l * l - n * n) * over + 1) / 2, across = side * sqrt(l * l * over - along * along);
    const real ax = along * ex - across * ey, ay = along * ey + across * ex, bx = ax - ex, by = ay - ey;
    const real det = 1 / (ax * by - ay * bx);
    place m = {p.x + ax, p.y + ay, 0, 0, 0, 0};
    real f = ax * p.dx + ay * p.dy, g = bx * r.dx + by * r.dy, u, v;
    m.dx = (f * by - g * ay) * det;
    m.dy = (g * ax - f * bx) * det;
    u = m.dx - p.dx, v = m.dy - p.dy;
    f = ax * p.ddx + ay * p.ddy - u * u - v * v;
    u = m.dx - r.dx, v = m.dy - r.dy;
    g = bx * r.ddx + by * r.ddy - u * u - v * v;
    m.ddx = (f * by - g * ay) * det;
    m.ddy = (g * ax - f * bx) * det;
    return m;
}

/* A point of the body through p and r, l apart: `along` from p towards r and `across` to the left, as shares of l. */
static inline place carried(place p, place r, real along, real across)
{
    return (place){p.x + along * (r.x - p.x) - across * (r.y - p.y),
                   p.y + along * (r.y - p.y) + across * (r.x - p.x),
                   p.dx + along * (r.dx - p.dx) - across * (r.dy - p.dy),
                   p.dy + along * (r.dy - p.dy) + across * (r.dx - p.dx),
                   p.ddx + along * (r.ddx - p.ddx) - across * (r.ddy - p.ddy),
                   p.ddy + along * (r.ddy - p.ddy) + across * (r.ddx - p.ddx)};
}

/* Add a body through p and r: its centre, its mass and its moment over the fourth power of the distance of p and r. */
static inline void add(sums *all, place p, place r, place centre, real mass, real share, real weight)
{
    const real ax = r.x - p.x, ay = r.y - p.y;
    const real turn = ax * (r.dy - p.dy) - ay * (r.dx - p.dx), bend = ax * (r.ddy - p.ddy) - ay * (r.ddx - p.ddx);
    all->inertia += mass * (centre.dx * centre.dx + centre.dy * centre.dy) + share * turn * turn;
    all->half += mass * (centre.dx * centre.ddx + centre.dy * centre.ddy) + share * turn * bend;
    all->force -= weight * mass * centre.dy;
}
