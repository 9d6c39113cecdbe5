/* A chain of LINKS point masses on massless rods with all coordinates kept, stabilised (Gear, Gupta, Leimkuhler).
 * With r_i = p_i - p_{i-1}, n_i = r_i / l_i:
 *     p_i' - v_i + mu_i n_i - mu_{i+1} n_{i+1} = 0
 *     m_i (v_i' + g) - la_i n_i + la_{i+1} n_{i+1} = 0
 *     (r_i.r_i / l_i - l_i) / 2 = 0,   n_i . (v_i - v_{i-1}) = 0
 * y = (p, v, la, mu), all of each together unless BAND is defined; LINKS = 1 is the pendulum.
 * Parameters l (LINKS), m (LINKS), g. */
#ifdef BAND /* link after link, so that the Jacobian is a band */
#define P(i, k) (6 * (i) + (k))
#define V(i, k) (6 * (i) + 2 + (k))
#define L(i) (6 * (i) + 4)
#define U(i) (6 * (i) + 5)
#else
#define P(i, k) (2 * (i) + (k))
#define V(i, k) (2 * LINKS + 2 * (i) + (k))
#define L(i) (4 * LINKS + (i))
#define U(i) (5 * LINKS + (i))
#endif
#define SIZE (6 * LINKS)

static inline void equations(const double *y, const double *yp, const double *p, double *F)
{
    const double *l = p, *m = p + LINKS, g = p[2 * LINKS];
    for (int i = 0; i < LINKS; i++) {
        const double over = 1.0 / l[i], la = y[L(i)] * over, mu = y[U(i)] * over;
        double rr = 0.0, rv = 0.0;
        for (int k = 0; k < 2; k++) {
            const double r = i ? y[P(i, k)] - y[P(i - 1, k)] : y[P(i, k)];
            const double v = i ? y[V(i, k)] - y[V(i - 1, k)] : y[V(i, k)];
            rr += r * r;
            rv += r * v;
            F[P(i, k)] = yp[P(i, k)] - y[V(i, k)] + mu * r;
            F[V(i, k)] = m[i] * (k ? yp[V(i, k)] + g : yp[V(i, k)]) - la * r;
            if (i) {
                F[P(i - 1, k)] -= mu * r;
                F[V(i - 1, k)] += la * r;
            }
        }
        F[L(i)] = 0.5 * (rr * over - l[i]);
        F[U(i)] = rv * over;
    }
}

/* PUT is called once for each entry, always in the same order. */
#define JACOBIAN                                                                      \
    const double *l = p, *m = p + LINKS;                                              \
    for (int i = 0; i < LINKS; i++) {                                                 \
        const int last = i == LINKS - 1;                                              \
        const double over = 1.0 / l[i], next = last ? 0.0 : 1.0 / l[i + 1];           \
        const double la = y[L(i)] * over, la2 = last ? 0.0 : y[L(i + 1)] * next;      \
        const double mu = y[U(i)] * over, mu2 = last ? 0.0 : y[U(i + 1)] * next;      \
        for (int k = 0; k < 2; k++) {                                                 \
            const double n = (i ? y[P(i, k)] - y[P(i - 1, k)] : y[P(i, k)]) * over;   \
            const double v = (i ? y[V(i, k)] - y[V(i - 1, k)] : y[V(i, k)]) * over;   \
            PUT(P(i, k), P(i, k), cj + mu + mu2)                                      \
            PUT(P(i, k), V(i, k), -1.0)                                               \
            PUT(P(i, k), U(i), n)                                                     \
            PUT(V(i, k), P(i, k), -la - la2)                                          \
            PUT(V(i, k), V(i, k), m[i] * cj)                                          \
            PUT(V(i, k), L(i), -n)                                                    \
            PUT(L(i), P(i, k), n)                                                     \
            PUT(U(i), P(i, k), v)                                                     \
            PUT(U(i), V(i, k), n)                                                     \
            if (i) {                                                                  \
                PUT(P(i, k), P(i - 1, k), -mu)                                        \
                PUT(V(i, k), P(i - 1, k), la)                                         \
                PUT(P(i - 1, k), P(i, k), -mu)                                        \
                PUT(V(i - 1, k), P(i, k), la)                                         \
                PUT(P(i - 1, k), U(i), -n)                                            \
                PUT(V(i - 1, k), L(i), n)                                             \
                PUT(L(i), P(i - 1, k), -n)                                            \
                PUT(U(i), P(i - 1, k), -v)                                            \
                PUT(U(i), V(i - 1, k), -n)                                            \
            }                                                                         \
        }                                                                             \
    }

enum { MOST = 36 * LINKS };
static int rows[MOST], columns[MOST], places[MOST], count;

static inline void listed(double cj, const double *y, const double *p, double *J)
{
    const int *place = places;
#define PUT(row, column, value) J[*place++] = value;
    JACOBIAN
#undef PUT
}

/* Work out once where each entry goes, by column and then by row; return how many there are. */
int prepare(int *out_rows, int *out_columns)
{
    const double y[SIZE] = {0.0}, p[2 * LINKS] = {0.0}, cj = 0.0;
    count = 0;
#define PUT(row, column, value) (void)(value), rows[count] = row, columns[count++] = column;
    JACOBIAN
#undef PUT
    for (int i = 0; i < count; i++) {
        places[i] = 0;
        for (int j = 0; j < count; j++)
            places[i] += columns[j] < columns[i] || (columns[j] == columns[i] && rows[j] < rows[i]);
        out_rows[places[i]] = rows[i];
        out_columns[places[i]] = columns[i];
    }
    return count;
}

/* As the timing loop calls them. */
int residual(const double *const *in, const double *p, double *scratch, double *const *out)
{
    (void)scratch;
    equations(in[1], in[2], p, out[0]);
    return 0;
}

int jacobian(const double *const *in, const double *p, double *scratch, double *const *out)
{
    (void)scratch;
    listed(in[3][0], in[1], p, out[0]);
    return 0;
}
