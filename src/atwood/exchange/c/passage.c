/* Coordinates and speeds of all bodies, by which states pass from one mode to another, and plastic impacts there. */

#define ROWS (BODY_SPEEDS + BODY_CONSTRAINTS)

static double unit_of(const double *row, int count)
{
    const double most = largest_of(row, count);
    return most > 0.0 ? most : 1.0;
}

/* Entries of rows of bodies at their places, each column in units of a size. */
static void spread(const word *entries, int count, const int *rows, const int *columns, const double *units, int width,
                   double *target)
{
    int k;
    for (k = 0; k < count; k++) target[rows[k] * width + columns[k]] = entries[k].f * units[columns[k]];
}

#if HAS_MAXIMAL
static void length_one(double *q, const double *same)
{
    int i, k;
    for (i = 0; i < BODY_TURNS; i++) {
        const int *const turn = body_turns + 4 * i;
        double sum = 0.0, along = 0.0;
        for (k = 0; k < 4; k++) {
            sum += q[turn[k]] * q[turn[k]];
            if (same != NULL) along += q[turn[k]] * same[turn[k]];
        }
        sum = along < 0.0 ? -sqrt(sum) : sqrt(sum);
        for (k = 0; k < 4; k++) q[turn[k]] /= sum;
    }
}
#endif

/* Coordinates and speeds of all bodies in a state, which is in s->body; 1 where they have no value. */
static int bodies_of(scene *s, double t, const double *state, double *q, double *u)
{
    int i;
    for (i = 0; i < SIZE; i++) s->body[i].f = state[i];
#if HAS_MAXIMAL
    if (call_maximal(s, t, s->body, NULL) != 0) return 1;
    for (i = 0; i < BODY_COORDINATES; i++) q[i] = s->maximal_0[i].f;
    for (i = 0; i < BODY_SPEEDS; i++) u[i] = s->maximal_1[i].f;
    length_one(q, NULL);
#else
    (void)t;
    for (i = 0; i < COORDINATES; i++) q[i] = s->body[i].f;
    for (i = 0; i < SPEEDS; i++) u[i] = s->body[COORDINATES + i].f;
#endif
    return 0;
}

static int masses_at(scene *s, double t, const double *q, const double *u)
{
    int i;
    for (i = 0; i < BODY_COORDINATES; i++) s->body[i].f = q[i];
    for (i = 0; i < BODY_SPEEDS; i++) s->body[BODY_COORDINATES + i].f = u[i];
    if (call_impact(s, t, s->body, NULL) != 0) return 1;
    memset(s->slopes, 0, sizeof s->slopes);
    spread(s->impact_5, BODY_SLOPES, body_slope_rows, body_slope_columns, body_sizes, BODY_SPEEDS, s->slopes);
    return 0;
}

/* Velocities after a plastic impact: the nearest admissible ones in the metric of the masses.  Returns 1 where something
 * has no value, and 2 where a constraint would have to act against its one side; it is then in s->constraint, and its
 * number among all sides in s->side. */
static int struck(scene *s, double t, const double *q, double *u)
{
    double *const masses = s->masses, *const rows = s->rows_of_impact, *const right = s->right, *const x = s->unknowns;
    double unit = 0.0, most;
    int i, j, k;
    if (masses_at(s, t, q, u) != 0) return 1;
    memset(masses, 0, sizeof s->masses);
    memset(rows, 0, sizeof s->rows_of_impact);
    spread(s->impact_0, BODY_MASSES, body_mass_rows, body_mass_columns, body_sizes, BODY_SPEEDS, masses);
    for (i = 0; i < BODY_SPEEDS; i++) {
        for (j = 0; j < BODY_SPEEDS; j++) masses[i * BODY_SPEEDS + j] *= body_sizes[i];
    }
    unit = unit_of(masses, BODY_SPEEDS * BODY_SPEEDS);
    for (i = 0; i < BODY_SPEEDS; i++) {
        right[i] = 0.0;
        for (j = 0; j < BODY_SPEEDS; j++) {
            rows[i * ROWS + j] = masses[i * BODY_SPEEDS + j] / unit;
            right[i] += masses[i * BODY_SPEEDS + j] * (u[j] / body_sizes[j]);
        }
        right[i] /= unit;
    }
    for (k = 0; k < BODY_CONSTRAINTS; k++) {
        const double own = unit_of(s->slopes + k * BODY_SPEEDS, BODY_SPEEDS);
        for (j = 0; j < BODY_SPEEDS; j++) {
            const double slope = s->slopes[k * BODY_SPEEDS + j] / own;
            rows[j * ROWS + BODY_SPEEDS + k] = -slope;
            rows[(BODY_SPEEDS + k) * ROWS + j] = slope;
        }
        right[BODY_SPEEDS + k] = -s->impact_6[k].f / own;
    }
    least_norm(rows, right, ROWS, ROWS, x);
    most = largest_of(x + BODY_SPEEDS, BODY_CONSTRAINTS);
    for (k = 0; k < ONE_SIDES; k++) {
        const double impulse = x[BODY_SPEEDS + one_sides[2 * k]];
        if (fabs(impulse) > 1e-9 * most && impulse * one_sides[2 * k + 1] > 0.0) {
            s->constraint = one_sides[2 * k];
            s->side = k;
            return 2;
        }
    }
    for (i = 0; i < BODY_SPEEDS; i++) u[i] = x[i] * body_sizes[i];
    return 0;
}

