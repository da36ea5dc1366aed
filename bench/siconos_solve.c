/* subadmm-siconos: one solve of an FCLIB problem by a solver of siconos, for `subadmm-bench profile`, which runs it in
 * a process of its own: what it links with starts threads, and some of its solvers abort.
 *
 *     subadmm-siconos --list                      the solvers, one a line
 *     subadmm-siconos FILE.hdf5 SOLVER TOLERANCE SECONDS
 *
 * writes struct solve_head, r (contacts x 3) and v (bodies x 6) to standard output, binary. The time is
 * the best of the solves that fit into SECONDS, and of one. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <GlobalFrictionContactProblem.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsSparseMatrix.h>
#include <SolverOptions.h>
#include <SparseBlockMatrix.h>

#include "delassus.h"
#include "fclib/fclib.h"
#include "solve_result.h"

/* Solvers of the global problem, and of the Delassus form, which is made here: rigid bodies are taken out one by one,
 * while those of siconos with "wr" in their name take out all at once. Left out: IPM, which solves the convex problem
 * without the coupling of sliding and normal velocity; NSGSV and VI solvers with wr, which are not written for sparse
 * matrices; the global NSGS, which does not end. */
static const struct {
    const char *name;
    int id;
} solvers[] = {
    {"nsgs", SICONOS_FRICTION_3D_NSGS},
    {"nsn_ac", SICONOS_FRICTION_3D_NSN_AC},
    {"prox", SICONOS_FRICTION_3D_PROX},
    {"admm", SICONOS_FRICTION_3D_ADMM},
    {"tresca", SICONOS_FRICTION_3D_TFP},
    {"acl", SICONOS_FRICTION_3D_ACLMFP},
    {"extragradient", SICONOS_FRICTION_3D_VI_EG},
    {"global_nsgs_wr", SICONOS_GLOBAL_FRICTION_3D_NSGS_WR},
    {"global_admm", SICONOS_GLOBAL_FRICTION_3D_ADMM},
    {"global_nsn_ac", SICONOS_GLOBAL_FRICTION_3D_NSN_AC},
};
enum { SOLVERS = sizeof solvers / sizeof *solvers };

static void stop(const char *message)
{
    fprintf(stderr, "subadmm-siconos: %s\n", message);
    exit(1);
}

static void *have(void *block)
{
    if (!block) stop("out of memory");
    return block;
}

static double *zeros(size_t count) { return have(calloc(count ? count : 1, sizeof(double))); }

/* siconos frees it. */
static double *copy(const double *x, size_t count)
{
    double *out = zeros(count);
    memcpy(out, x, count * sizeof *out);
    return out;
}

static double norm(const double *x, size_t count)
{
    double sum = 0;
    for (size_t k = 0; k < count; ++k) sum += x[k] * x[k];
    return sqrt(sum);
}

struct solution {
    struct solve_head head;
    double *r, *u, *v;
};

/* ---- the global problem ------------------------------------------------------------------------------------------ */

static NumericsMatrix *make_matrix(const struct sadmm_triplets *m)
{
    NumericsMatrix *out = NM_create(NM_SPARSE, m->rows, m->columns);
    NM_triplet_alloc(out, (CS_INT)m->count);
    for (size_t e = 0; e < m->count; ++e) NM_entry(out, m->row[e], m->column[e], m->value[e]);
    return out;
}

static int solve_global(const struct sadmm_global_problem *g, SolverOptions *options, struct solution *x)
{
    GlobalFrictionContactProblem *s = globalFrictionContactProblem_new();
    s->dimension = 3;
    s->numberOfContacts = g->contacts;
    s->M = make_matrix(&g->M);
    s->H = make_matrix(&g->H);
    s->q = copy(g->f, 6 * (size_t)g->bodies);
    s->b = copy(g->w, 3 * (size_t)g->contacts);
    s->mu = copy(g->mu, (size_t)g->contacts);
    s->norm_q = norm(s->q, 6 * (size_t)g->bodies);
    s->norm_b = norm(s->b, 3 * (size_t)g->contacts);
    const struct solve_clock begin = solve_clock_now();
    const int info = gfc3d_driver(s, x->r, x->u, x->v, options);
    x->head.seconds = solve_clock_since(begin);
    globalFrictionContact_free(s);
    return info;
}

/* ---- the Delassus form ------------------------------------------------------------------------------------------- */

