/* What both versions of the interface do: an instance, its variables by value reference, steps and events. */
#include "scene.c"

#include <stdlib.h>

/* inputs */

#if MODES
static void link_memory(scene *s)
{
    refresh_links(s);
}

static void in_piece(scene *s, double t)
{
    refresh(s, t);
}

static void fill(scene *s)
{
    refresh(s, s->time);
}
#endif

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

/* Value references: the time, states, their rates, parameters and inputs, quantities. */
#define RATE_OF (1 + SIZE)
#define PARAMETER (1 + 2 * SIZE)
#define QUANTITY (PARAMETER + scene_PARAMETERS)
#define REFERENCES (QUANTITY + scene_QUANTITIES) /* and after them what events watch */

typedef void tell(void *environment, const char *name, int status, const char *text);

typedef struct {
    scene s;
    double quantities[scene_QUANTITIES + 1];
    double rates[SIZE];
    int is_model_exchange, is_new, is_read, is_changed, happened;
    /* Of the one who made it; what is copied between instances leaves these as they are. */
    char name[64];
    tell *tell;
    void *environment;
    void (*log)(void);
} instance;

static void reset_instance(instance *o)
{
    scene_default(&o->s);
    link_memory(&o->s);
    in_piece(&o->s, o->s.time);
    o->is_new = 1;
    o->is_read = o->is_changed = o->happened = 0;
}

static instance *make_instance(int is_model_exchange, const char *name, tell *told, void *environment, void (*log)(void))
{
    instance *o = (instance *)calloc(1, sizeof(instance));
    if (o == NULL) return NULL;
    o->is_model_exchange = is_model_exchange;
    if (name != NULL) strncpy(o->name, name, sizeof o->name - 1);
    o->tell = told;
    o->environment = environment;
    o->log = log;
    reset_instance(o);
    return o;
}

static int tell_failure(instance *o, const char *text)
{
    if (o->log != NULL) o->tell(o, o->name, 3, text);
    return 0;
}

static void copy_instance(instance *target, const instance *source)
{
    const instance own = *target;
    *target = *source;
    memcpy(target->name, own.name, sizeof target->name);
    target->tell = own.tell;
    target->environment = own.environment;
    target->log = own.log;
    link_memory(&target->s);
}

/* Bytes that another process wrote have its addresses. */
static void forget_addresses(instance *o)
{
    link_memory(&o->s);
    o->s.text = "";
    o->tell = NULL;
    o->environment = NULL;
    o->log = NULL;
}

/* Read rates and quantities at the time and state there are. */
static int read_values(instance *o)
{
    if (o->is_read) return 1;
    if (o->is_changed) fill(&o->s);
    if (scene_rates(&o->s, o->rates) != READY) return tell_failure(o, o->s.text);
    o->s.is_evaluated = 0;
    if (scene_evaluate(&o->s, o->quantities) != READY) return tell_failure(o, o->s.text);
    o->is_read = 1;
    return 1;
}

static int indicators(instance *o, double *values)
{
#if EVENTS
    word y[SIZE], found[EVENTS], kept[EVENTS];
    int i, code;
    if (o->is_changed) fill(&o->s);
    for (i = 0; i < SIZE; i++) y[i].f = o->s.state[i];
    memcpy(kept, o->s.shifts, sizeof kept); /* of a co-simulation, which goes on with them */
    memset(o->s.shifts, 0, sizeof o->s.shifts);
    o->s.self[0].p = (word *)(void *)&o->s;
    code = events_at(o->s.time, y, NULL, found, o->s.self);
    memcpy(o->s.shifts, kept, sizeof kept);
    if (code != 0) return tell_failure(o, "an event has no value");
    for (i = 0; i < EVENTS; i++) values[i] = found[i].f;
#else
    (void)o;
    (void)values;
#endif
    return 1;
}

static int get_values(instance *o, size_t count, const unsigned *references, double *values)
{
    size_t k;
    for (k = 0; k < count; k++) {
        const unsigned r = references[k];
        if (r >= REFERENCES + EVENTS) return tell_failure(o, "there is no variable with this value reference");
        if (r >= REFERENCES) {
            double found[EVENTS + 1];
            if (!indicators(o, found)) return 0;
            values[k] = found[r - REFERENCES];
            continue;
        }
        if ((r >= RATE_OF && r < PARAMETER) || r >= QUANTITY) {
            if (!read_values(o)) return 0;
        }
        values[k] = r == 0 ? o->s.time : r < RATE_OF ? o->s.state[r - 1] : r < PARAMETER ? o->rates[r - RATE_OF]
                  : r < QUANTITY ? scene_parameter(&o->s, (int)(r - PARAMETER)) : o->quantities[r - QUANTITY];
    }
    return 1;
}

