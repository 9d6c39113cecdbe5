/* The functions of FMI 3.0. */
#include "fmu.c"

#include <stdbool.h>

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } status3;
typedef void *handle;
typedef void logger3(void *environment, status3 status, const char *category, const char *message);
typedef unsigned reference;
typedef uint8_t byte;

static void tell3(void *o, const char *name, int status, const char *text)
{
    const instance *own = (const instance *)o;
    (void)name;
    ((logger3 *)own->log)(own->environment, (status3)status, "logStatusError", text);
}

static status3 done(int is_good)
{
    return is_good ? OK : ERROR;
}

static handle make3(int is_model_exchange, const char *name, const char *token, void *environment, logger3 *log)
{
    if (token == NULL || strcmp(token, TOKEN) != 0) {
        if (log != NULL) log(environment, ERROR, "logStatusError", "the instantiation token is not that of this unit");
        return NULL;
    }
    return make_instance(is_model_exchange, name, tell3, environment, (void (*)(void))log);
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT status3 fmi3SetDebugLogging(handle o, bool is_on, size_t n, const char *const categories[])
{
    (void)o; (void)is_on; (void)n; (void)categories;
    return OK;
}

EXPORT handle fmi3InstantiateModelExchange(const char *name, const char *token, const char *path, bool is_visible,
                                           bool logs, void *environment, logger3 *log)
{
    (void)path; (void)is_visible; (void)logs;
#if !EXCHANGES
    (void)name; (void)token;
    if (log != NULL) log(environment, ERROR, "logStatusError", "it is for co-simulation alone: " ALONE);
    return NULL;
#else
    return make3(1, name, token, environment, log);
#endif
}

EXPORT handle fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path, bool is_visible,
                                          bool logs, bool has_events, bool returns_early, const reference wanted[],
                                          size_t n, void *environment, logger3 *log, void (*intermediate)(void))
{
    (void)path; (void)is_visible; (void)logs; (void)has_events; (void)returns_early; (void)wanted; (void)n;
    (void)intermediate;
    return make3(0, name, token, environment, log);
}

EXPORT handle fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *path, bool is_visible,
                                                bool logs, void *environment, logger3 *log, void (*update_clock)(void),
                                                void (*lock)(void), void (*unlock)(void))
{
    (void)name; (void)token; (void)path; (void)is_visible; (void)logs; (void)update_clock; (void)lock; (void)unlock;
    if (log != NULL) log(environment, ERROR, "logStatusError", "there is no scheduled execution of this unit");
    return NULL;
}

EXPORT status3 fmi3EnterInitializationMode(handle o, bool has_tolerance, double tolerance, double start, bool has_end,
                                           double end)
{
    (void)has_end; (void)end;
    return done(set_up((instance *)o, has_tolerance, tolerance, start));
}

EXPORT status3 fmi3EnterEventMode(handle o) { (void)o; return OK; }
EXPORT status3 fmi3EnterStepMode(handle o) { (void)o; return OK; }
EXPORT status3 fmi3EnterConfigurationMode(handle o) { (void)o; return OK; }
EXPORT status3 fmi3ExitConfigurationMode(handle o) { (void)o; return OK; }
EXPORT status3 fmi3EvaluateDiscreteStates(handle o) { (void)o; return OK; }

EXPORT status3 fmi3GetFloat64(handle o, const reference r[], size_t n, double values[], size_t m)
{
    return n == m ? done(get_values((instance *)o, n, r, values)) : ERROR;
}

EXPORT status3 fmi3SetFloat64(handle o, const reference r[], size_t n, const double values[], size_t m)
{
    return n == m ? done(set_values((instance *)o, n, r, values)) : ERROR;
}

/* There are no variables of other types. */
#define TYPE(NAME, KIND)                                                                                      \
    EXPORT status3 fmi3Get##NAME(handle o, const reference r[], size_t n, KIND values[], size_t m)            \
    {                                                                                                         \
        (void)o; (void)r; (void)values; (void)m;                                                              \
        return n == 0 ? OK : ERROR;                                                                           \
    }                                                                                                         \
    EXPORT status3 fmi3Set##NAME(handle o, const reference r[], size_t n, const KIND values[], size_t m)      \
    {                                                                                                         \
        (void)o; (void)r; (void)values; (void)m;                                                              \
        return n == 0 ? OK : ERROR;                                                                           \
    }
typedef const char *text3;
TYPE(Float32, float)
TYPE(Int8, int8_t)
TYPE(UInt8, uint8_t)
TYPE(Int16, int16_t)
TYPE(UInt16, uint16_t)
TYPE(Int32, int32_t)
TYPE(UInt32, uint32_t)
TYPE(Int64, int64_t)
TYPE(UInt64, uint64_t)
TYPE(Boolean, bool)
TYPE(String, text3)

#define NOTHING(...) (void)o, (void)r, __VA_ARGS__, n == 0 ? OK : ERROR
EXPORT status3 fmi3GetBinary(handle o, const reference r[], size_t n, size_t sizes_of[], const byte *values[], size_t m)
{
    return NOTHING((void)sizes_of, (void)values, (void)m);
}

EXPORT status3 fmi3SetBinary(handle o, const reference r[], size_t n, const size_t sizes_of[],
                             const byte *const values[], size_t m)
{
    return NOTHING((void)sizes_of, (void)values, (void)m);
}

EXPORT status3 fmi3GetClock(handle o, const reference r[], size_t n, bool values[]) { return NOTHING((void)values); }

