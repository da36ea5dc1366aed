#include "reference_solution.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/dense6.h"
#include "core/math/vec3.h"
#include "problem_set.h"

enum { SWEEPS = 300, PROXIMAL = 60, NEWTON = 40, HALVINGS = 12 };
#define FOUND 1e-12 /* m/s */

/* Consecutive unknowns with one law. */
struct unit {
    bool contact;   /* normal, two tangents; else one row */
    int first;      /* of its unknowns */
    double friction;
    double error, gain, compliance, lower, upper; /* contact: error along the normal */
    double step;    /* r */
};

struct system {
    int n, units;       /* unknowns */
    struct unit *unit;
    int32_t (*body)[2]; /* of each unknown */
    double (*row)[12];  /* its row of J: on bodies a and b */
    double *A, *L, *b;  /* bodies x 36, their Cholesky factors, bodies x 6 */
    double *W, *q;      /* n x n, n */
    double *M;          /* n x n, Newton's matrix */
    double *z, *before, *x, *f, *trial, *step;
    double shift;       /* a of the proximal step, as a share of W's diagonal */
};

static double *take(double **at, size_t count)
{
    double *out = *at;
    *at += count;
    return out;
}

/* ---- the system ------------------------------------------------------------------------------------------------ */

static int unknowns_of(const sadmm_problem *problem)
{
    const int64_t most = 3 * (int64_t)sadmm_problem_contact_count(problem) +
                         6 * (int64_t)sadmm_problem_block_count(problem);
    return most > REFERENCE_MOST ? REFERENCE_MOST + 1 : (int)most;
}

bool reference_fits(const sadmm_problem *problem)
{
    const int n = unknowns_of(problem);
    return n > 0 && n <= REFERENCE_MOST;
}

static void point_row(double row[6], vec3 direction, const double arm[3], double sign)
{
    v3_store(v3_scale(direction, sign), row);
    v3_store(v3_scale(v3_cross(v3_load(arm), direction), sign), row + 3);
}

static void add_contact(struct system *s, const sadmm_problem_contact *c)
{
    vec3 axes[3] = {v3_load(c->normal), {0, 0, 0}, {0, 0, 0}};
    v3_tangents(axes[0], &axes[1], &axes[2]);
    s->unit[s->units++] = (struct unit){.contact = true, .first = s->n, .friction = c->friction, .error = c->error};
    for (int k = 0; k < 3; ++k, ++s->n) {
        s->body[s->n][0] = c->body_a;
        s->body[s->n][1] = c->body_b;
        memset(s->row[s->n], 0, sizeof s->row[s->n]);
        if (c->body_a >= 0) point_row(s->row[s->n], axes[k], c->arm_a, -1);
        if (c->body_b >= 0) point_row(s->row[s->n] + 6, axes[k], c->arm_b, 1);
        s->q[s->n] = v3_dot(axes[k], v3_load(c->velocity));
    }
}

static void add_block(struct system *s, const sadmm_problem_block *b)
{
    const bool contact = b->kind == SADMM_BLOCK_CONTACT;
    if (contact)
        s->unit[s->units++] =
            (struct unit){.contact = true, .first = s->n, .friction = b->friction, .error = b->error[0]};
    for (int k = 0; k < b->rows; ++k, ++s->n) {
        struct unit one = {.first = s->n, .error = b->error[k], .gain = 1, .lower = -INFINITY, .upper = INFINITY};
        if (b->kind == SADMM_BLOCK_SOFT) { /* lambda = -(k e + c x) */
            one.error = b->stiffness[k] * b->error[k];
            one.gain = b->damping[k];
            one.compliance = 1;
        } else if (b->kind == SADMM_BLOCK_ROWS) {
            one.gain = b->gain[k];
            one.compliance = b->compliance[k];
            one.lower = b->lower[k];
            one.upper = b->upper[k];
        }
        if (!contact) s->unit[s->units++] = one;
        s->body[s->n][0] = b->body_a;
        s->body[s->n][1] = b->body_b;
        memcpy(s->row[s->n], b->jacobian_a + 6 * k, 6 * sizeof(double));
        memcpy(s->row[s->n] + 6, b->jacobian_b + 6 * k, 6 * sizeof(double));
        s->q[s->n] = 0;
    }
}