#if SWITCHES
/* What constraints miss, in the scene's sizes, and how fast; returns the fastest of all that moves. */
static double misses(scene *s, double t, const double *q, const double *u, double *values, double *rates_of_misses)
{
    double fastest = 0.0;
    int k;
    if (masses_at(s, t, q, u) != 0) return (double)NAN;
    for (k = 0; k < BODY_SPEEDS; k++) fastest = fmax(fastest, fabs(u[k] / body_sizes[k]));
    for (k = 0; k < BODY_CONSTRAINTS; k++) {
        const double unit = unit_of(s->slopes + k * BODY_SPEEDS, BODY_SPEEDS);
        values[k] = s->impact_2[k].f / unit;
        rates_of_misses[k] = s->impact_3[k].f / unit;
        fastest = fmax(fastest, fabs(s->impact_6[k].f / unit));
    }
    return fastest;
}
#endif

#if HAS_MAXIMAL
/* Where bodies are, beside where they are to be: displacements along their speeds, in their sizes. */
static int place_apart(scene *s, double t, const word *place, const double *q, double *off)
{
    double found[BODY_COORDINATES];
    int i, k;
    for (i = 0; i < COORDINATES; i++) s->body[i] = place[i];
    for (i = COORDINATES; i < SIZE; i++) s->body[i].f = 0.0;
    if (call_maximal(s, t, s->body, NULL) != 0) return 1;
    for (i = 0; i < BODY_COORDINATES; i++) found[i] = s->maximal_0[i].f;
    length_one(found, q);
    memset(s->rows_of_impact, 0, sizeof(double) * BODY_SPEEDS * SPEEDS);
    spread(s->maximal_2, PLACE_SLOPES, place_rows, place_columns, sizes, SPEEDS, s->rows_of_impact);
    for (i = 0; i < BODY_SPEEDS; i++) {
        for (k = 0; k < SPEEDS; k++) s->rows_of_impact[i * SPEEDS + k] /= body_sizes[i];
        off[i] = 0.0;
    }
    for (k = 0; k < ALONG; k++) off[along_places[2 * k + 1]] = found[along_places[2 * k]] - q[along_places[2 * k]];
    for (i = 0; i < BODY_TURNS; i++) { /* twice the vector part of the turn, in the axes of the body */
        const int *const turn = body_turns + 4 * i, *const spin = body_spins + 3 * i;
        const double a = q[turn[0]], b = q[turn[1]], c = q[turn[2]], d = q[turn[3]];
        const double e = found[turn[0]], f = found[turn[1]], g = found[turn[2]], h = found[turn[3]];
        off[spin[0]] = 2.0 * (a * f - b * e - c * h + d * g);
        off[spin[1]] = 2.0 * (a * g + b * h - c * e - d * f);
        off[spin[2]] = 2.0 * (a * h - b * g + c * f - d * e);
    }
    for (i = 0; i < BODY_SPEEDS; i++) off[i] /= body_sizes[i];
    return 0;
}
#endif

/* The state that gives coordinates and speeds of bodies, from a first guess of its coordinates. */
static int state_of(scene *s, double t, const double *guess, const double *q, const double *u, double *state)
{
#if HAS_MAXIMAL
    double *const off = s->right, *const step = s->unknowns;
    double last = INFINITY, far;
    int i, j, turn;
    for (i = 0; i < COORDINATES; i++) s->y[i].f = guess[i];
    for (i = 0; i < TURNED; i++) s->y[turned_places[2 * i]].f = q[turned_places[2 * i + 1]];
    normalize(s->y);
    for (turn = 0; turn < 30; turn++) {
        if (place_apart(s, t, s->y, q, off) != 0) return say(s, FAILED, "the new mode, in which something has no value");
        least_norm(s->rows_of_impact, off, BODY_SPEEDS, SPEEDS, step);
        far = largest_of(step, SPEEDS);
#if HAS_TANGENT
        for (i = 0; i < COORDINATES; i++) s->body[i] = s->y[i];
        for (i = COORDINATES; i < SIZE; i++) s->body[i].f = 0.0;
        call_tangent(s, t, s->body, NULL);
        for (i = 0; i < TANGENTS; i++) {
            j = tangent_columns[i];
            s->y[tangent_rows[i]].f -= s->tangent_1[i].f * sizes[j] * step[j];
        }
#else
        for (i = 0; i < COORDINATES && i < SPEEDS; i++) s->y[i].f -= step[i] * sizes[i];
#endif
        normalize(s->y);
        if (far < 1e-15 || (far < 1e-11 && far >= last)) break;
        last = far;
    }
    if (place_apart(s, t, s->y, q, off) != 0 || !(largest_of(off, BODY_SPEEDS) <= HELD)) {
        return say(s, FAILED, "a change of mode would change a position at once");
    }
    for (i = 0; i < BODY_SPEEDS; i++) off[i] = (u[i] - s->maximal_1[i].f) / body_sizes[i];
    least_norm(s->rows_of_impact, off, BODY_SPEEDS, SPEEDS, step);
    for (i = 0; i < COORDINATES; i++) state[i] = s->y[i].f;
    for (j = 0; j < SPEEDS; j++) state[COORDINATES + j] = step[j] * sizes[j];
#else
    int i;
    (void)s, (void)t, (void)guess;
    for (i = 0; i < COORDINATES; i++) state[i] = q[i];
    for (i = 0; i < SPEEDS; i++) state[COORDINATES + i] = u[i];
#endif
    return READY;
}