EXPORT status3 fmi3SetClock(handle o, const reference r[], size_t n, const bool values[])
{
    return NOTHING((void)values);
}

EXPORT status3 fmi3GetIntervalDecimal(handle o, const reference r[], size_t n, double intervals[], int qualifiers[])
{
    return NOTHING((void)intervals, (void)qualifiers);
}

EXPORT status3 fmi3GetIntervalFraction(handle o, const reference r[], size_t n, uint64_t counters[],
                                       uint64_t resolutions[], int qualifiers[])
{
    return NOTHING((void)counters, (void)resolutions, (void)qualifiers);
}

EXPORT status3 fmi3GetShiftDecimal(handle o, const reference r[], size_t n, double shifts[])
{
    return NOTHING((void)shifts);
}

EXPORT status3 fmi3GetShiftFraction(handle o, const reference r[], size_t n, uint64_t counters[],
                                    uint64_t resolutions[])
{
    return NOTHING((void)counters, (void)resolutions);
}

EXPORT status3 fmi3SetIntervalDecimal(handle o, const reference r[], size_t n, const double intervals[])
{
    return NOTHING((void)intervals);
}

EXPORT status3 fmi3SetIntervalFraction(handle o, const reference r[], size_t n, const uint64_t counters[],
                                       const uint64_t resolutions[])
{
    return NOTHING((void)counters, (void)resolutions);
}

EXPORT status3 fmi3SetShiftDecimal(handle o, const reference r[], size_t n, const double shifts[])
{
    return NOTHING((void)shifts);
}

EXPORT status3 fmi3SetShiftFraction(handle o, const reference r[], size_t n, const uint64_t counters[],
                                    const uint64_t resolutions[])
{
    return NOTHING((void)counters, (void)resolutions);
}

EXPORT status3 fmi3GetNumberOfVariableDependencies(handle o, reference r, size_t *n)
{
    (void)o; (void)r; (void)n;
    return ERROR;
}

EXPORT status3 fmi3GetVariableDependencies(handle o, reference r, size_t of_dependent[], reference independents[],
                                           size_t of_independents[], int kinds[], size_t n)
{
    (void)of_dependent; (void)independents; (void)of_independents; (void)kinds; (void)n; (void)o; (void)r;
    return ERROR;
}

EXPORT status3 fmi3GetOutputDerivatives(handle o, const reference r[], size_t n, const int32_t orders[],
                                        double values[], size_t m)
{
    return NOTHING((void)orders, (void)values, (void)m);
}

EXPORT status3 fmi3ActivateModelPartition(handle o, reference clock, double time)
{
    (void)o; (void)clock; (void)time;
    return ERROR;
}

EXPORT status3 fmi3DoStep(handle o, double time, double length, bool keeps, bool *has_event, bool *ends, bool *is_early,
                          double *last)
{
    const int found = step_to((instance *)o, time + length);
    (void)keeps;
    *has_event = *is_early = false;
    *ends = found == 2;
    *last = ((instance *)o)->s.time;
    return done(found);
}

EXPORT status3 fmi3GetNumberOfContinuousStates(handle o, size_t *n) { (void)o; *n = SIZE; return OK; }
EXPORT status3 fmi3GetNumberOfEventIndicators(handle o, size_t *n) { (void)o; *n = EVENTS; return OK; }

EXPORT status3 fmi3CompletedIntegratorStep(handle o, bool keeps, bool *has_event, bool *ends)
{
    (void)keeps;
    *has_event = wants_event((instance *)o) != 0;
    *ends = false;
    return EXCHANGES ? OK : ERROR;
}

EXPORT status3 fmi3UpdateDiscreteStates(handle o, bool *again, bool *ends, bool *nominals, bool *values, bool *is_next,
                                        double *next)
{
    int stops = 0, changes = 0, has_next = 0;
    if (EXCHANGES && !update_discrete((instance *)o, &stops, &changes, &has_next, next)) return ERROR;
    *again = *nominals = false;
    *ends = stops != 0;
    *values = changes != 0;
    *is_next = has_next != 0;
    return OK;
}

EXPORT status3 fmi3GetDirectionalDerivative(handle o, const reference unknowns[], size_t n, const reference knowns[],
                                            size_t m, const double seed[], size_t k, double found[], size_t l)
{
    return k == m && l == n ? done(derivatives((instance *)o, unknowns, n, knowns, m, seed, found)) : ERROR;
}

/* The products of the rows of unknowns with a seed, one direction after the other. */
static int adjoint(instance *o, const unsigned *unknowns, size_t n, const unsigned *knowns, size_t m,
                   const double *seed, double *found)
{
    const double one = 1.0;
    size_t i, k;
    for (k = 0; k < m; k++) {
        found[k] = 0.0;
        for (i = 0; i < n; i++) {
            double slope;
            if (!derivatives(o, unknowns + i, 1, knowns + k, 1, &one, &slope)) return 0;
            found[k] += slope * seed[i];
        }
    }
    return 1;
}

EXPORT status3 fmi3GetAdjointDerivative(handle o, const reference unknowns[], size_t n, const reference knowns[],
                                        size_t m, const double seed[], size_t k, double found[], size_t l)
{
    return k == n && l == m ? done(adjoint((instance *)o, unknowns, n, knowns, m, seed, found)) : ERROR;
}

#define F(NAME) fmi3##NAME
typedef status3 status;
#include "fmi.c"