static double dot6(const double *a, const double *b)
{
    double sum = 0;
    for (int k = 0; k < 6; ++k) sum += a[k] * b[k];
    return sum;
}

/* W, and q = J A^-1 b and what contacts have of it. */
static void multiply(struct system *s)
{
    for (int i = 0; i < s->n; ++i) {
        double response[12] = {0};
        for (int side = 0; side < 2; ++side) {
            const int32_t body = s->body[i][side];
            if (body >= 0) dense6_solve(s->L + 36 * (size_t)body, s->row[i] + 6 * side, response + 6 * side);
        }
        for (int j = 0; j < s->n; ++j) {
            double sum = 0;
            for (int here = 0; here < 2; ++here)
                for (int there = 0; there < 2; ++there)
                    if (s->body[i][here] >= 0 && s->body[i][here] == s->body[j][there])
                        sum += dot6(response + 6 * here, s->row[j] + 6 * there);
            s->W[(size_t)i * (size_t)s->n + (size_t)j] = sum;
        }
        for (int side = 0; side < 2; ++side)
            if (s->body[i][side] >= 0) s->q[i] += dot6(response + 6 * side, s->b + 6 * s->body[i][side]);
    }
    for (int u = 0; u < s->units; ++u) {
        struct unit *one = &s->unit[u];
        double most = 0;
        for (int k = 0; k < (one->contact ? 3 : 1); ++k) {
            const size_t at = (size_t)(one->first + k);
            most = fmax(most, s->W[at * (size_t)s->n + at]);
        }
        if (!one->contact) most = one->gain * most + one->compliance;
        one->step = most > 0 ? 1 / most : 1;
    }
}

static sadmm_status gather(struct system *s, sadmm_problem *problem)
{
    sadmm_status status = sadmm_problem_get_bodies(problem, s->A, s->b, NULL);
    for (int32_t i = 0; i < sadmm_problem_body_count(problem); ++i)
        dense6_cholesky(s->A + 36 * (size_t)i, s->L + 36 * (size_t)i);
    for (int32_t k = 0; k < sadmm_problem_contact_count(problem) && status == SADMM_OK; ++k) {
        sadmm_problem_contact contact;
        status = sadmm_problem_get_contact(problem, k, &contact);
        if (status == SADMM_OK) add_contact(s, &contact);
    }
    for (int32_t k = 0; k < sadmm_problem_block_count(problem) && status == SADMM_OK; ++k) {
        sadmm_problem_block block;
        status = sadmm_problem_get_block(problem, k, &block);
        if (status == SADMM_OK) add_block(s, &block);
    }
    if (status == SADMM_OK) multiply(s);
    return status;
}

/* ---- laws ------------------------------------------------------------------------------------------------------ */

