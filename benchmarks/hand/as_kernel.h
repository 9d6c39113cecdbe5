/* The accelerations as the timing loop calls them: inputs t, q, u. */
#ifndef REAL
int accelerations(const double *const *in, const double *p, double *scratch, double *const *out)
{
    (void)scratch;
    accelerate(in[1], in[2], p, out[0]);
    return 0;
}
#endif
