#include "certificate.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/math/dense6.h"
#include "core/math/row.h"
#include "core/base/memory.h"
#include "core/model/system_math.h"

/* A body in the workspace: Cholesky factor of A (36), J^T lambda (6). */
enum { FACTOR = 0, IMPULSE = 36, BODY_SIZE = 42 };

/* Norms and maxima gathered on the way. Squares are of numbers times `unit`, a power of two: 1, or so small that none
 * overflows whose root is a number. */
struct tally {
    double unit;
    double ncp_max, ncp_sum;
    int64_t ncp_worst, count;
    double *contact_errors; /* by point */
    double u2, r2, map2; /* siconos: |u|^2, |r|^2, |r - P_K(r - u^)|^2 */
    bool outside; /* rows that siconos does not have */
};
static const double SMALL_UNIT = 0x1p-600;

/* A NaN does: a solution that is not finite must not look good. */
static bool exceeds(double x, double best) { return !(x <= best); }

static double max_abs6(const double x[6])
{
    double m = 0;
    for (int i = 0; i < 6; ++i) m = keep_max(m, fabs(x[i]));
    return m;
}

static void count_constraint(struct tally *t, int64_t index, double error)
{
    if (t->ncp_worst < 0 || (exceeds(error, t->ncp_max) && !isnan(t->ncp_max))) {
        t->ncp_max = error;
        t->ncp_worst = index;
    }
    t->ncp_sum += error;
    ++t->count;
}

static double square(const struct tally *t, double x) { return (t->unit * x) * (t->unit * x); }

static double square6(const struct tally *t, const double x[6])
{
    double sum = 0;
    for (int i = 0; i < 6; ++i) sum += square(t, x[i]);
    return sum;
}

/* Diagonal entry J A^-1 J^T of one row on one body: |L^-1 J^T|^2. */
static double row_weight(const double *body, const double row[6])
{
    double y[6];
    dense6_forward(body + FACTOR, row, y);
    return dense6_dot(y, y);
}

static void add_impulse(double *body, const double row[6], double lambda)
{
    for (int i = 0; i < 6; ++i) body[IMPULSE + i] += row[i] * lambda;
}

/* Euclidean projection on the Coulomb cone |t| <= mu n: this one is siconos' K, not the local solver's. */
static void project_cone(const double r[3], double mu, double out[3])
{
    double t = hypot(r[1], r[2]);
    if (mu * t <= -r[0]) {
        out[0] = out[1] = out[2] = 0;
    } else if (t <= mu * r[0]) {
        memcpy(out, r, 3 * sizeof *out);
    } else {
        double n = (mu * t + r[0]) / (mu * mu + 1), s = mu * n / t;
        out[0] = n, out[1] = s * r[1], out[2] = s * r[2];
    }
}

/* One contact in its frame: lambda and u = x + e, rows (n, t, t). */
static double contact_map(struct tally *tally, const double lambda[3], const double u[3], double mu, double w)
{
    double residual[3], p[3], error2 = 0;
    contact_residual_rows(lambda, u, mu, w, residual);
    for (int i = 0; i < 3; ++i) error2 += square(tally, residual[i]);

    /* siconos' fc3d_unitary_compute_and_add_error: natural map with rho = 1 of the modified velocity. */
    double modified[3] = {lambda[0] - u[0] - mu * hypot(u[1], u[2]), lambda[1] - u[1], lambda[2] - u[2]};
    project_cone(modified, mu, p);
    for (int i = 0; i < 3; ++i) {
        tally->u2 += square(tally, u[i]);
        tally->r2 += square(tally, lambda[i]);
        tally->map2 += square(tally, lambda[i] - p[i]);
    }
    return sqrt(error2) / tally->unit * w;
}

