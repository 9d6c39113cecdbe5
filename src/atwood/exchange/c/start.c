/* Where a scene starts with other values of its parameters: conditions on places by Newton's method with steps of least
 * norm, then those on speeds. */

#define MET 1e-7 /* what a start may miss, in the scene's sizes */

enum { ALL_TARGETS, GUESSES, HELD_FAST };

/* Whether a condition is asked for: constraints first, then targets. */
static int is_wanted(int wanted, int i, int constraints, const int *fixed)
{
    if (wanted == HELD_FAST) return i < constraints || fixed[i - constraints];
    return i >= constraints && (wanted == ALL_TARGETS || !fixed[i - constraints]);
}

/* Read conditions and their slopes, in s->rows_of_start and s->misses_of_start; -1 where they have no value. */
static int conditions(scene *s, double t, int is_speed, int wanted)
{
    const int constraints = is_speed ? SPEED_CONSTRAINTS : PLACE_CONSTRAINTS;
    const int count = constraints + (is_speed ? SPEED_TARGETS : PLACE_TARGETS);
    const int *const fixed = is_speed ? speeds_fixed : places_fixed, *const at = s->row_of_condition;
    const word *const found = is_speed ? s->start_speeds_0 : s->start_places_0;
    const word *const slopes = is_speed ? s->start_speeds_1 : s->start_places_1;
    const int entries = is_speed ? SPEED_SLOPES : PLACE_SLOPES_OF_START;
    const int *const rows = is_speed ? speed_slope_rows : place_slope_rows;
    const int *const columns = is_speed ? speed_slope_columns : place_slope_columns;
    int i, k, chosen = 0;
    if ((is_speed ? call_start_speeds(s, t, s->start_y, NULL) : call_start_places(s, t, s->start_y, NULL)) != 0) return -1;
    for (i = 0; i < count; i++) {
        double off = found[i].f;
        s->row_of_condition[i] = -1;
        if (!is_wanted(wanted, i, constraints, fixed)) continue;
        if (i >= constraints) {
            off -= (is_speed ? speeds_wanted : places_wanted)[i - constraints];
            if ((is_speed ? speeds_wrapped : places_wrapped)[i - constraints]) {
                off -= 6.283185307179586 * floor(off / 6.283185307179586 + 0.5);
            }
        }
        s->row_of_condition[i] = chosen;
        s->misses_of_start[chosen++] = off;
    }
    for (k = 0; k < chosen * START_SPEEDS; k++) s->rows_of_start[k] = 0.0;
    for (k = 0; k < entries; k++) {
        if (at[rows[k]] < 0) continue;
        s->rows_of_start[at[rows[k]] * START_SPEEDS + columns[k]] = slopes[k].f * start_sizes[columns[k]];
    }
    return chosen;
}

static void length_of_start(scene *s)
{
    int i, k;
    for (i = 0; i < START_TURNS; i++) {
        double sum = 0.0;
        for (k = start_turn_firsts[i]; k < start_turn_firsts[i + 1]; k++) {
            sum += s->start_y[start_turns[k]].f * s->start_y[start_turns[k]].f;
        }
        sum = sqrt(sum);
        for (k = start_turn_firsts[i]; k < start_turn_firsts[i + 1]; k++) s->start_y[start_turns[k]].f /= sum;
    }
}

/* Meet conditions on places. */
static int place_start(scene *s, double t, int wanted)
{
    double *const step = s->step_of_start;
    double last = INFINITY;
    int i, turn;
    for (turn = 0; turn < 60; turn++) {
        const int count = conditions(s, t, 0, wanted);
        double far, share;
        if (count < 0) return 0;
        least_norm(s->rows_of_start, s->misses_of_start, count, START_SPEEDS, step);
        far = largest_of(step, START_SPEEDS);
        if (!(far - far == 0.0)) return 0;
        share = far > 0.5 ? 0.5 / far : 1.0;
#if HAS_TANGENT
        call_tangent(s, t, s->start_y, NULL);
        for (i = 0; i < TANGENTS; i++) {
            const int j = tangent_columns[i];
            s->start_y[tangent_rows[i]].f -= s->tangent_1[i].f * start_sizes[j] * step[j] * share;
        }
#else
        for (i = 0; i < START_COORDINATES && i < START_SPEEDS; i++) s->start_y[i].f -= step[i] * start_sizes[i] * share;
#endif
        length_of_start(s);
        if (far < 1e-15 || (far < 1e-12 && far >= last)) break;
        last = far;
    }
    return 1;
}

