/* The functions of FMI 2.0. */
#include "fmu.c"

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } status2;
typedef void *handle;
typedef unsigned reference;
typedef void logger2(void *environment, const char *name, status2 status, const char *category, const char *text, ...);
typedef struct {
    logger2 *logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, status2);
    void *environment;
} callbacks;

typedef struct {
    int again, ends, nominals, values, is_next;
    double next;
} event_info;

static void tell2(void *o, const char *name, int status, const char *text)
{
    const instance *own = (const instance *)o;
    ((logger2 *)own->log)(own->environment, name, (status2)status, "logStatusError", "%s", text);
}

static status2 done(int is_good)
{
    return is_good ? OK : ERROR;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT status2 fmi2SetDebugLogging(handle o, int is_on, size_t n, const char *const categories[])
{
    (void)o; (void)is_on; (void)n; (void)categories;
    return OK;
}

EXPORT handle fmi2Instantiate(const char *name, int kind, const char *token, const char *path, const callbacks *calls,
                              int is_visible, int logs)
{
    const char *why = NULL;
    logger2 *const log = calls != NULL ? calls->logger : NULL;
    (void)path; (void)is_visible; (void)logs;
    if (token == NULL || strcmp(token, TOKEN) != 0) why = "the guid is not that of this unit";
    if (!EXCHANGES && kind == 0) why = "it is for co-simulation alone: " ALONE;
    if (why != NULL) {
        if (log != NULL) log(calls->environment, name, ERROR, "logStatusError", "%s", why);
        return NULL;
    }
    return make_instance(kind == 0, name, tell2, calls != NULL ? calls->environment : NULL, (void (*)(void))log);
}

EXPORT void fmi2FreeInstance(handle o) { free(o); }

EXPORT status2 fmi2SetupExperiment(handle o, int has_tolerance, double tolerance, double start, int has_end, double end)
{
    (void)has_end; (void)end;
    return done(set_up((instance *)o, has_tolerance, tolerance, start));
}

EXPORT status2 fmi2EnterInitializationMode(handle o) { (void)o; return OK; }
EXPORT status2 fmi2ExitInitializationMode(handle o) { return done(begin_motion((instance *)o)); }
EXPORT status2 fmi2Terminate(handle o) { (void)o; return OK; }
EXPORT status2 fmi2Reset(handle o) { reset_instance((instance *)o); return OK; }

EXPORT status2 fmi2GetReal(handle o, const reference r[], size_t n, double values[])
{
    return done(get_values((instance *)o, n, r, values));
}

EXPORT status2 fmi2SetReal(handle o, const reference r[], size_t n, const double values[])
{
    return done(set_values((instance *)o, n, r, values));
}

/* There are no variables of other types. */
#define TYPE(NAME, KIND)                                                                                      \
    EXPORT status2 fmi2Get##NAME(handle o, const reference r[], size_t n, KIND values[])                      \
    {                                                                                                         \
        (void)o; (void)r; (void)values;                                                                       \
        return n == 0 ? OK : ERROR;                                                                           \
    }                                                                                                         \
    EXPORT status2 fmi2Set##NAME(handle o, const reference r[], size_t n, const KIND values[])                \
    {                                                                                                         \
        (void)o; (void)r; (void)values;                                                                       \
        return n == 0 ? OK : ERROR;                                                                           \
    }
typedef const char *text2;
TYPE(Integer, int)
TYPE(Boolean, int)
TYPE(String, text2)

EXPORT status2 fmi2GetFMUstate(handle o, void **kept)
{
    if (*kept == NULL) *kept = calloc(1, sizeof(instance));
    if (*kept == NULL) return ERROR;
    copy_instance((instance *)*kept, (instance *)o);
    return OK;
}

EXPORT status2 fmi2SetFMUstate(handle o, void *kept)
{
    if (kept == NULL) return ERROR;
    copy_instance((instance *)o, (instance *)kept);
    return OK;
}

EXPORT status2 fmi2FreeFMUstate(handle o, void **kept)
{
    (void)o;
    free(*kept);
    *kept = NULL;
    return OK;
}

EXPORT status2 fmi2SerializedFMUstateSize(handle o, void *kept, size_t *size)
{
    (void)o; (void)kept;
    *size = sizeof(instance);
    return OK;
}

EXPORT status2 fmi2SerializeFMUstate(handle o, void *kept, char bytes[], size_t size)
{
    (void)o;
    if (size != sizeof(instance)) return ERROR;
    memcpy(bytes, kept, size);
    return OK;
}

EXPORT status2 fmi2DeSerializeFMUstate(handle o, const char bytes[], size_t size, void **kept)
{
    (void)o;
    if (size != sizeof(instance)) return ERROR;
    if (*kept == NULL) *kept = calloc(1, sizeof(instance));
    if (*kept == NULL) return ERROR;
    memcpy(*kept, bytes, size);
    link_memory(&((instance *)*kept)->s);
    return OK;
}

EXPORT status2 fmi2SetRealInputDerivatives(handle o, const reference r[], size_t n, const int orders[],
                                           const double values[])
{
    (void)o; (void)r; (void)orders; (void)values;
    return n == 0 ? OK : ERROR;
}

EXPORT status2 fmi2GetRealOutputDerivatives(handle o, const reference r[], size_t n, const int orders[],
                                            double values[])
{
    (void)o; (void)r; (void)orders; (void)values;
    return n == 0 ? OK : ERROR;
}

EXPORT status2 fmi2DoStep(handle o, double time, double length, int keeps)
{
    instance *own = (instance *)o;
    const int found = step_to(own, time + length);
    (void)keeps;
    own->happened = found == 2;
    return found == 2 ? DISCARD : done(found);
}

EXPORT status2 fmi2CancelStep(handle o) { (void)o; return ERROR; }

EXPORT status2 fmi2GetStatus(handle o, int kind, status2 *value)
{
    (void)o; (void)kind; (void)value;
    return DISCARD;
}

EXPORT status2 fmi2GetRealStatus(handle o, int kind, double *value)
{
    if (kind != 2) return DISCARD; /* the last time that was reached */
    *value = ((instance *)o)->s.time;
    return OK;
}

EXPORT status2 fmi2GetIntegerStatus(handle o, int kind, int *value)
{
    (void)o; (void)kind; (void)value;
    return DISCARD;
}

EXPORT status2 fmi2GetBooleanStatus(handle o, int kind, int *value)
{
    if (kind != 3) return DISCARD; /* whether it ended */
    *value = ((instance *)o)->happened;
    return OK;
}

EXPORT status2 fmi2GetStringStatus(handle o, int kind, const char **value)
{
    (void)o; (void)kind; (void)value;
    return DISCARD;
}

#if EXCHANGES
EXPORT status2 fmi2EnterEventMode(handle o) { (void)o; return OK; }
EXPORT status2 fmi2EnterContinuousTimeMode(handle o) { (void)o; return OK; }
EXPORT status2 fmi2SetTime(handle o, double time) { take_time((instance *)o, time); return OK; }

EXPORT status2 fmi2SetContinuousStates(handle o, const double x[], size_t n)
{
    if (n != SIZE) return ERROR;
    memcpy(((instance *)o)->s.state, x, n * sizeof(double));
    ((instance *)o)->is_read = 0;
    return OK;
}

EXPORT status2 fmi2GetContinuousStates(handle o, double x[], size_t n)
{
    if (n != SIZE) return ERROR;
    memcpy(x, ((instance *)o)->s.state, n * sizeof(double));
    return OK;
}

EXPORT status2 fmi2GetDerivatives(handle o, double x[], size_t n)
{
    if (n != SIZE || !read_values((instance *)o)) return ERROR;
    memcpy(x, ((instance *)o)->rates, n * sizeof(double));
    return OK;
}

EXPORT status2 fmi2GetEventIndicators(handle o, double x[], size_t n)
{
    return n == EVENTS ? done(indicators((instance *)o, x)) : ERROR;
}

EXPORT status2 fmi2GetNominalsOfContinuousStates(handle o, double x[], size_t n)
{
    size_t k;
    (void)o;
    for (k = 0; k < n && k < SIZE; k++) x[k] = tolerances[k] > 0.0 ? tolerances[k] : 1.0;
    return n == SIZE ? OK : ERROR;
}

EXPORT status2 fmi2CompletedIntegratorStep(handle o, int keeps, int *has_event, int *ends)
{
    (void)keeps;
    *has_event = wants_event((instance *)o);
    *ends = 0;
    return OK;
}

EXPORT status2 fmi2NewDiscreteStates(handle o, event_info *info)
{
    info->again = info->nominals = 0;
    return done(update_discrete((instance *)o, &info->ends, &info->values, &info->is_next, &info->next));
}

EXPORT status2 fmi2GetDirectionalDerivative(handle o, const reference unknowns[], size_t n, const reference knowns[],
                                            size_t m, const double seed[], double found[])
{
    return done(derivatives((instance *)o, unknowns, n, knowns, m, seed, found));
}

#else
EXPORT status2 fmi2EnterEventMode(handle o)
{
    (void)o;
    return ERROR;
}

EXPORT status2 fmi2EnterContinuousTimeMode(handle o)
{
    (void)o;
    return ERROR;
}

EXPORT status2 fmi2SetTime(handle o, double time)
{
    (void)o; (void)time;
    return ERROR;
}

EXPORT status2 fmi2SetContinuousStates(handle o, const double x[], size_t n)
{
    (void)o; (void)x; (void)n;
    return ERROR;
}

EXPORT status2 fmi2GetContinuousStates(handle o, double x[], size_t n)
{
    (void)o; (void)x; (void)n;
    return ERROR;
}

EXPORT status2 fmi2GetDerivatives(handle o, double x[], size_t n)
{
    (void)o; (void)x; (void)n;
    return ERROR;
}

EXPORT status2 fmi2GetEventIndicators(handle o, double x[], size_t n)
{
    (void)o; (void)x; (void)n;
    return ERROR;
}

EXPORT status2 fmi2GetNominalsOfContinuousStates(handle o, double x[], size_t n)
{
    (void)o; (void)x; (void)n;
    return ERROR;
}

EXPORT status2 fmi2CompletedIntegratorStep(handle o, int keeps, int *has_event, int *ends)
{
    (void)o; (void)keeps; (void)has_event; (void)ends;
    return ERROR;
}

EXPORT status2 fmi2NewDiscreteStates(handle o, event_info *info)
{
    (void)o; (void)info;
    return ERROR;
}

EXPORT status2 fmi2GetDirectionalDerivative(handle o, const reference unknowns[], size_t n, const reference knowns[], size_t m, const double seed[], double found[])
{
    (void)o; (void)unknowns; (void)n; (void)knowns; (void)m; (void)seed; (void)found;
    return ERROR;
}
#endif