static int set_values(instance *o, size_t count, const unsigned *references, const double *values)
{
    size_t k;
    for (k = 0; k < count; k++) {
        const unsigned r = references[k];
        if (!(values[k] - values[k] == 0.0)) return tell_failure(o, "a value that is set must be a finite number");
        if (r >= 1 && r < RATE_OF) {
            o->s.state[r - 1] = values[k];
        } else if (r >= PARAMETER && r < QUANTITY) {
            const int number = (int)(r - PARAMETER);
            if (scene_parameter(&o->s, number) == values[k]) continue;
            if (scene_set_parameter(&o->s, number, values[k]) != READY) return tell_failure(o, o->s.text);
        } else {
            return tell_failure(o, "this variable cannot be set");
        }
        o->is_read = 0;
        o->is_changed = 1;
    }
    return 1;
}

static void take_time(instance *o, double time)
{
    o->s.time = time;
    o->is_read = 0;
}

static int set_up(instance *o, int has_tolerance, double tolerance, double start)
{
    if (!(start - start == 0.0)) return tell_failure(o, "the time of the start must be a finite number");
    if (has_tolerance && tolerance > 0.0) o->s.rtol = tolerance;
    take_time(o, start);
    o->s.began = start;
    in_piece(&o->s, start);
    return 1;
}

/* Begin the motion after the start values are known. */
static int begin_motion(instance *o)
{
    int status;
    o->is_new = 0;
    if (o->is_model_exchange) {
#if STARTS
        if (find_start(&o->s) != READY) return tell_failure(o, o->s.text);
#endif
        in_piece(&o->s, o->s.time);
#if UPDATES
        if (!sample(&o->s, o->s.time)) return tell_failure(o, "an update has no value");
#endif
        o->s.began = o->s.time;
        o->is_read = 0;
        return 1;
    }
    status = scene_begin(&o->s);
    o->is_read = o->is_changed = 0;
    return status == READY || status == STOPPED ? 1 : tell_failure(o, o->s.text);
}

/* Go to a time; 2 where the motion ends before. */
static int step_to(instance *o, double time)
{
    int status = READY;
    if (o->is_changed) {
        o->is_changed = 0;
        if (o->s.status == READY) status = begin_at(&o->s, o->s.time, o->s.state, 0);
    }
    if (status == READY) status = scene_advance(&o->s, time);
    o->is_read = 0;
    if (status == STOPPED) return 2;
    return status == READY ? 1 : tell_failure(o, o->s.text);
}

#if EXCHANGES
/* What an event makes of a state: whether the motion ends, and whether coordinates were made of length one again. */
static int update_discrete(instance *o, int *ends, int *changes, int *is_next, double *next)
{
    const double time = o->s.time, rounding = 16.0 * ROUNDING * fabs(time);
    int i;
    word y[SIZE];
    *ends = time >= known_until;
    *changes = 0;
    while ((*next = next_piece(&o->s)) <= time + rounding && *next < known_until) {
        if (alter(&o->s, *next, -1) != AGAIN) return tell_failure(o, o->s.text);
        o->s.began = *next;
        *changes = 1;
    }
    take_time(o, time);
    if (time > o->s.began) o->s.began = time;
#if EVENTS
    {
        double values[EVENTS];
        if (!indicators(o, values)) return 0;
        for (i = 0; i < EVENTS; i++) {
            if (event_action[i] == ENDS && event_direction[i] * values[i] > event_small[i] * o->s.rtol) *ends = 1;
        }
    }
#endif
    for (i = 0; i < SIZE; i++) y[i].f = o->s.state[i];
    normalize(y);
    for (i = 0; i < SIZE; i++) {
        if (fabs(y[i].f - o->s.state[i]) > 1e-12) *changes = 1;
    }
    for (i = 0; *changes && i < SIZE; i++) o->s.state[i] = y[i].f;
    *next = next_piece(&o->s);
    *is_next = *next < INFINITY;
    o->is_read = 0;
    return 1;
}

/* Whether coordinates of an orientation are far from length one, after which an event makes them so. */
static int wants_event(const instance *o)
{
#if TURNS
    int i, k;
    for (i = 0; i < TURNS; i++) {
        double sum = 0.0;
        for (k = turn_starts[i]; k < turn_starts[i + 1]; k++) {
            const double x = o->s.state[turn_places[k]];
            sum += x * x;
        }
        if (!(fabs(sum - 1.0) < 1e-3)) return 1;
    }
#else
    (void)o;
#endif
    return 0;
}

