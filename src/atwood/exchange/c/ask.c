/* What is asked of mode KK; its events come after OFFSET of others. */
static void take_KK(scene *s, int status)
{
    const scene_modeKK *const m = &s->inKK;
    int k;
    s->time = m->time;
    memcpy(s->state, m->state, sizeof m->state);
    s->text = m->text;
    s->constraint = m->constraint;
    for (k = m->happened > scene_LOGGED ? m->happened - scene_LOGGED : 0; k < m->happened; k++) {
        const scene_modeKK_happening *const one = m->log + k % scene_LOGGED;
        log_event(s, one->time, OFFSET + one->source, one->kind, one->speed);
        s->event = OFFSET + m->event;
        s->event_time = m->event_time;
    }
    s->status = status;
}

static void give_KK(scene *s)
{
    scene_modeKK *const m = &s->inKK;
    m->rtol = s->rtol;
    m->atol = s->atol;
    m->longest = s->longest;
    m->step = s->step;
    m->happened = 0;
}

static int ask_KK(scene *s, int request, double t, double *values)
{
    scene_modeKK *const m = &s->inKK;
    int k, status;
    give_KK(s);
    if (m->time != s->time || memcmp(m->state, s->state, sizeof m->state) != 0) {
        m->time = s->time;
        memcpy(m->state, s->state, sizeof m->state);
        m->is_evaluated = 0;
    }
    if (request == BEGIN) {
        m->is_new = s->is_new;
        status = scene_modeKK_begin(m);
    } else if (request == GO_ON) {
        status = scene_modeKK_advance(m, t);
    } else if (request == RATES) {
        return scene_modeKK_rates(m, values);
    } else {
        status = scene_modeKK_evaluate(m, s->of_mode);
        for (k = 0; k < scene_QUANTITIES; k++) {
            values[k] = quantities_in_KK[k] >= 0 ? s->of_mode[quantities_in_KK[k]] : (double)NAN;
        }
        return status;
    }
    take_KK(s, status);
    return status;
}
