/* The engine: memory of the routines above, steps, what happens within them, and what is asked from outside. */

#define HELD 1e-6      /* what constraints may miss, in the scene's sizes */
#define LOW 0.3        /* shares of the most that was left of constraints */
#define NEARBY 0.1
#define SINGULAR 1e-3
#define ROUNDING 2.220446049250313e-16

static int say(scene *s, int status, const char *text)
{
    s->status = status;
    s->text = text;
    return status;
}

static void address(scene *s, int function, void (*call)(void))
{
    s->functions[function].call = call;
}

#if EVENTS
static int32_t events_at(double t, word *y, word *yp, word *target, word *data)
{
    scene *s = (scene *)(void *)data[0].p;
    word in[4], out[1];
    word moment;
    (void)yp;
    moment.f = t;
    in[0].p = &moment;
    in[1].p = y;
    in[2].p = y + COORDINATES;
    in[3].p = s->shifts;
    out[0].p = target;
    return events(in, s->events_derived, s->scratch, out);
}
#endif

#if EVENTS || CONTACTS || SWITCHES
/* log */
#endif

/* Where everything lies; after an instance was copied, too. */
static void link_memory(scene *s)
{
    word *f = s->session;
    address(s, 0, (void (*)(void))rates);
    f[FIELD_arrays].p = s->arrays;
    f[FIELD_function].p = &s->functions[0];
    f[FIELD_data].p = s->block;
    s->block[0].p = s->kernel_derived;
    s->block[1].p = s->scratch;
#if PROJECTS
    address(s, 1, (void (*)(void))project);
    s->block[2].p = s->nearer_derived;
    s->block[3].p = s->scratch;
    s->block[4].p = s->nearer_room;
    f[FIELD_project].p = &s->functions[1];
    f[FIELD_project_data].p = s->block + 2;
#endif
#if JUDGES
    address(s, 2, (void (*)(void))guard);
    s->judged[0].p = s->judge_derived;
    s->judged[1].p = s->scratch;
    s->judged[2].f = judged_by[0];
    s->judged[3].f = judged_by[1];
    if (!(s->step > 0.0)) f[FIELD_guard].p = &s->functions[2];
    f[FIELD_guard_data].p = s->judged;
#endif
#if EVENTS
    address(s, 3, (void (*)(void))interpolate);
    address(s, 4, (void (*)(void))events_at);
    s->self[0].p = (word *)(void *)s;
    s->sought[SOUGHT_interpolate].p = &s->functions[3];
    s->sought[SOUGHT_session].p = s->session;
    s->sought[SOUGHT_events].p = &s->functions[4];
    s->sought[SOUGHT_data].p = s->self;
    s->sought[SOUGHT_y].p = s->event_y;
    s->sought[SOUGHT_yp].p = s->event_yp;
    s->sought[SOUGHT_shifted].p = s->shifted;
    s->sought[SOUGHT_turns].p = s->turns;
    s->sought[SOUGHT_rows].p = s->rows;
#endif
#if CONTACTS
    address(s, 5, (void (*)(void))contacts);
    s->sets[SET_program].p = &s->functions[5];
    s->sets[SET_derived].p = s->contacts_derived;
    s->sets[SET_scratch].p = s->scratch;
    s->sets[SET_y].p = s->y;
    s->sets[SET_out].p = s->contacts_0;
    s->sets[SET_units].p = s->units;
    s->sets[SET_rows].p = s->set_rows;
    s->sets[SET_matrix].p = s->matrix;
    s->sets[SET_left].p = s->left;
    s->sets[SET_shares].p = s->shares;
    s->sets[SET_pattern].p = s->pattern;
    s->sets[SET_past].p = s->impacts;
    s->sets[SET_log].p = s->log_of_sets;
#endif
}

static word *row(scene *s, int number)
{
    return s->arrays + PADDED * number;
}

