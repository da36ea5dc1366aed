#include "ncp_dense.h"

#include <math.h>
#include <string.h>

/* ---- laws -------------------------------------------------------------------------------------------------------- */

void ncp_project(const struct ncp_law *law, const double y[3], double to[3], double D[3][3])
{
    memset(D, 0, 9 * sizeof(double));
    if (law->count == 1) {
        to[0] = y[0] < law->lo ? law->lo : y[0] > law->hi ? law->hi : y[0];
        D[0][0] = to[0] == y[0];
        return;
    }
    to[0] = to[1] = to[2] = 0;
    if (!(y[0] > 0)) return;
    const double size = hypot(y[1], y[2]), limit = law->friction * y[0];
    to[0] = y[0], D[0][0] = 1;
    if (size <= limit) {
        to[1] = y[1], to[2] = y[2];
        D[1][1] = D[2][2] = 1;
        return;
    }
    const double way[2] = {y[1] / size, y[2] / size};
    for (int k = 0; k < 2; ++k) {
        to[1 + k] = limit * way[k];
        D[1 + k][0] = law->friction * way[k];
        for (int q = 0; q < 2; ++q) D[1 + k][1 + q] = limit / size * ((k == q) - way[k] * way[q]);
    }
}

void ncp_arrive(const struct ncp_dense *d, const struct ncp_law *law, double y[3])
{
    for (int32_t k = 0; k < law->count; ++k) y[k] = d->lambda[law->first + k] - d->u[law->first + k] / law->response;
}

static double map_of(const struct ncp_dense *d, const struct ncp_law *law)
{
    double y[3], to[3], D[3][3], sum = 0;
    ncp_arrive(d, law, y);
    ncp_project(law, y, to, D);
    for (int32_t k = 0; k < law->count; ++k) {
        const double residual = d->lambda[law->first + k] - to[k];
        sum += residual * residual;
    }
    return sqrt(sum) * law->response;
}

double ncp_natural_map(const struct ncp_dense *d)
{
    double most = 0;
    for (int32_t i = 0; i < d->laws; ++i) {
        const double map = map_of(d, &d->law[i]);
        if (!(map <= most)) most = map; /* what is not a number is the most */
    }
    return most;
}

void ncp_respond(const struct ncp_dense *d, int32_t number, double x, double *u)
{
    for (int32_t r = 0; r < d->size; ++r) u[r] += d->G[(size_t)r * (size_t)d->size + (size_t)number] * x;
}

/* ---- linear equations -------------------------------------------------------------------------------------------- */

static void exchange(double *a, double *b, size_t count)
{
    for (size_t c = 0; c < count; ++c) {
        const double t = a[c];
        a[c] = b[c], b[c] = t;
    }
}

bool ncp_factor(double *M, int32_t *pivot, int32_t count)
{
    const size_t n = (size_t)count;
    for (size_t k = 0; k < n; ++k) {
        double *top = M + k * n;
        size_t best = k;
        for (size_t i = k + 1; i < n; ++i)
            if (fabs(M[i * n + k]) > fabs(M[best * n + k])) best = i;
        pivot[k] = (int32_t)best;
        if (!(fabs(M[best * n + k]) > 0)) return false;
        if (best != k) exchange(top, M + best * n, n);
        const double inverse = 1 / top[k];
        for (size_t i = k + 1; i < n; ++i) {
            double *row = M + i * n;
            const double share = row[k] *= inverse;
            if (share == 0) continue;
            for (size_t c = k + 1; c < n; ++c) row[c] -= share * top[c];
        }
    }
    return true;
}

void ncp_substitute(const double *M, const int32_t *pivot, int32_t count, double *x)
{
    const size_t n = (size_t)count;
    for (size_t k = 0; k < n; ++k) exchange(x + k, x + pivot[k], (size_t)pivot[k] != k);
    for (size_t k = 1; k < n; ++k)
        for (size_t c = 0; c < k; ++c) x[k] -= M[k * n + c] * x[c];
    for (size_t k = n; k-- > 0;) {
        for (size_t c = k + 1; c < n; ++c) x[k] -= M[k * n + c] * x[c];
        x[k] /= M[k * n + k];
    }
}
