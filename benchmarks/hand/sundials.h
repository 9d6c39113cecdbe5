/* The few things of SUNDIALS 7 that are used here: its headers need not be there.  INDEX is its index type. */
typedef struct context_ *Context;
typedef struct {
    INDEX length;
    int own;
    double *data;
} VectorContent;
typedef struct {
    VectorContent *content;
} *Vector;
typedef struct {
    INDEX rows, columns;
    double *data;
} DenseContent;
typedef struct {
    INDEX rows, columns, ld, mu, ml, s_mu;
    double *data;
    INDEX ldata;
    double **cols;
} BandContent;
typedef struct {
    void *content;
} *Matrix;
typedef struct solver_ *LinearSolver;

int SUNContext_Create(int communicator, Context *context);
int SUNContext_ClearErrHandlers(Context context);
int SUNContext_Free(Context *context);
Vector N_VMake_Serial(INDEX length, double *data, Context context);
void N_VDestroy(Vector vector);
Matrix SUNDenseMatrix(INDEX rows, INDEX columns, Context context);
Matrix SUNBandMatrix(INDEX size, INDEX above, INDEX below, Context context);
void SUNMatDestroy(Matrix matrix);
LinearSolver SUNLinSol_Dense(Vector y, Matrix matrix, Context context);
LinearSolver SUNLinSol_Band(Vector y, Matrix matrix, Context context);
int SUNLinSolFree(LinearSolver solver);

typedef int Residual(double t, Vector y, Vector yp, Vector out, void *data);
typedef int Jacobian(double t, double cj, Vector y, Vector yp, Vector r, Matrix J, void *data, Vector a, Vector b,
                     Vector c);

void *IDACreate(Context context);
void IDAFree(void **ida);
int IDAInit(void *ida, Residual *residual, double t, Vector y, Vector yp);
int IDASVtolerances(void *ida, double relative, Vector absolute);
int IDASetUserData(void *ida, void *data);
int IDASetLinearSolver(void *ida, LinearSolver solver, Matrix matrix);
int IDASetJacFn(void *ida, Jacobian *jacobian);
int IDASetId(void *ida, Vector kinds);
int IDASetNonlinConvCoef(void *ida, double coefficient);
int IDASetEtaFixedStepBounds(void *ida, double least, double most);
int IDASetDeltaCjLSetup(void *ida, double change);
int IDASetStopTime(void *ida, double t);
int IDASetMaxNumSteps(void *ida, long steps);
int IDASolve(void *ida, double t_out, double *t, Vector y, Vector yp, int task);
int IDAGetNumSteps(void *ida, long *count);
int IDAGetNumResEvals(void *ida, long *count);
int IDAGetNumJacEvals(void *ida, long *count);
