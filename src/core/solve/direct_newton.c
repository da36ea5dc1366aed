#include "direct_newton.h"

#include <math.h>
#include <string.h>

/* Ways to go, one after the other, each from the start. `proximal` is added to the diagonal of a step's matrix, whose
 * entries are shares of a law's own response: where several multipliers have nearly the same effect it keeps a step small.
 * It falls with the natural map, to LEAST, with which the step is Newton's. `stiffness`: which piece of a law holds is
 * read from lambda - u / (stiffness w), which is another piece on the way there, but the same in the end. The first way
 * is the short one, which most problems take; of those that it leaves (rag dolls on the floor) the second solves two
 * thirds, all together nine of ten. */
static const struct way {
    int steps;
    double proximal, most, stiffness;
} ways[] = {{30, 0, 0, 1}, {100, 1, 1e-2, 10}, {100, 10, 1e-1, 1}, {100, 1, 1e-2, 1}, {100, 0, 1e-8, 100}, {100, 1, 1e-2, 100}};
enum { WAYS = sizeof ways / sizeof *ways };
static const double LEAST = 1e-12;
/* m/s: what is left below this is rounding, which no other way takes away. */
static const double NEARLY = 1e-11;

/* ---- laws -------------------------------------------------------------------------------------------------------- */

/* The projection of y, and its derivative D, row by row. */
static void project(const struct direct_law *law, const double y[3], double to[3], double D[3][3])
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

/* lambda - u/w of a law. */
static void begin_of(const struct direct_dense *d, const struct direct_law *law, double w, double y[3])
{
    for (int32_t k = 0; k < law->count; ++k) y[k] = d->lambda[law->first + k] - d->u[law->first + k] / w;
}

static double map_of(const struct direct_dense *d, const struct direct_law *law)
{
    double y[3], to[3], D[3][3], sum = 0;
    begin_of(d, law, law->response, y);
    project(law, y, to, D);
    for (int32_t k = 0; k < law->count; ++k) {
        const double missing = d->lambda[law->first + k] - to[k];
        sum += missing * missing;
    }
    return sqrt(sum) * law->response;
}

