#include "dense_solve.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/solve/ncp_newton.h"
#include "delassus.h"

/* Multiplications: no search of an island of the largest size comes near; time is what ends it. */
static const double BUDGET = 1e13;

/* ---- islands ----------------------------------------------------------------------------------------------------- */

static int32_t root(int32_t *parent, int32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* label[i]: a body of i's island, the same for all of it. */
static void label_islands(const struct delassus *d, int32_t *label)
{
    for (int32_t i = 0; i < d->bodies; ++i) label[i] = i;
    for (int32_t k = 0; k < d->contacts; ++k) {
        const int32_t a = d->body[2 * (size_t)k], b = d->body[2 * (size_t)k + 1];
        if (a >= 0 && b >= 0) label[root(label, a)] = root(label, b);
    }
    for (int32_t i = 0; i < d->bodies; ++i) label[i] = root(label, i);
}

static int32_t island_of(const struct delassus *d, const int32_t *label, int32_t k)
{
    const int32_t a = d->body[2 * (size_t)k], b = d->body[2 * (size_t)k + 1];
    return label[a >= 0 ? a : b];
}

/* The most contacts of an island; *points (bodies): of each. */
static int32_t count_points(const struct delassus *d, const int32_t *label, int32_t *points)
{
    int32_t most = 0;
    memset(points, 0, (size_t)d->bodies * sizeof *points);
    for (int32_t k = 0; k < d->contacts; ++k) {
        const int32_t count = ++points[island_of(d, label, k)];
        if (count > most) most = count;
    }
    return most;
}

/* ---- one island -------------------------------------------------------------------------------------------------- */

struct work {
    const struct delassus *d;
    const double *mu;
    int32_t *at; /* contacts of the island */
    struct ncp_law *law;
    struct ncp_dense dense;
    double *G;
};

/* Its natural map; r of its contacts. */
static double solve_island(struct work *w, int32_t contacts, double enough, double *r)
{
    const struct delassus *d = w->d;
    const int32_t size = 3 * contacts;
    for (int32_t k = 0; k < contacts; ++k) {
        struct ncp_law *law = &w->law[k];
        *law = (struct ncp_law){.first = 3 * k, .count = 3, .friction = w->mu[w->at[k]]};
        for (int32_t l = 0; l < contacts; ++l) {
            double block[9];
            delassus_block(d, w->at[k], w->at[l], block);
            for (int i = 0; i < 9; ++i)
                w->G[(size_t)(3 * k + i / 3) * (size_t)size + (size_t)(3 * l + i % 3)] = block[i];
        }
        for (int i = 0; i < 3; ++i) {
            const size_t row = (size_t)(3 * k + i);
            if (i == 0 || law->friction > 0) law->response = fmax(law->response, w->G[row * ((size_t)size + 1)]);
            w->dense.u[row] = d->offset[3 * (size_t)w->at[k] + (size_t)i];
            w->dense.lambda[row] = 0;
        }
    }
    w->dense.laws = contacts;
    w->dense.size = size;
    w->dense.law = w->law;
    w->dense.G = w->G;
    w->dense.budget = BUDGET;
    const double map = ncp_newton(&w->dense, enough);
    for (int32_t k = 0; k < contacts; ++k)
        memcpy(r + 3 * (size_t)w->at[k], w->dense.lambda + 3 * (size_t)k, 3 * sizeof *r);
    return map;
}

static sadmm_status solve_islands(const struct delassus *d, const double *mu, double enough, double *r, double *map,
                                  struct sadmm_error *error)
{
    int32_t *label = sadmm_alloc((size_t)d->bodies, sizeof *label),
            *points = sadmm_alloc((size_t)d->bodies, sizeof *points);
    const int32_t most = label && points ? (label_islands(d, label), count_points(d, label, points)) : 0;
    const size_t size = 3 * (size_t)most;
    struct work w = {.d = d,
                     .mu = mu,
                     .at = sadmm_alloc((size_t)most, sizeof *w.at),
                     .law = sadmm_alloc((size_t)most, sizeof *w.law)};
    double *numbers = sadmm_alloc(2 * size + size * size + ncp_work_size(size), sizeof *numbers);
    const bool have = label && points && w.at && w.law && numbers;
    *map = 0;
    for (int32_t i = 0; have && i < d->bodies; ++i) {
        int32_t contacts = 0;
        if (points[i] == 0) continue;
        for (int32_t k = 0; k < d->contacts; ++k)
            if (island_of(d, label, k) == i) w.at[contacts++] = k;
        w.dense.lambda = numbers;
        w.dense.u = numbers + size;
        w.G = numbers + 2 * size;
        w.dense.work = w.G + size * size;
        const double left = solve_island(&w, contacts, enough, r);
        if (!(left <= *map)) *map = left;
    }
    sadmm_free(label);
    sadmm_free(points);
    sadmm_free(w.at);
    sadmm_free(w.law);
    sadmm_free(numbers);
    return have ? SADMM_OK : sadmm_fail_memory(error, "the islands of a problem");
}

/* ---- the problem ------------------------------------------------------------------------------------------------- */

bool dense_solve_takes(sadmm_problem *problem)
{
    struct sadmm_global_problem g;
    struct delassus d;
    struct sadmm_error error = {SADMM_OK, ""};
    if (sadmm_global_from_problem(problem, &g, &error) != SADMM_OK) return false;
    const bool made = delassus_make(&g, &d, &error) == SADMM_OK;
    int32_t most = INT32_MAX;
    if (made) {
        int32_t *label = sadmm_alloc(2 * (size_t)d.bodies, sizeof *label);
        if (label) {
            label_islands(&d, label);
            most = count_points(&d, label, label + d.bodies);
        }
        sadmm_free(label);
        delassus_free(&d);
    }
    sadmm_global_problem_free(&g);
    return most <= SADMM_MOST_NCP_POINTS;
}

sadmm_status dense_solve(const struct sadmm_global_problem *global, double enough, double *r, double *v, double *map,
                         struct sadmm_error *error)
{
    struct delassus d;
    TRY(delassus_make(global, &d, error));
    const sadmm_status status = solve_islands(&d, global->mu, enough, r, map, error);
    if (status == SADMM_OK) delassus_velocities(&d, global->f, r, v);
    delassus_free(&d);
    return status;
}