/* A unit's function at its z and x, and its derivatives by z (P) and x (Q), 3 x 3 or 1 x 1 in the corner. */
static void law(const struct unit *u, const double *z, const double *x, double *f, double P[9], double Q[9])
{
    memset(P, 0, 9 * sizeof *P);
    memset(Q, 0, 9 * sizeof *Q);
    if (!u->contact) {
        const double y = z[0] - u->step * (u->gain * x[0] + u->error + u->compliance * z[0]);
        const bool free = y > u->lower && y < u->upper;
        f[0] = z[0] - fmin(fmax(y, u->lower), u->upper);
        P[0] = free ? u->step * u->compliance : 1;
        Q[0] = free ? u->step * u->gain : 0;
        return;
    }
    const double r = u->step, yn = z[0] - r * (x[0] + u->error), limit = u->friction * fmax(yn, 0);
    const double y[2] = {z[1] - r * x[1], z[2] - r * x[2]}, length = hypot(y[0], y[1]);
    const bool pressed = yn > 0;
    f[0] = z[0] - fmax(yn, 0);
    P[0] = pressed ? 0 : 1;
    Q[0] = pressed ? r : 0;
    if (length <= limit) { /* sticks */
        for (int k = 0; k < 2; ++k) {
            f[1 + k] = z[1 + k] - y[k];
            Q[4 * (1 + k)] = r;
        }
        return;
    }
    for (int k = 0; k < 2; ++k) {
        const double way = length > 0 ? y[k] / length : 0;
        f[1 + k] = z[1 + k] - limit * way;
        P[4 * (1 + k)] = 1;
        if (!pressed) continue;
        P[3 * (1 + k)] = -u->friction * way;
        Q[3 * (1 + k)] = r * u->friction * way;
        for (int j = 0; j < 2; ++j) { /* of limit y / |y| */
            const double turn = limit / length * ((k == j) - way * y[j] / length);
            P[3 * (1 + k) + 1 + j] -= turn;
            Q[3 * (1 + k) + 1 + j] += r * turn;
        }
    }
}

/* x of z, in the proximal step. */
static void respond(const struct system *s, const double *z, double *x)
{
    for (int i = 0; i < s->n; ++i) {
        const double *w = s->W + (size_t)i * (size_t)s->n;
        double sum = s->q[i] + s->shift * w[i] * (z[i] - s->before[i]);
        for (int j = 0; j < s->n; ++j) sum += w[j] * z[j];
        x[i] = sum;
    }
}

/* The functions' norm, each as a velocity. */
static double measure(const struct system *s, const double *z, double *x, double *f)
{
    double P[9], Q[9], sum = 0;
    respond(s, z, x);
    for (int u = 0; u < s->units; ++u) {
        const struct unit *one = &s->unit[u];
        law(one, z + one->first, x + one->first, f + one->first, P, Q);
        for (int k = 0; k < (one->contact ? 3 : 1); ++k) sum += pow(f[one->first + k] / one->step, 2);
    }
    return sqrt(sum);
}

/* ---- Newton's steps -------------------------------------------------------------------------------------------- */

/* M <- P + Q (W + shift). */
static void differentiate(struct system *s)
{
    const size_t n = (size_t)s->n;
    double P[9], Q[9], f[3];
    for (int u = 0; u < s->units; ++u) {
        const struct unit *one = &s->unit[u];
        const int size = one->contact ? 3 : 1;
        law(one, s->z + one->first, s->x + one->first, f, P, Q);
        for (int k = 0; k < size; ++k) {
            double *row = s->M + ((size_t)one->first + (size_t)k) * n;
            memset(row, 0, n * sizeof *row);
            for (int j = 0; j < size; ++j) {
                const double by = Q[3 * k + j];
                const double *w = s->W + ((size_t)one->first + (size_t)j) * n;
                if (by != 0)
                    for (size_t c = 0; c < n; ++c) row[c] += by * w[c];
                row[one->first + j] += by * s->shift * w[one->first + j] + P[3 * k + j];
            }
        }
    }
}

/* M step = -f, by elimination with the largest pivot of the column; false: singular. */
static bool eliminate(struct system *s)
{
    const size_t n = (size_t)s->n;
    for (size_t i = 0; i < n; ++i) s->step[i] = -s->f[i];
    for (size_t c = 0; c < n; ++c) {
        size_t pivot = c;
        for (size_t i = c + 1; i < n; ++i)
            if (fabs(s->M[i * n + c]) > fabs(s->M[pivot * n + c])) pivot = i;
        if (s->M[pivot * n + c] == 0) return false;
        if (pivot != c) {
            for (size_t j = c; j < n; ++j) {
                const double kept = s->M[c * n + j];
                s->M[c * n + j] = s->M[pivot * n + j];
                s->M[pivot * n + j] = kept;
            }
            const double kept = s->step[c];
            s->step[c] = s->step[pivot];
            s->step[pivot] = kept;
        }
        for (size_t i = c + 1; i < n; ++i) {
            const double factor = s->M[i * n + c] / s->M[c * n + c];
            if (factor == 0) continue;
            for (size_t j = c + 1; j < n; ++j) s->M[i * n + j] -= factor * s->M[c * n + j];
            s->step[i] -= factor * s->step[c];
        }
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t j = i + 1; j < n; ++j) s->step[i] -= s->M[i * n + j] * s->step[j];
        s->step[i] /= s->M[i * n + i];
    }
    return true;
}

