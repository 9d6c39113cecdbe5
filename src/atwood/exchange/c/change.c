/* From mode AA to mode BB. */
static int change_AA_BB(scene *s)
{
    scene_modeAA *const m = &s->inAA;
    scene_modeBB *const o = &s->inBB;
    double guess[scene_modeBB_COORDINATES + 1], q[BODIES], u[BODIES], held[HELD];
    int i, has_impact, status;
    scene_modeAA_leads(m, &has_impact);
    if (scene_modeAA_leave(m, q, u, held) != 0) return say(s, FAILED, "the bodies have no place");
    scene_modeAA_evaluate(m, s->of_mode);
    for (i = 0; i < scene_modeBB_COORDINATES; i++) {
        const int place = guess_AA_BB[i];
        guess[i] = place < 0 ? reference_AA_BB[i] : place < scene_modeAA_STATES ? m->state[place]
                 : s->of_mode[place - scene_modeAA_STATES];
    }
    s->mode = BB;
    give_BB(s);
    status = scene_modeBB_enter(o, m->time, guess, q, u, held, has_impact);
    take_BB(s, status);
    if (status == READY && !scene_modeBB_is_sided(o)) return say(s, FAILED, "parts have changed sides on their line");
    return status;
}