/* The coordinates of orientations have length one. */
static void normalize(word *y)
{
#if TURNS
    int i, k;
    for (i = 0; i < TURNS; i++) {
        double sum = 0.0;
        for (k = turn_starts[i]; k < turn_starts[i + 1]; k++) sum += y[turn_places[k]].f * y[turn_places[k]].f;
        sum = sqrt(sum);
        for (k = turn_starts[i]; k < turn_starts[i + 1]; k++) y[turn_places[k]].f /= sum;
    }
#else
    (void)y;
#endif
}

static int strays(const word *y)
{
#if TURNS
    int i, k;
    for (i = 0; i < TURNS; i++) {
        double sum = 0.0;
        for (k = turn_starts[i]; k < turn_starts[i + 1]; k++) sum += y[turn_places[k]].f * y[turn_places[k]].f;
        if (!(sum > 0.25 && sum < 4.0)) return 1;
    }
#else
    (void)y;
#endif
    return 0;
}

#if CONSTRAINTS
static double size_of(double a, double b)
{
    const double size = fabs(a);
    return size > b ? size : b;
}

/* The constraint that is missed, also of those that follow from others; -1 where all are met. */
static int missed(scene *s, double t, word *y)
{
    double slopes[CONSTRAINTS * SPEEDS];
    int i, j, k;
    if (call_constraints(s, t, y, NULL) != 0) return 0;
    memset(slopes, 0, sizeof slopes);
    for (k = 0; k < SLOPES; k++) {
        slopes[slope_rows[k] * SPEEDS + slope_columns[k]] = s->constraints_1[k].f * sizes[slope_columns[k]];
    }
    for (k = 0; k < CONSTRAINTS * SPEEDS; k++) s->held_size = size_of(slopes[k], s->held_size);
    for (i = 0; i < CONSTRAINTS; i++) {
        double rate = s->constraints_2[i].f, unit = 1e-300;
        for (j = 0; j < SPEEDS; j++) {
            rate += slopes[i * SPEEDS + j] * y[COORDINATES + j].f / sizes[j];
            unit = size_of(slopes[i * SPEEDS + j], unit);
        }
        unit = size_of(1e-4 * s->held_size, unit);
        if (!(fabs(s->constraints_0[i].f) <= HELD * unit && fabs(rate) * time_scale <= HELD * unit)) return i;
    }
    return -1;
}
#endif

#if WATCHED
/* What is left of each kept constraint by the others: the least share of the most that each has been, and whose. */
static double independence(scene *s, double t, word *y, int *which)
{
    double slopes[KEPT * SPEEDS], squares[KEPT], least = INFINITY;
    int order[KEPT];
    int i, j, k, e, turn;
    *which = 0;
    if (call_constraints(s, t, y, NULL) != 0) return 0.0;
    memset(slopes, 0, sizeof slopes);
    for (e = 0; e < SLOPES; e++) {
        k = kept_rank[slope_rows[e]];
        if (k >= 0) slopes[k * SPEEDS + slope_columns[e]] = s->constraints_1[e].f * sizes[slope_columns[e]];
    }
    for (k = 0; k < KEPT; k++) {
        double sum = 0.0, size;
        for (j = 0; j < SPEEDS; j++) sum += slopes[k * SPEEDS + j] * slopes[k * SPEEDS + j];
        size = s->held_most[k] = size_of(sqrt(sum), s->held_most[k]);
        if (size == 0.0) size = 1.0;
        for (j = 0; j < SPEEDS; j++) slopes[k * SPEEDS + j] /= size;
        squares[k] = sum / (size * size);
        order[k] = k;
    }
    for (turn = 0; turn < KEPT; turn++) {
        int best = turn, p;
        double pivot;
        for (k = turn + 1; k < KEPT; k++) {
            if (squares[order[k]] > squares[order[best]]) best = k;
        }
        p = order[best];
        order[best] = order[turn];
        order[turn] = p;
        pivot = squares[p];
        if (!(pivot >= least)) {
            least = pivot;
            *which = kept_constraints[p];
        }
        for (k = turn + 1; k < KEPT; k++) {
            double share = 0.0, left = 0.0;
            i = order[k];
            for (j = 0; j < SPEEDS; j++) share += slopes[i * SPEEDS + j] * slopes[p * SPEEDS + j];
            share /= pivot != 0.0 ? pivot : 1.0;
            for (j = 0; j < SPEEDS; j++) {
                const double x = slopes[i * SPEEDS + j] -= share * slopes[p * SPEEDS + j];
                left += x * x;
            }
            squares[i] = left;
        }
    }
    return sqrt(least > 0.0 ? least : 0.0);
}

