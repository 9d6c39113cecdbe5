/* Gaps and slips: which hold from a moment on, and margins of the events that tell when this changes. */

static word *unit(scene *s, int name)
{
    return s->units + CONTACTS * name;
}

static int is_slip(int k)
{
    return contact_units[UNIT_slip * CONTACTS + k] != 0.0;
}

/* States and directions are parameters of all programs. */
static void take_states(scene *s, const double *states)
{
    int i;
    for (i = 0; i < 3 * CONTACTS; i++) {
        if (contact_places[i] >= 0) s->values[contact_places[i]].f = states[i];
    }
    fill(s);
}

static void remember_impact(scene *s, double t, double part)
{
    if (s->sets[SET_known].i == PAST) {
        memmove(s->impacts, s->impacts + 2, sizeof(word) * 2 * (PAST - 1));
        s->sets[SET_known].i--;
    }
    s->impacts[2 * s->sets[SET_known].i].f = t;
    s->impacts[2 * s->sets[SET_known].i + 1].f = part;
    s->sets[SET_known].i++;
}

/* Say what has become of a gap that has names of its own for it, with the speed of an impact if there was one; these
 * take the place of what is told of any gap.  Returns whether the motion ends there. */
static int tell_named(scene *s, double t, int k, int was, int is, const double *speed, int is_start)
{
    const int source = EVENTS + k, closes = contact_names[2 * k], opens = contact_names[2 * k + 1];
    const int leaves = !is && (was || speed != NULL);
    if (speed != NULL) log_event(s, t, was || closes < 0 ? source : closes, scene_IMPACT, *speed);
    if (!was && is && !is_start && (closes < 0 || speed == NULL)) {
        log_event(s, t, closes < 0 ? source : closes, scene_CLOSES, 0.0);
    }
    if (leaves && opens >= 0) log_event(s, t, opens, scene_OPENS, 0.0);
    if (was && !is && opens < 0 && !is_start) log_event(s, t, source, scene_OPENS, 0.0);
    return leaves && contact_ends[k][0] != 0;
}

static int is_named(int k)
{
    return contact_names[2 * k] >= 0 || contact_names[2 * k + 1] >= 0;
}

/* Say what has become of a gap or a slip. */
static void tell_change(scene *s, double t, int k, const double *was, const double *is)
{
    const int source = EVENTS + k;
    if (!is_slip(k)) {
        if (is[0] != was[0]) log_event(s, t, source, is[0] != 0.0 ? scene_CLOSES : scene_OPENS, 0.0);
    } else if (is[0] == 1.0 && was[0] == 1.0) {
        if (is[1] * was[1] + is[2] * was[2] < 0.0) log_event(s, t, source, scene_REVERSES, 0.0);
    } else if (is[0] != 0.0 && is[0] != was[0]) {
        log_event(s, t, source, is[0] == 2.0 ? scene_STICKS : scene_SLIPS, 0.0);
    }
}

/* States of gaps and slips after a moment, three numbers for each. */
static void states_after(scene *s, double *after)
{
    int k;
    for (k = 0; k < CONTACTS; k++) {
        const double next = unit(s, UNIT_next)[k].f;
        after[3 * k] = is_slip(k) ? next : 0.5 * next;
        after[3 * k + 1] = contact_places[3 * k + 1] >= 0 ? unit(s, UNIT_next_x)[k].f : 0.0;
        after[3 * k + 2] = contact_places[3 * k + 2] >= 0 ? unit(s, UNIT_next_y)[k].f : 0.0;
    }
}

/* Whether a force that is reported contradicts the states that are taken: how joints share it the routine does not know. */
static int contradicts(scene *s, double t)
{
    word values[EVENTS], kept[EVENTS];
    int i, found = 0;
    memcpy(kept, s->shifts, sizeof kept);
    memset(s->shifts, 0, sizeof s->shifts);
    if (events_at(t, s->y, NULL, values, s->self) == 0) {
        for (i = 0; i < EVENTS; i++) {
            if (event_contact[i] < 0 || (event_code[i] != OPENS && event_code[i] != YIELDS)) continue;
            found |= event_direction[i] * values[i].f > 0.9 * event_small[i] * s->rtol;
        }
    }
    memcpy(s->shifts, kept, sizeof kept);
    return found;
}

