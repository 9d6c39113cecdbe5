/* Laws that compare what moves: on which side of each comparison a motion goes on. */

#define TRIED 32

static double related(int kind, double x)
{
    switch (kind) {
    case LESS: return x < 0.0;
    case LESS_EQUAL: return x <= 0.0;
    case NONZERO: return x != 0.0;
    case SIGN: return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0;
    default: return floor(x);
    }
}

static void take_sides(scene *s, const double *sides)
{
    int i;
    for (i = 0; i < SIDES; i++) s->values[FIRST_SIDE + i].f = sides[i];
    fill(s);
}

/* Read what is compared in s->y. */
static int differences(scene *s, double t, const double *sides)
{
    take_sides(s, sides);
    return call_sides(s, t, s->y, NULL);
}

static int is_zero(const scene *s, int i)
{
    return fabs(s->sides_0[i].f) <= 64.0 * ROUNDING * s->sides_1[i].f;
}

/* The sides a moment later, if a motion begins on some; whether that is open. */
static int ahead_of(scene *s, double t, double step, const double *sides, const int *near, double *found)
{
    double a[SIZE];
    int i, is_open = 0;
    take_sides(s, sides);
    for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
    rates(t, s->y, s->yp, s->block);
    for (i = 0; i < SIZE; i++) {
        a[i] = s->yp[i].f;
        if (i >= COORDINATES) s->y[i].f += 0.5 * step * a[i];
    }
    rates(t, s->y, s->yp, s->block);
    for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i] + step * (i < COORDINATES ? s->yp[i].f : a[i]);
    memcpy(found, sides, sizeof(double) * SIDES);
    if (differences(s, t + step, sides) != 0) return 1;
    for (i = 0; i < SIDES; i++) {
        if (!near[i]) continue;
        found[i] = related(side_kinds[i], s->sides_0[i].f);
        is_open |= is_zero(s, i) && side_kinds[i] != FLOOR;
    }
    return is_open;
}

/* Take the sides that hold from s->state on; 0 where a motion stays where one of them changes. */
static int take_sides_from(scene *s, double t)
{
    static const double shares[2] = {1e-8, 1e-5};
    double before[SIDES], now[SIDES], passed[SIDES], tried[TRIED * SIDES], found[SIDES];
    int near[SIDES], i, k, turn, some = 0;
    for (i = 0; i < SIDES; i++) before[i] = now[i] = s->values[FIRST_SIDE + i].f;
    for (turn = 0; turn <= SIDES + 1; turn++) {
        int same = 1;
        for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
        if (differences(s, t, now) != 0) return 0;
        for (i = 0; i < SIDES; i++) {
            found[i] = related(side_kinds[i], s->sides_0[i].f);
            same &= found[i] == now[i];
        }
        if (same) break;
        if (turn <= SIDES) memcpy(now, found, sizeof now);
    }
    for (i = 0; i < SIDES; i++) {
        const double off = s->sides_0[i].f, x = before[i];
        const int kind = side_kinds[i];
        near[i] = s->passed_sides[i] || is_zero(s, i);
        some |= near[i];
        passed[i] = !s->passed_sides[i] ? now[i]
            : kind == FLOOR ? x + (off > x + 0.5 ? 1.0 : -1.0) : kind == SIGN ? -x : 1.0 - x;
        s->passed_sides[i] = 0;
    }
    if (!some) {
        take_sides(s, now);
        return 1;
    }
    for (turn = 0; turn < 2; turn++) {
        int count = 1;
        memcpy(tried, passed, sizeof passed);
        for (;;) {
            const double *const last = tried + (count - 1) * SIDES;
            const int is_open = ahead_of(s, t, shares[turn] * time_scale, last, near, found);
            int same = 1, was = 0;
            for (i = 0; i < SIDES; i++) same &= !near[i] || found[i] == last[i];
            if (!is_open && same) {
                take_sides(s, found);
                return 1;
            }
            for (k = 0; k < count && !was; k++) was = memcmp(tried + k * SIDES, found, sizeof found) == 0;
            if (is_open) break;
            if (was || count == TRIED) return 0;
            memcpy(tried + count * SIDES, found, sizeof found);
            count++;
        }
    }
    return 0;
}