/* The proximal step's problem; false: not solved. */
static bool newton(struct system *s, double tolerance)
{
    double norm = measure(s, s->z, s->x, s->f);
    for (int k = 0; k < NEWTON && norm > tolerance; ++k) {
        differentiate(s);
        if (!eliminate(s)) return false;
        double share = 1, best = norm;
        for (int h = 0; h < HALVINGS; ++h, share /= 2) {
            for (int i = 0; i < s->n; ++i) s->trial[i] = s->z[i] + share * s->step[i];
            best = measure(s, s->trial, s->x, s->f);
            if (best < norm) break;
        }
        /* Where the functions have a kink a step may have to go up before it goes down. */
        memcpy(s->z, s->trial, (size_t)s->n * sizeof *s->z);
        norm = best;
    }
    return norm <= 1e-6;
}

/* Each unit by itself, some times, one after the other. */
static void sweep(struct system *s, int count)
{
    double P[9], Q[9], f[3];
    const size_t n = (size_t)s->n;
    while (count-- > 0)
        for (int u = 0; u < s->units; ++u) {
            const struct unit *one = &s->unit[u];
            const int size = one->contact ? 3 : 1;
            for (int k = 0; k < size; ++k) {
                const double *w = s->W + ((size_t)one->first + (size_t)k) * n;
                s->x[one->first + k] = s->q[one->first + k];
                for (size_t j = 0; j < n; ++j) s->x[one->first + k] += w[j] * s->z[j];
            }
            law(one, s->z + one->first, s->x + one->first, f, P, Q);
            for (int k = 0; k < size; ++k) s->z[one->first + k] -= f[k];
        }
}

/* ---- the solution ---------------------------------------------------------------------------------------------- */

static sadmm_status give(const struct system *s, sadmm_problem *problem, double *impulses, double *lambda,
                         struct sadmm_error *error)
{
    const int32_t contacts = sadmm_problem_contact_count(problem), blocks = sadmm_problem_block_count(problem);
    const double *z = s->z;
    sadmm_status status = SADMM_OK;
    for (int32_t k = 0; k < contacts && status == SADMM_OK; ++k, z += 3) {
        sadmm_problem_contact contact;
        vec3 t1, t2;
        status = sadmm_problem_get_contact(problem, k, &contact);
        if (status != SADMM_OK) break;
        const vec3 normal = v3_load(contact.normal);
        v3_tangents(normal, &t1, &t2);
        v3_store(v3_add(v3_scale(normal, z[0]), v3_add(v3_scale(t1, z[1]), v3_scale(t2, z[2]))), impulses + 3 * k);
    }
    for (int32_t k = 0; k < blocks && status == SADMM_OK; ++k) {
        sadmm_problem_block block;
        status = sadmm_problem_get_block(problem, k, &block);
        if (status == SADMM_OK)
            for (int r = 0; r < 6; ++r) lambda[6 * k + r] = r < block.rows ? *z++ : 0;
    }
    if (status == SADMM_OK) status = sadmm_problem_set_solution(problem, NULL, impulses, lambda);
    return status == SADMM_OK ? problem_set_balance(problem, error) : status;
}

