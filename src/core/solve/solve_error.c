#include "solve_error.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/ldl6.h"
#include "core/math/row.h"
#include "core/math/solve_rounding.h"
#include "core/model/islands.h"
#include "core/model/system_math.h"

/* A body in the work: L D L^T of A (36), b (6), J^T lambda (6), mass. */
enum { FACTOR = 0, FREE = 36, IMPULSE = 42, MASS = 48, BODY_SIZE = 49 };

static bool exceeds(double x, double most) { return !(x <= most); }

/* J A^-1 J^T of one row on one body. */
static double response_of(const double *body, const double row[6])
{
    double y[6], sum = 0;
    memcpy(y, row, sizeof y);
    ldl6_forward(body + FACTOR, y);
    for (int k = 0; k < 6; ++k) sum += y[k] * y[k] * body[FACTOR + 7 * k];
    return sum;
}

static void add_error(const struct sadmm_solve_errors *e, int32_t body_a, int32_t body_b, double map)
{
    if (body_a < 0 && body_b < 0) return;
    double *law = &e->law[e->label[body_a >= 0 ? body_a : body_b]];
    *law = keep_max(map, *law);
}

static double natural_map(const double lambda[3], const double u[3], double friction, double response)
{
    double residual[3];
    contact_residual_rows(lambda, u, friction, response, residual);
    return sqrt(residual[0] * residual[0] + residual[1] * residual[1] + residual[2] * residual[2]) * response;
}

static void add_pair(const struct sadmm_solve_errors *e, const struct sadmm_system *system,
                     const struct sadmm_settings *settings, const struct sadmm_contact_pair *pair)
{
    const struct sadmm_contact_point *points = &system->contacts->points[pair->first];
    const mat3 frame = sadmm_contact_frame(pair->normal);
    const int rows = pair->friction > 0 ? 3 : 1;
    double worst = 0;
    for (int32_t k = 0; k < pair->count; ++k) {
        const struct sadmm_contact_point *point = &points[k];
        const vec3 impulse = v3_load(point->impulse), lambda = m3_mul(frame, impulse),
                   x = m3_mul(frame, sadmm_contact_velocity(system, pair, point));
        const double l[3] = {lambda.x, lambda.y, lambda.z},
                     u[3] = {x.x + sadmm_contact_e(system, settings, pair, points, k), x.y, x.z};
        double response[3] = {0, 0, 0};
        for (int side = 0; side < 2; ++side) {
            const int32_t index = side ? pair->body_b : pair->body_a;
            if (index < 0) continue;
            double *body = e->bodies + BODY_SIZE * (size_t)index;
            const vec3 arm = v3_load(side ? point->arm_b : point->arm_a), own = side ? impulse : v3_neg(impulse),
                       turn = v3_cross(arm, own);
            for (int i = 0; i < rows; ++i) {
                double row[6];
                v3_store(frame.r[i], row);
                v3_store(v3_cross(arm, frame.r[i]), row + 3);
                response[i] += response_of(body, row);
            }
            v3_store(v3_add(v3_load(body + IMPULSE), own), body + IMPULSE);
            v3_store(v3_add(v3_load(body + IMPULSE + 3), turn), body + IMPULSE + 3);
        }
        worst = keep_max(natural_map(l, u, pair->friction, fmax(response[0], fmax(response[1], response[2]))), worst);
    }
    add_error(e, pair->body_a, pair->body_b, worst);
}

static void add_constraint(const struct sadmm_solve_errors *e, const struct sadmm_system *system,
                           const struct sadmm_row_constraint *constraint)
{
    const struct sadmm_rows *rows = system->rows;
    const size_t first = (size_t)constraint->first;
    double x[SADMM_MAX_ROWS] = {0}, response[SADMM_MAX_ROWS] = {0}, worst = 0;
    for (int side = 0; side < 2; ++side) {
        const int32_t index = side ? constraint->body_b : constraint->body_a;
        if (index < 0) continue;
        const double *jacobian = (side ? rows->jacobian_b : rows->jacobian_a) + 6 * first;
        double *body = e->bodies + BODY_SIZE * (size_t)index;
        for (int r = 0; r < constraint->count; ++r) {
            const double *row = jacobian + 6 * r;
            x[r] += six_product(row, system->velocity + 6 * (size_t)index);
            response[r] += response_of(body, row);
            for (int k = 0; k < 6; ++k) body[IMPULSE + k] += row[k] * rows->lambda[first + (size_t)r];
        }
    }
    if (constraint->cone) {
        const double *bias = rows->bias + first, u[3] = {x[0] + bias[0], x[1] + bias[1], x[2] + bias[2]};
        worst = natural_map(rows->lambda + first, u, constraint->friction,
                            constraint->friction > 0 ? fmax(response[0], fmax(response[1], response[2])) : response[0]);
    }
    for (int r = 0; !constraint->cone && r < constraint->count; ++r) {
        const size_t at = first + (size_t)r;
        if (response[r] != 0)
            worst = keep_max(row_natural_map(rows->gain[at], rows->bias[at], rows->compliance[at], rows->lo[at],
                                             rows->hi[at], x[r], rows->lambda[at], response[r]),
                             worst);
    }
    add_error(e, constraint->body_a, constraint->body_b, worst);
}