static double independence_at(scene *s, double t)
{
    int which;
    return interpolate(s->session, t, s->y, s->yp) == 0 ? independence(s, t, s->y, &which) : INFINITY;
}

/* The time of a singular position within the last step, and a constraint; infinite where there is none. */
static double singular(scene *s, int *which)
{
    const double t0 = s->session[FIELD_t_old].f, t1 = s->session[FIELD_t].f, before = s->held_last;
    double times[5], found[5], a, b, left, right, low, high, time;
    int i, k = 0;
    s->held_last = independence(s, t1, row(s, ROW_y), which);
    s->held_largest = size_of(s->held_last, s->held_largest);
    if (fmin(before, s->held_last) >= LOW * s->held_largest) return INFINITY;
    for (i = 0; i < 5; i++) {
        times[i] = t0 + 0.25 * i * (t1 - t0);
        found[i] = i == 0 ? before : i == 4 ? s->held_last : independence_at(s, times[i]);
        if (found[i] < found[k]) k = i;
    }
    if (found[k] >= NEARBY * s->held_largest) return INFINITY;
    a = times[k > 0 ? k - 1 : 0];
    b = times[k < 4 ? k + 1 : 4];
    left = a + 0.382 * (b - a);
    right = a + 0.618 * (b - a);
    low = independence_at(s, left);
    high = independence_at(s, right);
    while (b - a > 1e-6 * (t1 - t0) && fmin(low, high) >= SINGULAR * s->held_largest) {
        if (fabs(high - low) <= 1e-9 * s->held_largest) break;
        if (low < high) {
            b = right;
            right = left;
            high = low;
            left = a + 0.382 * (b - a);
            low = independence_at(s, left);
        } else {
            a = left;
            left = right;
            low = high;
            right = a + 0.618 * (b - a);
            high = independence_at(s, right);
        }
    }
    time = low < high ? left : right;
    if (fmin(low, high) >= SINGULAR * s->held_largest) return INFINITY;
    interpolate(s->session, time, s->y, s->yp);
    independence(s, time, s->y, which);
    return time;
}
#endif

/* Relations of functions of time have the values that hold at a time and just after it. */
static void in_piece(scene *s, double t)
{
#if PIECES
    int piece = 0, k;
    while (piece < PIECES && piece_times[piece] <= t) piece++;
    for (k = 0; k < RELATIONS; k++) s->values[RELATION + k].f = piece_values[piece * RELATIONS + k];
#else
    (void)t;
#endif
    fill(s);
}

#if UPDATES
/* The first moment after a time at which updates are due. */
static int next_moment(double t)
{
    int low = 0, high = MOMENTS;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (moment_times[middle] > t) high = middle;
        else low = middle + 1;
    }
    return low;
}
#endif

static double next_piece(const scene *s)
{
    double next = known_until;
#if PIECES
    int k;
    for (k = PIECES - 1; k >= 0; k--) {
        if (piece_times[k] > s->began && piece_times[k] < next) next = piece_times[k];
    }
#endif
#if UPDATES
    {
        const int moment = next_moment(s->began);
        if (moment < MOMENTS && moment_times[moment] < next) next = moment_times[moment];
    }
#endif
    (void)s;
    return next;
}

static void take(scene *s, double t, const word *y)
{
    int i;
    s->time = t;
    for (i = 0; i < SIZE; i++) s->state[i] = y[i].f;
    s->is_evaluated = 0;
}

/* The state at a time within the last step, in y. */
static int at(scene *s, double t)
{
    if (interpolate(s->session, t, s->y, s->yp) != 0) return 1;
#if PROJECTS
    if (t != s->session[FIELD_t].f) project(t, s->y, s->block + 2);
#endif
    return 0;
}