/* Proximal steps until the library's certificate finds no error. */
static sadmm_status approach(struct system *s, sadmm_problem *problem, double *impulses, double *lambda, double *found,
                             struct sadmm_error *error)
{
    sadmm_certificate certificate = {.ncp_max = INFINITY};
    sadmm_status status = SADMM_OK;
    sweep(s, SWEEPS);
    for (int k = 0; k < PROXIMAL && certificate.ncp_max > FOUND && status == SADMM_OK; ++k) {
        memcpy(s->before, s->z, (size_t)s->n * sizeof *s->z);
        s->shift = fmax(1e-2 * pow(0.4, k), 1e-9);
        if (!newton(s, FOUND / 100)) sweep(s, SWEEPS);
        status = give(s, problem, impulses, lambda, error);
        if (status == SADMM_OK) status = sadmm_problem_certify(problem, &certificate);
    }
    *found = certificate.ncp_max;
    return status;
}

static sadmm_status solve(sadmm_problem *problem, struct system *s, struct reference_solution *out,
                          struct sadmm_error *error)
{
    const size_t n = (size_t)unknowns_of(problem), bodies = (size_t)out->bodies,
                 contacts = (size_t)sadmm_problem_contact_count(problem),
                 blocks = (size_t)sadmm_problem_block_count(problem);
    double *memory = sadmm_alloc(2 * n * n + 8 * n + 42 * bodies + 3 * contacts + 6 * blocks, sizeof *memory);
    s->unit = sadmm_alloc(n, sizeof *s->unit);
    s->body = sadmm_alloc(n, sizeof *s->body);
    s->row = sadmm_alloc(n, sizeof *s->row);
    sadmm_status status = sadmm_fail_memory(error, "the reference solution");
    if (memory && s->unit && s->body && s->row) {
        double *at = memory;
        s->W = take(&at, n * n);
        s->M = take(&at, n * n);
        double **const vectors[] = {&s->q, &s->z, &s->before, &s->x, &s->f, &s->trial, &s->step};
        for (size_t k = 0; k < sizeof vectors / sizeof *vectors; ++k) *vectors[k] = take(&at, n);
        s->L = take(&at, 36 * bodies);
        s->b = take(&at, 6 * bodies);
        s->A = out->A;
        double *impulses = take(&at, 3 * contacts), *lambda = at;
        status = gather(s, problem);
        if (status == SADMM_OK) status = approach(s, problem, impulses, lambda, &out->error, error);
        if (status != SADMM_OK) status = sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
    }
    sadmm_free(s->row);
    sadmm_free(s->body);
    sadmm_free(s->unit);
    sadmm_free(memory);
    return status;
}

sadmm_status reference_solve(sadmm_problem *problem, struct reference_solution *out, struct sadmm_error *error)
{
    struct system s = {0};
    *out = (struct reference_solution){.bodies = sadmm_problem_body_count(problem), .error = INFINITY};
    out->A = sadmm_alloc((size_t)out->bodies, 36 * sizeof *out->A);
    out->velocities = sadmm_alloc((size_t)out->bodies, 6 * sizeof *out->velocities);
    sadmm_status status = out->A && out->velocities ? solve(problem, &s, out, error)
                                                    : sadmm_fail_memory(error, "the reference solution");
    if (status == SADMM_OK) status = sadmm_problem_get_solution(problem, out->velocities, NULL, NULL);
    for (int i = 0; i < out->bodies && out->A; ++i) out->mass += out->A[36 * (size_t)i];
    if (status != SADMM_OK) reference_free(out);
    else if (!(out->error <= FOUND)) {
        sadmm_free(out->velocities);
        out->velocities = NULL;
    }
    return status;
}

double reference_distance(const struct reference_solution *reference, const double *velocities)
{
    double energy = 0;
    for (int i = 0; i < reference->bodies; ++i) {
        const double *A = reference->A + 36 * (size_t)i;
        double d[6];
        for (int k = 0; k < 6; ++k) d[k] = velocities[6 * i + k] - reference->velocities[6 * i + k];
        for (int k = 0; k < 6; ++k) energy += d[k] * dot6(A + 6 * k, d);
    }
    return sqrt(fmax(energy, 0) / reference->mass);
}

void reference_free(struct reference_solution *reference)
{
    sadmm_free(reference->A);
    sadmm_free(reference->velocities);
    reference->A = reference->velocities = NULL;
}