static int is_met(scene *s, double t, int is_speed)
{
    const int count = conditions(s, t, is_speed, HELD_FAST);
    const double least = 1e-6 * largest_of(start_sizes, START_SPEEDS);
    int i;
    for (i = 0; i < count; i++) {
        const double size = fmax(largest_of(s->rows_of_start + i * START_SPEEDS, START_SPEEDS), least);
        if (!(fabs(s->misses_of_start[i]) <= MET * size)) return 0;
    }
    return count >= 0;
}

static int placed(scene *s, double t, const double *from)
{
    int i;
    for (i = 0; i < START_COORDINATES; i++) s->start_y[i].f = from[i];
    for (i = 0; i < START_SPEEDS; i++) s->start_y[START_COORDINATES + i].f = 0.0;
    for (i = 0; i < PLACE_TARGETS; i++) {
        if (places_direct[i] >= 0) s->start_y[places_direct[i]].f = places_wanted[i];
    }
    length_of_start(s);
    for (i = 0; i < PLACE_TARGETS; i++) {
        if (places_direct[i] >= 0) continue;
        if (!place_start(s, t, ALL_TARGETS)) return 0;
        break;
    }
    return place_start(s, t, HELD_FAST) && is_met(s, t, 0);
}

static void improve_speeds(scene *s, double t, int wanted)
{
    const int count = conditions(s, t, 1, wanted);
    int i;
    if (count < 0) return;
    least_norm(s->rows_of_start, s->misses_of_start, count, START_SPEEDS, s->step_of_start);
    for (i = 0; i < START_SPEEDS; i++) s->start_y[START_COORDINATES + i].f -= s->step_of_start[i] * start_sizes[i];
}

/* Find the start of a scene whose parameters have other values, in s->state; what was set otherwise stays as it is. */
static int find_start(scene *s)
{
    const double t = s->time;
    int i, is_moved = 0, guesses = 0;
    for (i = 0; i < scene_PARAMETERS; i++) {
        const int place = parameter_places[i];
        is_moved |= place >= 0 && s->values[place].f != values[place];
    }
    for (i = 0; i < SIZE; i++) is_moved &= s->state[i] == start_state[i];
    if (!is_moved || t != start_moment) return READY;
    in_piece(s, t);
    if (!placed(s, t, start_reference) && !placed(s, t, start_place)) {
        return say(s, FAILED, "the start cannot be met with these values");
    }
    for (i = 0; i < SPEED_TARGETS; i++) {
        if (speeds_direct[i] >= 0) s->start_y[START_COORDINATES + speeds_direct[i]].f = speeds_wanted[i];
        guesses |= !speeds_fixed[i] && speeds_direct[i] < 0;
    }
    if (guesses) improve_speeds(s, t, GUESSES);
    for (i = 0; i < 3 && SPEED_CONSTRAINTS + SPEED_TARGETS > 0; i++) improve_speeds(s, t, HELD_FAST);
    if (!is_met(s, t, 1)) return say(s, FAILED, "the speeds of the start cannot be met with these values");
#if START_IS_MAXIMAL
    if (call_start_maximal(s, t, s->start_y, NULL) != 0) return say(s, FAILED, "the bodies have no place at the start");
    for (i = 0; i < COORDINATES; i++) s->state[i] = s->start_maximal_0[i].f;
    for (i = 0; i < SPEEDS; i++) s->state[COORDINATES + i] = s->start_maximal_1[i].f;
#else
    for (i = 0; i < SIZE; i++) s->state[i] = s->start_y[i].f;
#endif
    s->is_evaluated = 0;
    return READY;
}