#if EVENTS
/* contacts */
/* sides */
/* Take the signs of events at a start; those that start at zero have a margin to pass, in the direction that counts. */
static int listen(scene *s, double t)
{
    int i;
    memset(s->shifts, 0, sizeof s->shifts);
    if (events_at(t, s->y, NULL, s->event_y, s->self) != 0) return 1;
    for (i = 0; i < EVENTS; i++) {
        const double small = event_small[i] * s->rtol, now = s->event_y[i].f;
        s->shifts[i].f = !event_noted[i] && fabs(now) <= small ? -event_direction[i] * small : 0.0;
#if SIDES
        if (event_side[i] >= 0 && now <= 0.0) s->shifts[i].f = 2.0 * fabs(now) + 1e-300;
#endif
        s->rows[EVENTS * SEARCHED_given + i].f = s->fired[i] ? 2.0 : 0.0;
        s->rows[EVENTS * SEARCHED_direction + i].f = event_direction[i];
        s->rows[EVENTS * SEARCHED_sign + i].f = 0.0;
    }
#if CONTACTS
    arm(s, t);
#endif
    s->sought[SOUGHT_is_first].i = CONTACTS > 0;
    return restart(s->sought, t) == 0 ? 0 : 1;
}

/* The event that has happened where a motion begins; -1 where none has. */
static int broken(const scene *s)
{
    int i;
    for (i = 0; i < EVENTS; i++) {
        const double small = event_small[i] * s->rtol;
        const double known = s->rows[EVENTS * SEARCHED_known + i].f;
#if CONTACTS
        if (s->calm[i]) continue;
#endif
        if (!event_noted[i] && event_direction[i] * (known - s->shifts[i].f) > 0.9 * small) return i;
    }
    return -1;
}

/* The time at which the value of what happened was zero, where it came from the other side and the margin made it late. */
static double without_margin(scene *s, double t)
{
    const double since = t - s->began, later = 1e-6 * since;
    double now[EVENTS] = {0.0}, least = INFINITY, most = -INFINITY;
    int i, k, clear = since > 0.0;
    for (i = 0; i < EVENTS; i++) {
        if (s->fired[i] && s->shifts[i].f == 0.0) clear = 0;
    }
    if (!clear) return t;
    for (k = 0; k < 2; k++) {
        const double back = k == 0 ? 0.0 : later;
        for (i = 0; i < SIZE; i++) s->y[i].f = s->event_y[i].f - back * s->event_yp[i].f;
        events_at(t - back, s->y, NULL, s->yp, s->self);
        for (i = 0; i < EVENTS; i++) {
            const double value = s->yp[i].f - s->shifts[i].f;
            if (k == 0) {
                now[i] = value;
            } else if (s->fired[i]) {
                const double slope = (now[i] - value) / later, late = now[i] / slope;
                if (!(slope * s->shifts[i].f < 0.0 && fabs(now[i]) < 0.1 * since * fabs(slope))) clear = 0;
                least = fmin(least, late);
                most = fmax(most, late);
            }
        }
    }
    return clear && most <= (1.0 + 1e-6) * least ? t - least : t;
}
#endif

/* Look for what happens up to the end of a step: an event, or a singular position. */
static void watch(scene *s)
{
    const double until = fmin(s->session[FIELD_t].f, next_piece(s));
    s->coming = INFINITY;
    s->coming_kind = READY;
#if EVENTS
    if (s->searched < until) {
        const int32_t code = search(s->sought, s->searched, until);
        if (code != 0) {
            const double t = s->sought[SOUGHT_root].f;
            int i;
            s->coming = s->found = t;
            s->coming_kind = code == 1 ? STOPPED : FAILED;
            for (i = 0; i < EVENTS; i++) s->fired[i] = s->rows[EVENTS * SEARCHED_found + i].f != 0.0;
            if (code == 1) {
                s->coming = without_margin(s, t);
                for (i = 0; i < SIZE; i++) s->event_y[i].f -= (t - s->coming) * s->event_yp[i].f;
            }
        }
    }
#endif
#if WATCHED
    {
        int which;
        const double low = singular(s, &which);
        if (low <= fmin(s->coming, until)) {
            s->coming = s->found = low;
            s->coming_kind = AT_SINGULARITY;
            s->constraint = which;
        }
    }
#endif
    s->searched = s->coming_kind == READY ? until : s->found;
}

