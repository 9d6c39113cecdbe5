/* A whole run of the chain of ggl_chain.c with SUNDIALS' IDA: set up, integrate, free.  The linear solver is dense, or
 * a band one if BAND is defined. */
#define _POSIX_C_SOURCE 199309L
#include "ggl_chain.c"
#include <stddef.h>
#include <stdint.h>
#include <time.h>
#include "sundials.h"

enum { TO_TIME = 1, BELOW = 11 };

static int ida_residual(double t, Vector y, Vector yp, Vector out, void *p)
{
    (void)t;
    equations(y->content->data, yp->content->data, p, out->content->data);
    return 0;
}

static int ida_jacobian(double t, double cj, Vector state, Vector yp, Vector r, Matrix matrix, void *data, Vector a,
                        Vector b, Vector c)
{
    const double *y = state->content->data, *p = data;
    (void)t, (void)yp, (void)r, (void)a, (void)b, (void)c;
#ifdef BAND
    const BandContent *J = matrix->content;
    double *const *column_of = J->cols;
    const INDEX shift = J->s_mu;
#define PUT(row, column, value) column_of[column][(row) - (column) + shift] = value;
#else
    double *J = ((DenseContent *)matrix->content)->data;
#define PUT(row, column, value) J[(row) + SIZE * (column)] = value;
#endif
    JACOBIAN
#undef PUT
    return 0;
}

/* Integrate from consistent y and y' at 0 to an end; return IDA's flag, or 1 if it cannot be set up.
 * Tuning, where 0 leaves what IDA has itself: the Newton coefficient, the least growth of a step, and the change of the
 * step that asks for a new Jacobian.  Counts: steps, residuals, Jacobians, nanoseconds
 * of the integration alone. */
int integrate(double end, double relative, double *absolute, const double *tuning, double *p, double *y, double *yp,
              long *counts)
{
    double kinds[SIZE], t = 0.0;
    Context context = NULL;
    int flag = 1;
    void *ida;
    if (SUNContext_Create(0, &context))
        return 1;
    SUNContext_ClearErrHandlers(context);
    for (int i = 0; i < LINKS; i++) {
        for (int k = 0; k < 2; k++)
            kinds[P(i, k)] = kinds[V(i, k)] = 1.0;
        kinds[L(i)] = kinds[U(i)] = 0.0;
    }
    Vector state = N_VMake_Serial(SIZE, y, context), rates = N_VMake_Serial(SIZE, yp, context);
    Vector allowed = N_VMake_Serial(SIZE, absolute, context), id = N_VMake_Serial(SIZE, kinds, context);
#ifdef BAND
    const INDEX reach = BELOW < SIZE ? BELOW : SIZE - 1;
    Matrix matrix = SUNBandMatrix(SIZE, reach, reach, context);
    LinearSolver solver = SUNLinSol_Band(state, matrix, context);
#else
    Matrix matrix = SUNDenseMatrix(SIZE, SIZE, context);
    LinearSolver solver = SUNLinSol_Dense(state, matrix, context);
#endif
    ida = IDACreate(context);
    if (ida && solver && !IDAInit(ida, ida_residual, 0.0, state, rates)
        && !IDASVtolerances(ida, relative, allowed) && !IDASetUserData(ida, p)
        && !IDASetLinearSolver(ida, solver, matrix) && !IDASetJacFn(ida, ida_jacobian) && !IDASetId(ida, id)
        && !(tuning[0] > 0.0 && IDASetNonlinConvCoef(ida, tuning[0]))
        && !(tuning[1] > 0.0 && IDASetEtaFixedStepBounds(ida, 1.0, tuning[1]))
        && !(tuning[2] > 0.0 && IDASetDeltaCjLSetup(ida, tuning[2]))
        && !IDASetStopTime(ida, end) && !IDASetMaxNumSteps(ida, 1000000)) {
        struct timespec begun, done;
        clock_gettime(CLOCK_MONOTONIC, &begun);
        flag = IDASolve(ida, end, &t, state, rates, TO_TIME);
        clock_gettime(CLOCK_MONOTONIC, &done);
        counts[3] = 1000000000L * (done.tv_sec - begun.tv_sec) + done.tv_nsec - begun.tv_nsec;
        IDAGetNumSteps(ida, counts);
        IDAGetNumResEvals(ida, counts + 1);
        IDAGetNumJacEvals(ida, counts + 2);
    }
    IDAFree(&ida);
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
    N_VDestroy(id);
    N_VDestroy(allowed);
    N_VDestroy(rates);
    N_VDestroy(state);
    SUNContext_Free(&context);
    return flag;
}