static void certify_pair(struct tally *tally, const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, double *bodies)
{
    mat3 frame = sadmm_contact_frame(pair->normal);
    int rows = pair->friction > 0 ? 3 : 1;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct sadmm_contact_point *point = &system->contacts->points[k];
        vec3 lambda = m3_mul(frame, v3_load(point->impulse));
        vec3 x = m3_mul(frame, sadmm_contact_velocity(system, pair, point));
        const double l[3] = {lambda.x, lambda.y, lambda.z};
        const double u[3] = {x.x + sadmm_contact_e(system, settings, pair, &system->contacts->points[pair->first],
                                                     k - pair->first), x.y, x.z};
        double weight[3] = {0, 0, 0};
        for (int side = 0; side < 2; ++side) {
            int32_t index = side ? pair->body_b : pair->body_a;
            if (index < 0) continue;
            double *body = bodies + BODY_SIZE * (size_t)index;
            for (int i = 0; i < 3; ++i) {
                double row[6];
                sadmm_contact_row(frame.r[i], side ? point->arm_b : point->arm_a, side ? 1 : -1, row);
                if (i < rows) weight[i] += row_weight(body, row);
                add_impulse(body, row, l[i]);
            }
        }
        double w = fmax(weight[0], fmax(weight[1], weight[2]));
        tally->contact_errors[k] = contact_map(tally, l, u, pair->friction, w);
        count_constraint(tally, k, tally->contact_errors[k]);
    }
}

/* The natural map of a scalar row whose own response is w > 0. */
static double row_map(struct tally *tally, const struct sadmm_rows *rows, size_t r, double x, double w)
{
    const double lambda = rows->lambda[r], gain = rows->gain[r], compliance = rows->compliance[r];
    const double residual = row_residual(gain, rows->bias[r], compliance, x, lambda);
    if (sadmm_row_is_coupled(rows, r)) { /* K is the whole line for a hard row: r - P_K(r - u) = u. */
        tally->u2 += square(tally, residual);
        tally->r2 += square(tally, lambda);
        tally->map2 += square(tally, residual);
    }
    return row_natural_map(gain, rows->bias[r], compliance, rows->lo[r], rows->hi[r], x, lambda, w);
}

static void certify_rows(struct tally *tally, const struct sadmm_system *system, size_t k, double *bodies)
{
    const struct sadmm_rows *rows = system->rows;
    const struct sadmm_row_constraint *constraint = &rows->constraints[k];
    const size_t first = (size_t)constraint->first;
    double x[SADMM_MAX_ROWS] = {0}, weight[SADMM_MAX_ROWS] = {0};
    for (int side = 0; side < 2; ++side) {
        int32_t index = side ? constraint->body_b : constraint->body_a;
        if (index < 0) continue;
        const double *jacobian = (side ? rows->jacobian_b : rows->jacobian_a) + 6 * first;
        double *body = bodies + BODY_SIZE * (size_t)index;
        for (int r = 0; r < constraint->count; ++r) {
            const double *row = jacobian + 6 * r;
            x[r] += dense6_dot(row, system->velocity + 6 * (size_t)index);
            weight[r] += row_weight(body, row);
            add_impulse(body, row, rows->lambda[first + (size_t)r]);
        }
    }

    double error = 0;
    if (constraint->cone) {
        const double *e = rows->bias + first;
        double u[3] = {x[0] + e[0], x[1] + e[1], x[2] + e[2]};
        double w = constraint->friction > 0 ? fmax(weight[0], fmax(weight[1], weight[2])) : weight[0];
        error = contact_map(tally, rows->lambda + first, u, constraint->friction, w);
    } else {
        for (int r = 0; r < constraint->count; ++r) {
            tally->outside = tally->outside || !sadmm_row_is_coupled(rows, first + (size_t)r);
            if (weight[r] != 0) /* rows that nobody feels do not count */
                error = keep_max(error, row_map(tally, rows, first + (size_t)r, x[r], weight[r]));
        }
    }
    count_constraint(tally, (int64_t)(system->contacts->point_count + k), error);
}

/* Of two sums of squares. siconos divides only by norms above this (gfc3d_compute_error.c, MIN_RELATIVE_SCALING). A
 * scale that has overflowed would make every error small. */
static double relative(const struct tally *t, double error2, double scale2)
{
    double error = sqrt(error2), scale = sqrt(scale2);
    if (!isfinite(scale)) return NAN;
    return scale > sqrt(DBL_EPSILON) * t->unit ? error / scale : error / t->unit;
}

static sadmm_status certify(struct sadmm_certificate_workspace *workspace, const struct sadmm_system *system,
                            const struct sadmm_settings *settings, double unit, sadmm_certificate *certificate,
                            struct sadmm_error *error)
{
    size_t count = (size_t)system->body_count;
    if (!SADMM_GROW(workspace->values, 0, BODY_SIZE * count) ||
        !SADMM_GROW(workspace->contact_errors, 0, system->contacts->point_count))
        return sadmm_fail_memory(error, "the certificate");
    double *bodies = workspace->values;
    double A[36], b[6];