/* leastnorm */
/* passage */
/* start */
#if UPDATES
/* What updates make of the state, one after the other; 0 where one has no value. */
static int update(scene *s, const int *list, int count, const int *known)
{
    int i, j;
    for (i = 0; i < count; i++) {
        const int k = list[i];
        const double *given = known != NULL && known[i] >= 0 ? given_values + known[i] : NULL;
        for (j = 0; j < SIZE; j++) s->y[j].f = s->state[j];
        if (given == NULL) given = updated(s, k);
        if (given == NULL) return 0;
        for (j = update_starts[k]; j < update_starts[k + 1]; j++) {
            const double value = given[j - update_starts[k]];
            if (!(value - value == 0.0)) return 0;
            if (update_is_held[j]) s->values[update_places[j]].f = value;
            else s->state[update_places[j]] = value;
        }
        fill(s);
        s->is_evaluated = 0;
    }
    return 1;
}

/* The updates that are due at a time. */
static int sample(scene *s, double t)
{
    const int moment = next_moment(t) - 1, first = moment < 0 ? 0 : due_starts[moment];
    if (moment < 0 || moment_times[moment] != t) return 1;
    return update(s, due + first, due_starts[moment + 1] - first, due_given + first);
}
#endif

#define AGAIN (-1)   /* a motion begins anew from the state that there is */
#define CHANGES (-2) /* it goes on in the mode that an event leads to */

/* Go on from s->state where values change that functions of time, or updates, give: a motion that these prescribe may
 * jump in speed, which is an impact.  An event gives its updates; otherwise those are made that are due. */
static int alter(scene *s, double t, int event)
{
#if SWITCHES
    double *const q = s->places, *const u = s->velocities, *const was = s->was, *const now = s->now;
    double fastest, faster = 0.0;
    int i, has_impact = 0, told = -1;
    if (bodies_of(s, t, s->state, q, u) != 0) return say(s, FAILED, "the bodies have no place");
    fastest = misses(s, t, q, u, was, was + BODY_CONSTRAINTS);
#endif
    s->time = t;
    in_piece(s, t);
#if UPDATES
    {
        const int is_good = event < 0 ? sample(s, t)
            : update(s, event_updates + update_firsts[event], update_firsts[event + 1] - update_firsts[event], NULL);
        if (!is_good) return say(s, FAILED, "an update has no value");
    }
#else
    (void)event;
#endif
#if SWITCHES
    faster = misses(s, t, q, u, now, now + BODY_CONSTRAINTS);
    if (!(fastest - fastest == 0.0 && faster - faster == 0.0)) return say(s, FAILED, "a constraint has no value");
    for (i = 0; i < BODY_CONSTRAINTS; i++) {
        if (fabs(now[i] - was[i]) <= HELD) continue;
        s->constraint = i;
        return say(s, FAILED, "a motion that is prescribed jumps, and no position can");
    }
    fastest = 1e-9 * fmax(fastest, faster);
    for (i = BODY_CONSTRAINTS; i < 2 * BODY_CONSTRAINTS; i++) has_impact |= fabs(now[i] - was[i]) > fastest;
    if (has_impact) {
        double guess[COORDINATES + 1];
        const int code = struck(s, t, q, u);
        if (code == 1) return say(s, FAILED, "an impact, in which something has no value");
        if (code == 2) {
            s->leads = side_leads[s->side];
            s->hits = 1;
            if (s->leads == -1) {
                return say(s, FAILED, "an impact, in which a constraint would have to act against its one side");
            }
            log_event(s, t, side_sources[s->side], scene_EVENT, 0.0);
            return s->leads >= 0 ? CHANGES : say(s, STOPPED, "an impact, which ends the motion");
        }
        for (i = BODY_CONSTRAINTS; i < 2 * BODY_CONSTRAINTS; i++) {
            const int law = body_laws[i - BODY_CONSTRAINTS];
            if (fabs(now[i] - was[i]) > fastest && law != told) log_event(s, t, told = law, scene_IMPACT, 0.0);
        }
        for (i = 0; i < COORDINATES; i++) guess[i] = s->state[i];
        if (state_of(s, t, guess, q, u, s->state) != READY) return FAILED;
    }
#endif
    return AGAIN;
}