/* W, as siconos' own programs for rigid bodies store it; siconos frees it. */
static NumericsMatrix *make_delassus(const struct delassus *d)
{
    const size_t contacts = (size_t)d->contacts;
    int32_t *row = have(calloc((size_t)delassus_most_in_row(d), sizeof *row));
    SparseBlockStructuredMatrix *W = SBM_new();
    size_t count = 0;
    for (int32_t k = 0; k < d->contacts; ++k) count += (size_t)delassus_row(d, k, row);
    W->nbblocks = (unsigned)count;
    W->block = have(calloc(count, sizeof *W->block));
    W->blocknumber0 = W->blocknumber1 = (unsigned)d->contacts;
    W->blocksize0 = have(calloc(contacts, sizeof *W->blocksize0));
    W->blocksize1 = have(calloc(contacts, sizeof *W->blocksize1));
    W->filled1 = contacts + 1;
    W->filled2 = count;
    W->index1_data = have(calloc(contacts + 1, sizeof *W->index1_data));
    W->index2_data = have(calloc(count, sizeof *W->index2_data));
    count = 0;
    for (int32_t k = 0; k < d->contacts; ++k) {
        const int32_t in_row = delassus_row(d, k, row);
        W->blocksize0[k] = W->blocksize1[k] = 3 * ((unsigned)k + 1);
        for (int32_t n = 0; n < in_row; ++n) {
            double block[9], *to = zeros(9);
            delassus_block(d, k, row[n], block);
            for (int i = 0; i < 9; ++i) to[i] = block[3 * (i % 3) + i / 3]; /* by columns */
            W->index2_data[count] = (size_t)row[n];
            W->block[count++] = to;
        }
        W->index1_data[k + 1] = count;
    }
    free(row);
    NumericsMatrix *out = NM_new();
    out->storageType = NM_SPARSE_BLOCK;
    out->size0 = out->size1 = 3 * d->contacts;
    out->matrix1 = W;
    return out;
}

/* The time includes the way to the form and back: the global solvers and ours have no need of it. */
static int solve_local(const struct sadmm_global_problem *g, SolverOptions *options, struct solution *x)
{
    struct delassus d;
    struct sadmm_error error = {SADMM_OK, ""};
    const struct solve_clock begin = solve_clock_now();
    if (delassus_make(g, &d, &error) != SADMM_OK) stop(error.message);
    FrictionContactProblem *s = frictionContactProblem_new_with_data(
        3, d.contacts, make_delassus(&d), copy(d.offset, 3 * (size_t)d.contacts), copy(g->mu, (size_t)d.contacts));
    const int info = fc3d_driver(s, x->r, x->u, options);
    delassus_velocities(&d, g->f, x->r, x->v);
    x->head.seconds = solve_clock_since(begin);
    frictionContactProblem_free(s);
    delassus_free(&d);
    return info;
}

/* ---- the program ------------------------------------------------------------------------------------------------- */

static void solve(const struct sadmm_global_problem *g, int id, double tolerance, struct solution *x)
{
    SolverOptions *options = solver_options_create(id);
    options->iparam[SICONOS_IPARAM_MAX_ITER] = 100000000; /* time is what ends it */
    options->dparam[SICONOS_DPARAM_TOL] = tolerance;
    memset(x->r, 0, 3 * (size_t)g->contacts * sizeof *x->r);
    memset(x->u, 0, 3 * (size_t)g->contacts * sizeof *x->u);
    memset(x->v, 0, 6 * (size_t)g->bodies * sizeof *x->v);
    x->head.unsolved =
        id < SICONOS_GLOBAL_FRICTION_3D_NSGS_WR ? solve_local(g, options, x) : solve_global(g, options, x);
    x->head.iterations = options->iparam[SICONOS_IPARAM_ITER_DONE];
    solver_options_delete(options);
}

static void solve_in(const struct sadmm_global_problem *g, int id, double tolerance, double time, FILE *out)
{
    struct solution x = {
        .r = zeros(3 * (size_t)g->contacts), .u = zeros(3 * (size_t)g->contacts), .v = zeros(6 * (size_t)g->bodies)};
    const struct solve_clock begin = solve_clock_now();
    double best = INFINITY;
    for (int k = 0; solve_again(k, begin, best, time); ++k) {
        solve(g, id, tolerance, &x);
        best = fmin(best, x.head.seconds);
    }
    x.head.seconds = best;
    fwrite(&x.head, sizeof x.head, 1, out);
    fwrite(x.r, sizeof *x.r, 3 * (size_t)g->contacts, out);
    fwrite(x.v, sizeof *x.v, 6 * (size_t)g->bodies, out);
    if (fclose(out) != 0) stop("the result could not be written");
}

int main(int argc, char **argv)
{
    sadmm_problem *problem;
    struct sadmm_global_problem g;
    struct sadmm_error error = {SADMM_OK, ""};
    if (argc == 2 && !strcmp(argv[1], "--list")) {
        for (int k = 0; k < SOLVERS; ++k) puts(solvers[k].name);
        return 0;
    }
    if (argc != 5) stop("usage: subadmm-siconos --list | FILE.hdf5 SOLVER TOLERANCE SECONDS");
    int solver = 0;
    while (solver < SOLVERS && strcmp(argv[2], solvers[solver].name) != 0) ++solver;
    if (solver == SOLVERS) stop("no such solver");
    /* siconos prints on standard output. */
    FILE *out = fdopen(dup(STDOUT_FILENO), "wb");
    if (!out || !freopen("/dev/null", "w", stdout)) stop("standard output");
    if (sadmm_fclib_load(argv[1], &problem, &error) != SADMM_OK ||
        sadmm_global_from_problem(problem, &g, &error) != SADMM_OK)
        stop(error.message);
    if (g.hard_rows > 0) stop("bilateral rows: must have none");
    solve_in(&g, solvers[solver].id, atof(argv[3]), atof(argv[4]), out);
    sadmm_global_problem_free(&g);
    sadmm_problem_destroy(problem);
    return 0;
}