/* Find the set of a moment; where nothing determines how forces are shared, one whose forces contradict nothing. */
static int32_t find_set(scene *s, double t, const double *before, int is_start)
{
    const double near = 10.0 * (s->rtol > 1e-13 ? s->rtol : 1e-13), ahead = 10.0 * sqrt(s->rtol) * time_scale;
    const double bounce = 1.1920928955078125e-7 * time_scale; /* two that rounding makes */
    double after[3 * CONTACTS];
    word speeds[SPEEDS];
    int32_t code;
    int i, k, tried;
    for (i = 0; i < SPEEDS; i++) speeds[i] = s->y[COORDINATES + i];
    for (tried = 0;; tried++) {
        for (i = 0; i < UNITS * CONTACTS; i++) s->units[i].f = contact_units[i];
        for (k = 0; k < CONTACTS; k++) {
            unit(s, UNIT_small)[k].f *= near;
            unit(s, UNIT_slow)[k].f *= near;
            unit(s, UNIT_trigger)[k].f = s->triggers[k];
            unit(s, UNIT_state)[k].f = is_slip(k) ? before[3 * k] : 2.0 * before[3 * k];
            unit(s, UNIT_state_x)[k].f = before[3 * k + 1];
            unit(s, UNIT_state_y)[k].f = before[3 * k + 2];
        }
        s->sets[SET_inside].f = is_start || HELD / near < 1.0 ? 1.0 : HELD / near;
        s->sets[SET_ahead].f = ahead;
        s->sets[SET_rough].f = ahead > 0.01 * time_scale ? ahead : 0.01 * time_scale;
        s->sets[SET_later].f = 0.001 * ahead > bounce ? 0.001 * ahead : bounce;
        s->sets[SET_tried].i = tried;
        code = resolve(s->sets, t, 1, 1);
        if ((code != 0 && (code != UNDETERMINED || tried > 0)) || tried == 500) return code != 0 ? code : UNDETERMINED;
        if (code == 0) {
            if (s->sets[SET_shared].i == 0 || s->sets[SET_tried].i != 0) return code;
            states_after(s, after);
            take_states(s, after);
            if (!contradicts(s, t)) return code;
        }
        take_states(s, before);
        for (i = 0; i < SPEEDS; i++) s->y[COORDINATES + i] = speeds[i];
    }
}