/* Begin at a state, taken onto the constraints, whatever gaps and slips do. */
static int begin_mode(scene *s, double t)
{
    int i;
    normalize(s->y);
#if PROJECTS
    if (project(t, s->y, s->block + 2) != 0) return say(s, FAILED, "the constraints cannot be met near this state");
#endif
    if (begin(s->session, t, s->y) != 0) return say(s, FAILED, "the equations have no finite value");
#if WATCHED
    s->held_last = independence(s, t, s->y, &i);
    s->held_largest = size_of(s->held_last, s->held_largest);
#endif
    take(s, t, s->y);
    s->coming = INFINITY;
    s->searched = s->began = t;
    s->status = READY;
#if CONSTRAINTS
    s->constraint = missed(s, t, s->y);
    if (s->constraint >= 0) return say(s, FAILED, "a constraint does not hold with these values");
#endif
#if EVENTS
    if (listen(s, t) != 0) return say(s, FAILED, "an event has no value");
#endif
    (void)i;
    return READY;
}

#if EVENTS
/* What an event leads to. */
static int happen(scene *s, int i)
{
    s->event = i;
    s->event_time = s->time;
#if CONTACTS
    if (event_contact[i] >= 0) {
        int j;
        for (j = 0; j < EVENTS; j++) {
            if (event_contact[j] >= 0 && (j == i || s->fired[j])) s->triggers[event_contact[j]] = event_code[j];
        }
        memset(s->fired, 0, sizeof s->fired);
        return AGAIN;
    }
#endif
    log_event(s, s->time, i, scene_EVENT, 0.0);
    if (event_action[i] == ENDS) return say(s, STOPPED, event_messages[i]);
    if (event_action[i] == UPDATES_STATES) return alter(s, s->time, i);
    if (event_action[i] != LEADS) return say(s, READY, "");
    s->leads = event_leads[i];
    s->hits = event_impact[i];
    return CHANGES;
}
#endif

/* Begin at a state, and go on with what happens there until nothing more does. */
static int begin_at(scene *s, double t, const double *state, int is_start)
{
    int i, turn;
    for (i = 0; i < SIZE; i++) s->state[i] = state[i];
    s->time = t;
    for (turn = 0;; turn++) {
        in_piece(s, t);
        s->is_evaluated = 0;
#if UPDATES
        if (is_start && !sample(s, t)) return say(s, FAILED, "an update has no value");
#endif
        for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
#if CONTACTS
        {
            const int status = resolve_contacts(s, t, is_start);
            if (status == STOPPED) take(s, t, s->y);
            if (status != READY) return status;
        }
#endif
#if SIDES
        for (i = 0; i < SIZE; i++) s->state[i] = s->y[i].f;
        if (!take_sides_from(s, t)) return say(s, FAILED, "the motion stays where a law switches, which C does not follow");
        for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
#endif
        if (begin_mode(s, t) != READY) return FAILED;
        (void)is_start;
        is_start = 0;
#if EVENTS
        for (i = 0; i < EVENTS; i++) {
            if (s->fired[i]) return say(s, READY, "");
        }
        i = broken(s);
        if (i >= 0) {
            const int status = happen(s, i);
            if (status != AGAIN) return status;
            if (turn > 1000) return say(s, FAILED, "it changes without end");
            continue;
        }
#endif
        return say(s, READY, "");
    }
}

