/* The numbers: double, or a wider type for the reference, for which tgmath chooses the functions. */
#ifdef REAL
#define __STDC_WANT_IEC_60559_TYPES_EXT__ 1
#include <tgmath.h>
typedef REAL real;
#else
#include <math.h>
typedef double real;
#endif