/* What becomes of gaps and slips at a moment and in a state, which are in s; s->triggers says what has happened. */
static int resolve_contacts(scene *s, double t, int is_start)
{
    double before[3 * CONTACTS], after[3 * CONTACTS], closed[3 * CONTACTS], speeds[SPEEDS], approach[CONTACTS];
    const double *struck[CONTACTS];
    int32_t code;
    int i, k, meets = 0, ends = -1;
    for (i = 0; i < 3 * CONTACTS; i++) before[i] = contact_places[i] >= 0 ? s->values[contact_places[i]].f : 0.0;
    if (is_start) s->sets[SET_known].i = 0;
    code = find_set(s, t, before, is_start);
    for (k = 0; k < CONTACTS; k++) s->triggers[k] = 0.0;
    if (code != 0) return say(s, FAILED, refused[code]);
    k = s->sets[SET_told].i;
    if (s->sets[SET_stops].i != 0 && !is_start && contact_names[2 * k] < 0)
        log_event(s, t + s->sets[SET_ahead].f, EVENTS + k, scene_RESTS, 0.0);
    for (k = 0; k < CONTACTS; k++) struck[k] = NULL;
    states_after(s, after);
    for (i = 0; i < s->sets[SET_logged].i; i++) {
        const word *const entry = s->log_of_sets + i * (CONTACT_ROWS + ENTRY);
        k = (int)entry[0].f;
        if (!is_named(k)) {
            log_event(s, t, EVENTS + k, scene_IMPACT, -entry[1].f);
        } else if (struck[k] == NULL) {
            approach[k] = -entry[1].f;
            struck[k] = approach + k;
        }
        remember_impact(s, t, contact_units[UNIT_part * CONTACTS + k]);
    }
    for (k = 0; k < CONTACTS; k++) {
        const double touches = unit(s, UNIT_closed)[k].f;
        closed[3 * k] = closed[3 * k + 1] = closed[3 * k + 2] = touches;
        if (touches == 1.0) meets = !is_start;
    }
    if (meets) { /* what is found to be closed is so to rounding */
        for (i = 0; i < SPEEDS; i++) speeds[i] = s->y[COORDINATES + i].f;
        take_states(s, closed);
#if PROJECTS
        if (project(t, s->y, s->block + 2) != 0) return say(s, FAILED, "what touches cannot be met near this state");
#endif
        for (i = 0; i < SPEEDS; i++) s->y[COORDINATES + i].f = speeds[i];
    }
    take_states(s, after);
    for (k = 0; k < CONTACTS; k++) {
        const int was = before[3 * k] != 0.0 || (is_start && contact_starts_closed[k]);
        if (is_named(k)) {
            if (tell_named(s, t, k, was, after[3 * k] != 0.0, struck[k], is_start) && ends < 0) ends = k;
        } else if (!is_start) {
            tell_change(s, t, k, before + 3 * k, after + 3 * k);
        }
    }
    return ends < 0 ? READY : say(s, STOPPED, contact_ends[ends]);
}

/* The values of events a moment later. */
static void soon(scene *s, double t, word *target)
{
    const double moment = 1e-12 * time_scale;
    word there[SIZE], kept[EVENTS];
    int i;
    rates(t, s->y, s->yp, s->block);
    for (i = 0; i < SIZE; i++) there[i].f = s->y[i].f + moment * s->yp[i].f;
    memcpy(kept, s->shifts, sizeof kept);
    memset(s->shifts, 0, sizeof s->shifts);
    events_at(t + moment, there, NULL, target, s->self);
    memcpy(s->shifts, kept, sizeof kept);
}

/* Margins of gaps and slips at a start, and which events these keep from having happened there. */
static void arm(scene *s, double t)
{
    const int has_rates = call_contacts(s, t, s->y, NULL) == 0;
    word later[EVENTS];
    int i, is_read = 0;
    for (i = 0; i < EVENTS; i++) {
        const double small = event_small[i] * s->rtol, now = s->event_y[i].f, size = fabs(now);
        const int k = event_contact[i];
        s->calm[i] = 0;
        if (k < 0) continue;
        s->rows[EVENTS * SEARCHED_given + i].f = 1.0; /* what a state watches is positive in it, if less than rounding */
        if (event_watch[i] == WATCH_GAP) {
            const double rate = s->contacts_0[CONTACT_ROWS + (int)contact_units[UNIT_first * CONTACTS + k]].f;
            s->calm[i] = has_rates && size <= small && rate * time_scale > small;
            if (s->calm[i]) s->shifts[i].f = now > 0.0 ? 0.0 : 2.0 * size + 1e-300;
        } else if (event_watch[i] == WATCH_REST || event_watch[i] == WATCH_RUN) {
            int runs = size > 1000.0 * small;
            if (size > small && !runs) { /* several come to rest together, and one of them is first */
                if (!is_read) soon(s, t, later);
                is_read = 1;
                runs = fabs(later[i].f) < size;
            }
            s->shifts[i].f = runs == (event_watch[i] == WATCH_RUN) ? 2.0 * size + 2.0 : runs ? -small : 1000.0 * small;
            s->calm[i] = 1;
        }
    }
}