static int begin_again(scene *s, int status)
{
    if (status == AGAIN) {
        s->changes = s->time - s->changed <= 1e-9 * horizon ? s->changes + 1 : 0;
        s->changed = s->time;
        if (s->changes > 10000) return say(s, FAILED, "it changes without end");
        return begin_at(s, s->time, s->state, 0);
    }
    return status;
}

/* Go over what comes. */
static int pass(scene *s)
{
    if (s->coming_kind == FAILED) {
        s->time = s->coming;
        return say(s, FAILED, "an event has no value");
    }
#if WATCHED
    if (s->coming_kind == AT_SINGULARITY) {
        if (at(s, s->coming) == 0) take(s, s->coming, s->y);
        return say(s, AT_SINGULARITY, "the position is singular: a constraint follows from the others");
    }
#endif
#if EVENTS
    {
        int i, leads = -1, passes = 0;
        take(s, s->coming, s->event_y);
        for (i = 0; i < EVENTS; i++) {
            if (s->fired[i] && event_action[i] != NOTED && event_action[i] != PASSES && leads < 0) leads = i;
        }
#if SIDES
        for (i = 0; i < EVENTS; i++) {
            if (!s->fired[i] || event_side[i] < 0) continue;
            s->passed_sides[event_side[i]] = passes = 1;
        }
#endif
        for (i = 0; i < EVENTS; i++) {
            if (s->fired[i] && event_action[i] == NOTED) happen(s, i);
        }
        if (leads >= 0) return begin_again(s, happen(s, leads));
        if (passes) {
            memset(s->fired, 0, sizeof s->fired);
            return begin_again(s, AGAIN);
        }
        watch(s);
    }
#endif
    return READY;
}

void scene_default(scene *s)
{
    int i;
    memset(s, 0, sizeof *s);
    s->rtol = 1e-8;
    s->is_new = 1;
    for (i = 0; i < VALUES; i++) s->values[i].f = values[i];
    for (i = 0; i < SIZE; i++) s->state[i] = start_state[i];
    s->time = scene_start_time;
}

int scene_begin(scene *s)
{
    word *f = s->session;
    int i;
    link_memory(s);
    f[FIELD_size].i = SIZE;
    f[FIELD_padded].i = PADDED;
    f[FIELD_horizon].f = horizon;
    f[FIELD_relative].f = s->rtol * relative_share > 1e-15 ? s->rtol * relative_share : 1e-15;
    f[FIELD_longest].f = s->step > 0.0 ? s->step : s->longest > 0.0 ? s->longest : INFINITY;
    f[FIELD_first].f = s->step > 0.0 ? s->step : 0.0;
    for (i = 0; i < PADDED; i++) {
        const double atol = s->atol > 0.0 ? s->atol : s->rtol;
        const double allowed = i < SIZE ? atol * tolerances[i] : 1.0;
        s->arrays[ROW_absolute * PADDED + i].f = s->step > 0.0 ? 1e300 : allowed;
    }
#if CONSTRAINTS
    s->held_size = 0.0;
#endif
#if WATCHED
    s->held_largest = 0.0;
    for (i = 0; i < KEPT; i++) s->held_most[i] = 0.0;
#endif
#if EVENTS
    memset(s->fired, 0, sizeof s->fired);
    s->sought[SOUGHT_size].i = SIZE;
    s->sought[SOUGHT_count].i = EVENTS;
    s->sought[SOUGHT_moment].f = 100.0 * ROUNDING * horizon;
    s->sought[SOUGHT_fired_at].f = (double)NAN;
    for (i = 0; i < SIZE; i++) {
        s->turns[i].f = turns[i];
        s->turns[SIZE + i].f = turns[SIZE + i];
    }
#endif
#if CONTACTS
    s->sets[SET_count].i = CONTACTS;
    s->sets[SET_size].i = CONTACT_ROWS;
    s->sets[SET_entries].i = PATTERN;
    s->sets[SET_coordinates].i = COORDINATES;
    s->sets[SET_speeds].i = SPEEDS;
    for (i = 0; i < 2 * PATTERN; i++) s->pattern[i].f = contact_pattern[i];
#endif
    i = s->is_new;
    s->is_new = 0;
    if (i) s->happened = 0;
#if STARTS
    if (i && find_start(s) != READY) return FAILED;
#endif
    s->changes = 0;
    return begin_at(s, s->time, s->state, i);
}