/* Derivatives of rates and quantities along a direction of states and inputs. */
static int directional(instance *o, const double *seed, double *rates_along, double *quantities_along)
{
    word t, y[SIZE], yp[SIZE], dy[SIZE], dyp[SIZE], dp[INPUTS + 1], dx[scene_QUANTITIES + 1], in[7], out[2];
    int i;
    if (o->is_changed) fill(&o->s);
    t.f = o->s.time;
    for (i = 0; i < SIZE; i++) {
        y[i].f = o->s.state[i];
        dy[i].f = seed[i];
    }
    for (i = 0; i < INPUTS; i++) dp[i].f = seed[SIZE + i];
    if (rates(t.f, y, yp, o->s.block) != 0) return tell_failure(o, "the equations have no finite value");
    rates_tangent_prologue(o->s.values, o->s.rates_tangent_derived, o->s.scratch);
    quantities_tangent_prologue(o->s.values, o->s.quantities_tangent_derived, o->s.scratch);
    in[0].p = &t;
    in[1].p = y;
    in[2].p = y + COORDINATES;
    in[3].p = dy;
    in[4].p = dp;
    out[0].p = dyp;
    rates_tangent(in, o->s.rates_tangent_derived, o->s.scratch, out);
    in[3].p = yp + COORDINATES;
    in[4].p = dy;
    in[5].p = dyp + COORDINATES;
    in[6].p = dp;
    out[0].p = dx;
    quantities_tangent(in, o->s.quantities_tangent_derived, o->s.scratch, out);
    for (i = 0; i < SIZE; i++) rates_along[i] = dyp[i].f;
    for (i = 0; i < scene_QUANTITIES; i++) quantities_along[i] = dx[i].f;
    return 1;
}

/* The place of a state or an input in a direction; -1 for what is neither. */
static int place_in_seed(unsigned r)
{
    int i;
    if (r >= 1 && r < RATE_OF) return (int)r - 1;
    for (i = 0; i < INPUTS; i++) {
        if (r == PARAMETER + (unsigned)input_numbers[i]) return SIZE + i;
    }
    return -1;
}

static double along(unsigned r, const double *seed, const double *rates_along, const double *quantities_along)
{
    return r >= QUANTITY ? quantities_along[r - QUANTITY] : r >= RATE_OF && r < PARAMETER ? rates_along[r - RATE_OF]
         : seed[r - 1];
}

static int is_unknown(unsigned r)
{
    return (r >= 1 && r < PARAMETER) || (r >= QUANTITY && r < REFERENCES);
}

static int derivatives(instance *o, const unsigned *unknowns, size_t n, const unsigned *knowns, size_t m,
                       const double *seed, double *found)
{
    double direction[SIZE + INPUTS + 1], of_rates[SIZE], of_quantities[scene_QUANTITIES + 1];
    size_t k;
    memset(direction, 0, sizeof direction);
    for (k = 0; k < m; k++) {
        const int place = place_in_seed(knowns[k]);
        if (place < 0) return tell_failure(o, "derivatives are along states and inputs");
        direction[place] += seed[k];
    }
    for (k = 0; k < n; k++) {
        if (!is_unknown(unknowns[k])) return tell_failure(o, "derivatives are those of rates and quantities");
    }
    if (!directional(o, direction, of_rates, of_quantities)) return 0;
    for (k = 0; k < n; k++) found[k] = along(unknowns[k], direction, of_rates, of_quantities);
    return 1;
}

static void take_nominals(double *x)
{
    int i;
    for (i = 0; i < SIZE; i++) x[i] = tolerances[i] > 0.0 ? tolerances[i] : 1.0;
}
#else
/* A unit for co-simulation alone has no such functions. */
static int update_discrete(instance *o, int *ends, int *changes, int *is_next, double *next)
{
    (void)o; (void)next;
    *ends = *changes = *is_next = 0;
    return 0;
}

static int wants_event(const instance *o)
{
    (void)o;
    return 0;
}

static int derivatives(instance *o, const unsigned *unknowns, size_t n, const unsigned *knowns, size_t m,
                       const double *seed, double *found)
{
    (void)o; (void)unknowns; (void)n; (void)knowns; (void)m; (void)seed; (void)found;
    return 0;
}

static void take_nominals(double *x)
{
    (void)x;
}
#endif
