/*
   modes: 0
   indicators: 0
   inputs: z v
   exchange: yes
*/
/* Polynomial force surface: f = sum of coefficients[i][j] z^i v^j, by Horner's rule. p: the table row by row;
   n: rows, columns. */

static double polynomial_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    double force = 0.0;
    int i, j;
    (void)s; (void)m;
    for (i = n[0] - 1; i >= 0; i--) {
        double inner = 0.0;
        for (j = n[1] - 1; j >= 0; j--)
            inner = inner * v + p[i * n[1] + j];
        force = force * z + inner;
    }
    return force;
}

static void polynomial_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    double force = 0.0;
    int i, j;
    (void)s; (void)m; (void)dR;
    dF[0] = dF[1] = 0.0;
    for (i = n[0] - 1; i >= 0; i--) {
        double inner = 0.0, slope = 0.0;
        for (j = n[1] - 1; j >= 0; j--) {
            slope = slope * v + inner;
            inner = inner * v + p[i * n[1] + j];
        }
        dF[0] = dF[0] * z + force;
        dF[1] = dF[1] * z + slope;
        force = force * z + inner;
    }
}