int scene_advance(scene *s, double target)
{
    word *f = s->session;
    if (s->status == FAILED || s->status == AT_SINGULARITY || s->status == STOPPED) return s->status;
    if (!(target - target == 0.0)) return say(s, FAILED, "there is no such time to go to");
    if (target < s->time) return say(s, FAILED, "the time to go to has passed");
    for (;;) {
        const double edge = next_piece(s), here = fmin(s->coming, edge);
        /* what is at the target but for rounding is at it */
        const double until = here == edge ? target + 16.0 * ROUNDING * fabs(target) : target;
        if (here <= until && here <= f[FIELD_t].f) {
            int status;
            if (s->coming <= edge) {
                status = pass(s);
            } else {
                if (edge == known_until) return say(s, STOPPED, "it is not known how its functions of time go on");
                if (at(s, edge) != 0) return say(s, FAILED, "the equations have no value within a step");
                take(s, edge, s->y);
#if EVENTS
                memset(s->fired, 0, sizeof s->fired);
#endif
                status = begin_again(s, alter(s, edge, -1));
            }
            if (status != READY) return status;
            continue;
        }
        if (f[FIELD_t].f >= until) break;
        if (strays(row(s, ROW_y))) {
            int i;
            for (i = 0; i < SIZE; i++) s->y[i] = row(s, ROW_y)[i];
            begin_mode(s, f[FIELD_t].f);
        }
        f[FIELD_limit].i = f[FIELD_steps].i + 1;
        f[FIELD_stop].f = INFINITY;
        if (run(s->session) == 2) {
            if (at(s, f[FIELD_t].f) == 0) take(s, f[FIELD_t].f, s->y);
            return say(s, FAILED, "no step is short enough: something has no value, or changes too fast");
        }
        watch(s);
    }
    if (at(s, target) != 0) return say(s, FAILED, "the equations have no value within a step");
    take(s, target, s->y);
    return say(s, READY, "");
}

int scene_evaluate(scene *s, double *quantities)
{
    int i;
    if (!s->is_evaluated) {
        for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
        if (rates(s->time, s->y, s->yp, s->block) != 0) return say(s, FAILED, "the equations have no finite value");
        call_quantities(s, s->time, s->y, s->yp + COORDINATES); /* one without a value is no number */
#if LOADS
        call_loads(s, s->time, s->y, s->yp + COORDINATES);
#endif
        s->is_evaluated = 1;
    }
    for (i = 0; i < PLAIN; i++) quantities[i] = s->quantities_0[i].f;
#if LOADS
    for (i = 0; i < LOADS; i++) quantities[PLAIN + i] = s->loads_0[i].f;
#endif
    return READY;
}

int scene_rates(scene *s, double *rates_of_state)
{
    int i;
    for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
    if (rates(s->time, s->y, s->yp, s->block) != 0) return say(s, FAILED, "the equations have no finite value");
    for (i = 0; i < SIZE; i++) rates_of_state[i] = s->yp[i].f;
    return READY;
}

void scene_energies(scene *s, double *kinetic, double *potential)
{
    *kinetic = s->quantities_1[0].f;
    *potential = s->quantities_1[1].f;
}

double scene_parameter(const scene *s, int number)
{
    return s->values[parameter_places[number]].f;
}

int scene_set_parameter(scene *s, int number, double value)
{
    if (!(value - value == 0.0 && scene_parameters[number].low <= value && value <= scene_parameters[number].high)) {
        return say(s, REFUSED, "a parameter cannot have this value");
    }
    if (parameter_places[number] >= 0) s->values[parameter_places[number]].f = value; /* a mode may not have it */
    s->is_evaluated = 0;
    return READY;
}

void scene_copy(scene *target, const scene *source)
{
    memmove(target, source, sizeof *target);
    link_memory(target);
}
