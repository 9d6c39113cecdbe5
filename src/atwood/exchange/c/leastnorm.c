static double largest_of(const double *row, int count)
{
    double most = 0.0;
    int i;
    for (i = 0; i < count; i++) most = fmax(most, fabs(row[i]));
    return most;
}

/* The shortest x with rows x = right: rows are made square to each other, the largest first; what follows is left out. */
static void least_norm(double *rows, double *right, int count, int width, double *found)
{
    int i, j, pass;
    memset(found, 0, (size_t)width * sizeof(double));
    for (i = 0; i < count; i++) {
        double sum = 0.0;
        for (j = 0; j < width; j++) sum += rows[i * width + j] * rows[i * width + j];
        sum = sum > 0.0 ? sqrt(sum) : 1.0;
        for (j = 0; j < width; j++) rows[i * width + j] /= sum;
        right[i] /= sum;
    }
    for (;;) {
        double most = 0.0, value;
        double *best = rows;
        int chosen = 0;
        for (i = 0; i < count; i++) {
            double sum = 0.0;
            for (j = 0; j < width; j++) sum += rows[i * width + j] * rows[i * width + j];
            if (sum > most) {
                most = sum;
                chosen = i;
            }
        }
        most = sqrt(most);
        if (!(most > 1e-10)) return;
        best = rows + chosen * width;
        value = right[chosen] / most;
        for (j = 0; j < width; j++) {
            best[j] /= most;
            found[j] += value * best[j];
        }
        for (i = 0; i < count; i++) {
            double *const row = rows + i * width;
            if (i == chosen) continue;
            for (pass = 0; pass < 2; pass++) {
                double share = 0.0;
                for (j = 0; j < width; j++) share += row[j] * best[j];
                for (j = 0; j < width; j++) row[j] -= share * best[j];
                right[i] -= share * value;
            }
        }
        memset(best, 0, (size_t)width * sizeof(double));
    }
}
