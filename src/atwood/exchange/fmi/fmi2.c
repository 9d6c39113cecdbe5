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

EXPORT status2 fmi2SetupExperiment(handle o, int has_tolerance, double tolerance, double start, int has_end, double end)
{
    (void)has_end; (void)end;
    return done(set_up((instance *)o, has_tolerance, tolerance, start));
}

EXPORT status2 fmi2EnterInitializationMode(handle o) { (void)o; return OK; }

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

EXPORT status2 fmi2EnterEventMode(handle o) { (void)o; return EXCHANGES ? OK : ERROR; }

EXPORT status2 fmi2CompletedIntegratorStep(handle o, int keeps, int *has_event, int *ends)
{
    (void)keeps;
    *has_event = wants_event((instance *)o);
    *ends = 0;
    return EXCHANGES ? OK : ERROR;
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

/* The other version names these otherwise. */
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#define fmi2GetContinuousStateDerivatives fmi2GetDerivatives
#define F(NAME) fmi2##NAME
typedef status2 status;
typedef char byte;
#include "fmi.c"
