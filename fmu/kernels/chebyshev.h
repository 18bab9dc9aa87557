/*
   modes: 0
   indicators: 0
   inputs: z v
   exchange: yes
*/
/* Chebyshev force surface: f = sum of coefficients[i][j] T_i(z/displacement_scale) T_j(v/velocity_scale), by
   Clenshaw's recurrence. p: the table row by row, displacement_scale, velocity_scale; n: rows, columns. */

static double chebyshev_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    const double *scale = p + n[0] * n[1];
    const double x = z / scale[0], y = v / scale[1];
    double after = 0.0, later = 0.0, force = 0.0;
    int i, j;
    (void)s; (void)m;
    for (i = n[0] - 1; i >= 0; i--) {
        const double *row = p + i * n[1];
        double next = 0.0, second = 0.0, inner;
        for (j = n[1] - 1; j > 0; j--) {
            inner = row[j] + 2.0 * y * next - second;
            second = next;
            next = inner;
        }
        inner = row[0] + y * next - second;
        force = i ? inner + 2.0 * x * after - later : inner + x * after - later;
        later = after;
        after = force;
    }
    return force;
}

/* The recurrence and its derivatives along x and y, side by side. */
static void chebyshev_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double *scale = p + n[0] * n[1];
    const double x = z / scale[0], y = v / scale[1];
    double after[3] = {0.0, 0.0, 0.0}, later[3] = {0.0, 0.0, 0.0}, sum[3] = {0.0, 0.0, 0.0};
    int i, j, k;
    (void)s; (void)m; (void)dR;
    for (i = n[0] - 1; i >= 0; i--) {
        const double *row = p + i * n[1], twice = i ? 2.0 : 1.0;
        double next = 0.0, second = 0.0, d_next = 0.0, d_second = 0.0, inner, d_inner;
        for (j = n[1] - 1; j > 0; j--) {
            inner = row[j] + 2.0 * y * next - second;
            d_inner = 2.0 * next + 2.0 * y * d_next - d_second;
            second = next;
            next = inner;
            d_second = d_next;
            d_next = d_inner;
        }
        inner = row[0] + y * next - second;
        d_inner = next + y * d_next - d_second;
        sum[0] = inner + twice * x * after[0] - later[0];
        sum[1] = twice * (after[0] + x * after[1]) - later[1];
        sum[2] = d_inner + twice * x * after[2] - later[2];
        for (k = 0; k < 3; k++) {
            later[k] = after[k];
            after[k] = sum[k];
        }
    }
    dF[0] = sum[1] / scale[0];
    dF[1] = sum[2] / scale[1];
}