/* A v */
static void multiply(const double *body, const double v[6], double y[6])
{
    const double *L = body + FACTOR;
    for (int k = 0; k < 6; ++k) {
        y[k] = v[k];
        for (int i = k + 1; i < 6; ++i) y[k] += L[6 * i + k] * v[i];
        y[k] = L[7 * k] > 0 ? y[k] / L[7 * k] : 0;
    }
    for (int k = 5; k >= 0; --k)
        for (int i = 0; i < k; ++i) y[k] += L[6 * k + i] * y[i];
}

/* sqrt(v A v / m) of v = A^-1 r, m/s. */
static double speed_of(const double *body, const double r[6]) { return sqrt(response_of(body, r) / body[MASS]); }

/* What a body owes, and what it would have with no contact: of the two speeds rounding is a share. */
static void add_body(const struct sadmm_solve_errors *e, const double *velocity, int32_t i, double rounding)
{
    const double *body = e->bodies + BODY_SIZE * (size_t)i;
    double *momentum = &e->momentum[e->label[i]], *enough = &e->enough[e->label[i]], now[6], owed[6];
    multiply(body, velocity + 6 * (size_t)i, now);
    for (int k = 0; k < 6; ++k) owed[k] = now[k] - body[FREE + k] - body[IMPULSE + k];
    *momentum = keep_max(speed_of(body, owed), *momentum);
    *enough = keep_max(rounding * fmax(speed_of(body, now), speed_of(body, body + FREE)), *enough);
}

sadmm_status sadmm_solve_errors_find(struct sadmm_solve_errors *e, const struct sadmm_system *system,
                                     const struct sadmm_settings *settings, sadmm_precision precision,
                                     struct sadmm_error *error)
{
    const size_t n = (size_t)system->body_count;
    const double rounding = precision == SADMM_F32 ? SOLVE_ROUNDING * FLT_EPSILON : SOLVE_ROUNDING * DBL_EPSILON;
    if (!SADMM_GROW(e->label, 0, n) || !SADMM_GROW(e->law, 0, n) || !SADMM_GROW(e->momentum, 0, n) ||
        !SADMM_GROW(e->enough, 0, n) || !SADMM_GROW(e->bodies, 0, BODY_SIZE * n))
        return sadmm_fail_memory(error, "errors of islands");
    e->body_count = system->body_count;
    sadmm_islands(system, e->label);
    for (size_t i = 0; i < n; ++i) {
        double *body = e->bodies + BODY_SIZE * i, A[36];
        sadmm_system_body(system, settings, (int32_t)i, A, body + FREE);
        ldl6_factor(A, body + FACTOR);
        body[MASS] = (A[0] + A[7] + A[14]) / 3;
        memset(body + IMPULSE, 0, 6 * sizeof *body);
        e->law[i] = e->momentum[i] = e->enough[i] = 0;
    }
    for (size_t p = 0; p < system->contacts->pair_count; ++p)
        add_pair(e, system, settings, &system->contacts->pairs[p]);
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k)
        add_constraint(e, system, &system->rows->constraints[k]);
    for (size_t i = 0; i < n; ++i) add_body(e, system->velocity, (int32_t)i, rounding);
    return SADMM_OK;
}

bool sadmm_solve_errors_above(const struct sadmm_solve_errors *e, int32_t label, double tolerance)
{
    const double enough = fmax(tolerance, e->enough[label]);
    return exceeds(e->law[label], enough) || exceeds(e->momentum[label], enough);
}

struct sadmm_solve_error sadmm_solve_errors_sum(const struct sadmm_solve_errors *e, double tolerance)
{
    struct sadmm_solve_error sum = {0, 0, 0};
    for (int32_t i = 0; i < e->body_count; ++i) {
        if (e->label[i] != i) continue;
        sum.law = keep_max(e->law[i], sum.law);
        sum.momentum = keep_max(e->momentum[i], sum.momentum);
        sum.unsolved += sadmm_solve_errors_above(e, i, tolerance);
    }
    return sum;
}

void sadmm_solve_errors_free(struct sadmm_solve_errors *e)
{
    void *blocks[] = {e->label, e->law, e->momentum, e->enough, e->bodies};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    memset(e, 0, sizeof *e);
}
