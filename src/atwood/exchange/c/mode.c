/* What a scene asks of one of its modes, beside a motion. */

/* The mode that what happened last leads to, and whether it comes with an impact. */
int scene_leads(const scene *s, int *has_impact)
{
    *has_impact = s->hits;
    return s->leads;
}

void scene_refresh(scene *s, double t)
{
    link_memory(s);
    in_piece(s, t);
    s->is_evaluated = 0;
}

/* Coordinates and speeds of all bodies, and values that are held. */
int scene_leave(scene *s, double *q, double *u, double *held)
{
    int i;
    for (i = 0; i < HELD_VALUES; i++) held[i] = s->values[held_places[i]].f;
    return bodies_of(s, s->time, s->state, q, u);
}

/* Go on from what another mode left, with a first guess of the coordinates. */
int scene_enter(scene *s, double t, const double *guess, const double *q, double *u, const double *held, int has_impact)
{
    int i, code;
    for (i = 0; i < HELD_VALUES; i++) s->values[held_places[i]].f = held[i];
    link_memory(s);
    in_piece(s, t);
    code = has_impact ? struck(s, t, q, u) : 0;
    if (code == 1) return say(s, FAILED, "an impact, in which something has no value");
    if (code == 2) return say(s, FAILED, "an impact, in which a constraint would have to act against its one side");
    if (state_of(s, t, guess, q, u, s->state) != READY) return FAILED;
    s->time = t;
    s->is_new = 0;
    return scene_begin(s);
}

/* Whether parts on a line are on the sides of each other that the equations were made for. */
int scene_is_sided(scene *s)
{
#if SIGNS
    int i, j;
    for (i = 0; i < SIZE; i++) s->y[i].f = s->state[i];
    call_places(s, s->time, s->y, NULL);
    for (i = 0; i < SIGNS; i++) {
        double apart = 0.0;
        for (j = 0; j < 3; j++) {
            apart += line_of_parts[j]
                * (s->places_1[3 * sign_places[2 * i + 1] + j].f - s->places_1[3 * sign_places[2 * i] + j].f);
        }
        if (!(apart * signs[i] >= -1e-9 * sizes[0])) return 0;
    }
#else
    (void)s;
#endif
    return 1;
}
