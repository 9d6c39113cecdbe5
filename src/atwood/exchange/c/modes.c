/* A scene with modes: each has a source of its own, and what is asked goes to the mode that the scene is in. */
#include "scene.h"

#include <math.h>
#include <string.h>

enum { READY = scene_READY, STOPPED = scene_STOPPED, FAILED = scene_FAILED, REFUSED = scene_REFUSED };
enum { BEGIN, GO_ON, EVALUATE, RATES };

#define SIZE scene_STATES
#define EVENTS 0
#define CHANGES (-2) /* a mode ends, and another one begins */

/* tables */
static int say(scene *s, int status, const char *text)
{
    s->status = status;
    s->text = text;
    return status;
}

/* log */

/* modes */
static int ask(scene *s, int request, double t, double *values)
{
    switch (s->mode) {
    case KK: return ask_KK(s, request, t, values); /* each mode */
    default: return say(s, FAILED, "there is no such mode");
    }
}

static int change(scene *s)
{
    int has_impact, next = -1;
    switch (s->mode) {
    case KK: next = scene_modeKK_leads(&s->inKK, &has_impact); break; /* each mode */
    default: break;
    }
    switch (s->mode * MODES + next) {
    case AA * MODES + BB: return change_AA_BB(s); /* each change */
    default: return say(s, FAILED, "there is no such mode");
    }
}

static void refresh(scene *s, double t)
{
    scene_modeKK_refresh(&s->inKK, t); /* each mode */
}

static void refresh_links(scene *s)
{
    scene_modeKK_copy(&s->inKK, &s->inKK); /* each mode */
}

static void set_in_modes(scene *s, int number, double value)
{
    scene_modeKK_set_parameter(&s->inKK, number, value); /* each mode */
}

void scene_default(scene *s)
{
    memset(s, 0, sizeof *s);
    s->rtol = 1e-8;
    s->is_new = 1;
    s->time = scene_start_time;
    scene_modeKK_default(&s->inKK); /* each mode */
    memcpy(s->state, s->in0.state, sizeof s->in0.state);
}

double scene_parameter(const scene *s, int number)
{
    return scene_mode0_parameter(&s->in0, number);
}

void scene_energies(scene *s, double *kinetic, double *potential)
{
    switch (s->mode) {
    case KK: scene_modeKK_energies(&s->inKK, kinetic, potential); break; /* each mode */
    default: break;
    }
}

/* Go on through changes of the mode. */
static int settle(scene *s, int status)
{
    while (status == CHANGES) {
        s->changes = s->time - s->changed <= 1e-9 * fabs(scene_end_time - scene_start_time) ? s->changes + 1 : 0;
        s->changed = s->time;
        status = s->changes > 50 ? say(s, FAILED, "the mode changes without end") : change(s);
    }
    s->status = status;
    return status;
}

static int begin_at(scene *s, double t, const double *state, int is_start)
{
    s->time = t;
    s->is_new = is_start;
    memmove(s->state, state, sizeof s->state);
    return settle(s, ask(s, BEGIN, t, NULL));
}

int scene_begin(scene *s)
{
    const int is_start = s->is_new;
    if (is_start) s->happened = 0;
    s->changes = 0;
    refresh(s, s->time);
    return begin_at(s, s->time, s->state, is_start);
}

int scene_advance(scene *s, double time)
{
    int status;
    if (s->status == FAILED || s->status == scene_AT_SINGULARITY || s->status == STOPPED) return s->status;
    do {
        status = ask(s, GO_ON, time, NULL);
        if (status != CHANGES) return s->status = status;
        status = settle(s, status);
    } while (status == READY);
    return status;
}

int scene_evaluate(scene *s, double *quantities)
{
    return ask(s, EVALUATE, s->time, quantities);
}

int scene_rates(scene *s, double *rates)
{
    return ask(s, RATES, s->time, rates);
}

int scene_set_parameter(scene *s, int number, double value)
{
    const scene_parameter_of *const one = scene_parameters + number;
    if (!(value - value == 0.0 && one->low <= value && value <= one->high)) {
        return say(s, REFUSED, "a parameter cannot have this value");
    }
    set_in_modes(s, number, value);
    return READY;
}

void scene_copy(scene *target, const scene *source)
{
    memmove(target, source, sizeof *target);
    refresh_links(target);
}