    for (size_t i = 0; i < count; ++i) {
        double *body = bodies + BODY_SIZE * i;
        sadmm_system_body(system, settings, (int32_t)i, A, b);
        if (!dense6_cholesky(A, body + FACTOR))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "mass matrix of body %zu: not positive definite", i);
        memset(body + IMPULSE, 0, (BODY_SIZE - IMPULSE) * sizeof *body);
    }

    struct tally tally = {.unit = unit, .ncp_worst = -1, .contact_errors = workspace->contact_errors};
    for (size_t p = 0; p < system->contacts->pair_count; ++p)
        certify_pair(&tally, system, settings, &system->contacts->pairs[p], bodies);
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) certify_rows(&tally, system, k, bodies);

    sadmm_certificate out = sadmm_certificate_none();
    double residual_max = -1, scale = 0, residual2 = 0, Av2 = 0, b2 = 0, Jl2 = 0;
    for (size_t i = 0; i < count; ++i) {
        const double *impulse = bodies + BODY_SIZE * i + IMPULSE;
        double Av[6], residual[6];
        sadmm_system_body(system, settings, (int32_t)i, A, b);
        dense6_mul(A, system->velocity + 6 * i, Av);
        for (int r = 0; r < 6; ++r) residual[r] = Av[r] - b[r] - impulse[r];
        double largest = max_abs6(residual);
        if (out.momentum_worst < 0 || (exceeds(largest, residual_max) && !isnan(residual_max))) {
            residual_max = largest;
            out.momentum_worst = (int64_t)i;
        }
        scale = keep_max(scale, keep_max(max_abs6(b), keep_max(max_abs6(Av), max_abs6(impulse))));
        residual2 += square6(&tally, residual);
        Av2 += square6(&tally, Av);
        b2 += square6(&tally, b);
        Jl2 += square6(&tally, impulse);
    }

    out.momentum_max = !isfinite(scale) ? NAN : scale > 0 ? residual_max / scale : 0;
    out.ncp_max = tally.ncp_max;
    out.ncp_mean = tally.count ? tally.ncp_sum / (double)tally.count : 0;
    out.ncp_worst = tally.ncp_worst;
    if (!tally.outside)
        out.siconos = relative(&tally, residual2, keep_max(b2, keep_max(Av2, Jl2))) +
                      relative(&tally, tally.map2, keep_max(tally.u2, tally.r2));
    *certificate = out;
    return SADMM_OK;
}

static bool is_finite(const sadmm_certificate *c)
{
    return isfinite(c->ncp_max) && isfinite(c->ncp_mean) && isfinite(c->momentum_max) && isfinite(c->siconos);
}

sadmm_status sadmm_certify_with(struct sadmm_certificate_workspace *workspace, const struct sadmm_system *system,
                                const struct sadmm_settings *settings, sadmm_certificate *certificate,
                                struct sadmm_error *error)
{
    sadmm_certificate c;
    TRY(certify(workspace, system, settings, 1, &c, error));
    if (!is_finite(&c)) TRY(certify(workspace, system, settings, SMALL_UNIT, &c, error));
    if (!is_finite(&c))
        return sadmm_fail(
            error, SADMM_ERROR_NON_FINITE,
            "the error of the solution is not a finite number (natural map %g m/s, momentum %g, siconos %g): "
            "velocities, multipliers or masses are too large or too small, or not finite",
            c.ncp_max, c.momentum_max, c.siconos);
    *certificate = c;
    return SADMM_OK;
}

sadmm_status sadmm_certify(const struct sadmm_system *system, const struct sadmm_settings *settings,
                           sadmm_certificate *certificate, struct sadmm_error *error)
{
    struct sadmm_certificate_workspace workspace = {0};
    sadmm_status status = sadmm_certify_with(&workspace, system, settings, certificate, error);
    sadmm_certificate_workspace_free(&workspace);
    return status;
}

void sadmm_certificate_workspace_free(struct sadmm_certificate_workspace *workspace)
{
    sadmm_free(workspace->values);
    sadmm_free(workspace->contact_errors);
    *workspace = (struct sadmm_certificate_workspace){0};
}

sadmm_certificate sadmm_certificate_none(void)
{
    sadmm_certificate none = {
        .ncp_max = -1, .ncp_mean = -1, .ncp_worst = -1, .momentum_max = -1, .momentum_worst = -1, .siconos = -1};
    return none;
}
