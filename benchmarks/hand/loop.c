/* The time of many calls: every kernel here has this one signature, compiled by whomever. */
#define _POSIX_C_SOURCE 199309L
#include <time.h>

typedef int kernel(const double *const *inputs, const double *parameters, double *scratch, double *const *outputs);

/* Seconds of `calls` calls that go round `states` sets of inputs, of `groups` pointers each. */
double time_calls(kernel *f, const double *const *inputs, long states, long groups, const double *parameters,
                  double *scratch, double *const *outputs, long calls)
{
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    for (long i = 0, state = 0; i < calls; i++) {
        f(inputs + groups * state, parameters, scratch, outputs);
        if (++state == states)
            state = 0;
    }
    clock_gettime(CLOCK_MONOTONIC, &end);
    return (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
}

int nothing(const double *const *inputs, const double *parameters, double *scratch, double *const *outputs)
{
    (void)inputs, (void)parameters, (void)scratch, (void)outputs;
    return 0;
}