double direct_natural_map(const struct direct_dense *d)
{
    double most = 0;
    for (int32_t i = 0; i < d->laws; ++i) {
        const double map = map_of(d, &d->law[i]);
        if (!(map <= most)) most = map; /* what is not a number is the most */
    }
    return most;
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

struct newton {
    struct direct_dense *d;
    double *M;              /* of the numbers that are solved for: count x count */
    double *step, *moved;   /* (size) of lambda; of u by the steps of numbers that their law fixes */
    double *right;          /* (count) right sides, then the steps */
    double *start_lambda, *start_u, *best_lambda, *best_u;
    int32_t *number, count; /* those that are solved for */
    double stiffness, proximal;
};

/* The work, cut up. */
static struct newton newton_of(struct direct_dense *d)
{
    const size_t n = (size_t)d->size;
    struct newton s = {.d = d};
    s.M = d->work;
    s.step = s.M + n * n;
    s.moved = s.step + n;
    s.right = s.moved + n;
    s.start_lambda = s.right + n;
    s.start_u = s.start_lambda + n;
    s.best_lambda = s.start_u + n;
    s.best_u = s.best_lambda + n;
    s.number = (int32_t *)(s.best_u + n);
    return s;
}

/* u += G x, of one number x of lambda. */
static void respond(const struct direct_dense *d, int32_t number, double x, double *u)
{
    for (int32_t r = 0; r < d->size; ++r) u[r] += d->G[(size_t)r * (size_t)d->size + (size_t)number] * x;
}

/* Numbers that their law fixes go where it has them: an open contact's to 0. The others are listed, to be solved for. */
static void sort_numbers(struct newton *s)
{
    const struct direct_dense *d = s->d;
    s->count = 0;
    memset(s->moved, 0, (size_t)d->size * sizeof *s->moved);
    for (int32_t i = 0; i < d->laws; ++i) {
        const struct direct_law *law = &d->law[i];
        double y[3], to[3], D[3][3];
        begin_of(d, law, s->stiffness * law->response, y);
        project(law, y, to, D);
        for (int32_t k = 0; k < law->count; ++k) {
            const int32_t n = law->first + k;
            s->step[n] = to[k] - d->lambda[n];
            if (D[k][0] != 0 || D[k][1] != 0 || D[k][2] != 0) s->number[s->count++] = n;
            else if (s->step[n] != 0) respond(d, n, s->step[n], s->moved);
        }
    }
}

/* Rows of a law: (1 - D) step + D G step / w = Pi - lambda. `row`: the next one. */
static void enter_law(struct newton *s, const struct direct_law *law, int32_t *row)
{
    const struct direct_dense *d = s->d;
    double y[3], to[3], D[3][3];
    begin_of(d, law, s->stiffness * law->response, y);
    project(law, y, to, D);
    for (int32_t k = 0; k < law->count && *row < s->count; ++k) {
        if (s->number[*row] != law->first + k) continue;
        double *M = s->M + (size_t)*row * (size_t)s->count, *right = &s->right[*row];
        *right = s->step[law->first + k];
        memset(M, 0, (size_t)s->count * sizeof *M);
        for (int32_t h = 0; h < law->count; ++h) {
            if (D[k][h] == 0) continue;
            const double share = D[k][h] / (s->stiffness * law->response), *G = d->G + (size_t)(law->first + h) * (size_t)d->size;
            *right -= share * s->moved[law->first + h];
            for (int32_t c = 0; c < s->count; ++c) M[c] += share * G[s->number[c]];
        }
        for (int32_t c = 0; c < s->count; ++c) {
            const int32_t h = s->number[c] - law->first;
            if (h >= 0 && h < law->count) M[c] += (h == k) - D[k][h];
        }
        M[*row] += s->proximal;
        ++*row;
    }
}

/* M x = right in place, with the largest of each column as its pivot. */
static bool eliminate(double *M, double *x, int32_t count)
{
    const size_t n = (size_t)count;
    for (size_t k = 0; k < n; ++k) {
        double *top = M + k * n;
        size_t best = k;
        for (size_t i = k + 1; i < n; ++i)
            if (fabs(M[i * n + k]) > fabs(M[best * n + k])) best = i;
        if (!(fabs(M[best * n + k]) > 0)) return false;
        if (best != k) {
            double *other = M + best * n, t = x[k];
            x[k] = x[best], x[best] = t;
            for (size_t c = k; c < n; ++c) t = top[c], top[c] = other[c], other[c] = t;
        }
        const double inverse = 1 / top[k];
        for (size_t i = k + 1; i < n; ++i) {
            double *row = M + i * n;
            const double share = row[k] * inverse;
            if (share == 0) continue;
            for (size_t c = k + 1; c < n; ++c) row[c] -= share * top[c];
            x[i] -= share * x[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t c = k + 1; c < n; ++c) x[k] -= M[k * n + c] * x[c];
        x[k] /= M[k * n + k];
    }
    return true;
}

static bool make_step(struct newton *s)
{
    struct direct_dense *d = s->d;
    int32_t row = 0;
    sort_numbers(s);
    for (int32_t i = 0; i < d->laws; ++i) enter_law(s, &d->law[i], &row);
    const double solved_for = s->count, all = d->size;
    d->budget -= solved_for * solved_for * (solved_for / 3 + 4) + 2 * all * all;
    if (!eliminate(s->M, s->right, s->count)) return false;
    for (int32_t r = 0; r < s->count; ++r) s->step[s->number[r]] = s->right[r];
    for (int32_t n = 0; n < d->size; ++n) {
        d->lambda[n] += s->step[n];
        if (s->step[n] != 0) respond(d, n, s->step[n], d->u);
    }
    return true;
}

/* ---- the search -------------------------------------------------------------------------------------------------- */

static void copy(const struct newton *s, const double *lambda, const double *u, double *to_lambda, double *to_u)
{
    memcpy(to_lambda, lambda, (size_t)s->d->size * sizeof *lambda);
    memcpy(to_u, u, (size_t)s->d->size * sizeof *u);
}

/* What the natural map is a share of: the largest speed, m/s, or load times response. */
static double size_of(const struct direct_dense *d)
{
    double size = 0;
    for (int32_t i = 0; i < d->laws; ++i)
        for (int32_t k = 0; k < d->law[i].count; ++k) {
            const int32_t n = d->law[i].first + k;
            size = fmax(size, fmax(fabs(d->u[n]), fabs(d->lambda[n]) * d->law[i].response));
        }
    return size;
}

/* Full steps from the start: on the way to the right pieces the map may grow. Returns the best map, of all ways. */
static double go(struct newton *s, const struct way *way, double size, double best, double enough)
{
    struct direct_dense *d = s->d;
    double map;
    copy(s, s->start_lambda, s->start_u, d->lambda, d->u);
    map = direct_natural_map(d);
    s->stiffness = way->stiffness;
    for (int step = 0; step < way->steps && best > enough && map < HUGE_VAL; ++step) {
        const double share = way->proximal > 0 ? way->proximal * map / size : way->most;
        s->proximal = fmax(LEAST, way->most > 0 ? fmin(way->most, share) : LEAST);
        if (d->budget < 0 || !make_step(s)) return best;
        map = direct_natural_map(d);
        if (!(map < best)) continue;
        best = map;
        copy(s, d->lambda, d->u, s->best_lambda, s->best_u);
    }
    return best;
}

double direct_newton(struct direct_dense *d, double enough)
{
    struct newton s = newton_of(d);
    const double size = size_of(d);
    double best = direct_natural_map(d);
    if (!(best > enough && size < HUGE_VAL)) return best;
    copy(&s, d->lambda, d->u, s.start_lambda, s.start_u);
    copy(&s, d->lambda, d->u, s.best_lambda, s.best_u);
    for (int k = 0; k < WAYS && best > enough; ++k) {
        if (k > 0 && best < NEARLY) break;
        best = go(&s, &ways[k], size, best, enough);
    }
    copy(&s, s.best_lambda, s.best_u, d->lambda, d->u);
    return best;
}
