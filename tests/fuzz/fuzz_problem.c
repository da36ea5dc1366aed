/* Problems: bodies, contacts and blocks with ordinary, extreme and wrong values, solved by every table of the CPU,
 * read, certified and solved again, while memory may run out. Whatever the calls:
 *
 *   - a call that fails leaves the problem as it was, its solution included, and says why
 *   - after a solve that succeeds the solution is finite
 *   - a certificate is finite and not negative
 *   - what was set is what is read
 */
#include <string.h>

#include "bytes.h"
#include "core/base/memory.h"
#include "subadmm/problem.h"

enum { MAX_BODIES = 5, MAX_CONTACTS = 10, MAX_BLOCKS = 5, MAX_CALLS = 24, MAX_SOLVES = 8 };

struct machine {
    struct bytes in;
    sadmm_problem *problem;
    int solves;
};

/* All that a problem holds. */
struct picture {
    int32_t bodies, contacts, blocks;
    double A[36 * MAX_BODIES], b[6 * MAX_BODIES], v0[6 * MAX_BODIES];
    double v[6 * MAX_BODIES], impulse[3 * MAX_CONTACTS], lambda[6 * MAX_BLOCKS];
    sadmm_problem_contact contact[MAX_CONTACTS];
    sadmm_problem_block block[MAX_BLOCKS];
};

static void inspect(sadmm_problem *problem, struct picture *p)
{
    memset(p, 0, sizeof *p);
    p->bodies = sadmm_problem_body_count(problem);
    p->contacts = sadmm_problem_contact_count(problem);
    p->blocks = sadmm_problem_block_count(problem);
    MUST(p->bodies <= MAX_BODIES && p->contacts <= MAX_CONTACTS && p->blocks <= MAX_BLOCKS, "sizes");
    MUST(sadmm_problem_get_bodies(problem, p->A, p->b, p->v0) == SADMM_OK, "bodies");
    MUST(sadmm_problem_get_solution(problem, p->v, p->impulse, p->lambda) == SADMM_OK, "solution");
    for (int32_t k = 0; k < p->contacts; ++k)
        MUST(sadmm_problem_get_contact(problem, k, &p->contact[k]) == SADMM_OK, "contact %d", k);
    for (int32_t k = 0; k < p->blocks; ++k)
        MUST(sadmm_problem_get_block(problem, k, &p->block[k]) == SADMM_OK, "block %d", k);
}

/* ---- arguments --------------------------------------------------------------------------------------------------- */

/* A small problem, or any magnitude that a double has. */
static double take_magnitude(struct bytes *in)
{
    switch (take_choice(in, 16)) {
    case 0: return take_extreme(in);
    case 1: return take_scale(in, 1e-12, 1e12);
    case 2: return take_scale(in, 1e-150, 1e150);
    default: return 1;
    }
}

/* L L^T of a random triangle, or diagonal; sometimes not symmetric or not positive definite. */
static void take_mass(struct bytes *in, double A[36])
{
    double L[36] = {0}, scale = take_magnitude(in);
    bool full = take_choice(in, 2);
    for (int i = 0; i < 6; ++i) {
        L[7 * i] = take_choice(in, 8) ? take_in(in, 0.5, 2) : take_scale(in, 1e-9, 1e9);
        for (int j = 0; full && j < i; ++j) L[6 * i + j] = take_in(in, -1, 1);
    }
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
            double sum = 0;
            for (int k = 0; k <= (i < j ? i : j); ++k) sum += L[6 * i + k] * L[6 * j + k];
            A[6 * i + j] = scale * sum;
        }
    if (take_rarely(in, 32)) A[take_choice(in, 36)] = take_extreme(in);
}

static void take_values(struct bytes *in, double *x, int count)
{
    double scale = take_magnitude(in);
    for (int k = 0; k < count; ++k) x[k] = scale * take_number(in, -1, 1);
}

static int32_t take_body(struct machine *m)
{
    int32_t n = sadmm_problem_body_count(m->problem);
    return take_rarely(&m->in, 64) ? take_choice(&m->in, 16) - 4 : take_choice(&m->in, n + 1) - 1;
}

static void take_contact(struct machine *m, sadmm_problem_contact *c)
{
    struct bytes *in = &m->in;
    double n2 = 0;
    c->body_a = take_body(m);
    c->body_b = take_body(m);
    for (int k = 0; k < 3; ++k) {
        c->normal[k] = take_in(in, -1, 1);
        n2 += c->normal[k] * c->normal[k];
    }
    if (n2 == 0) c->normal[2] = n2 = 1;
    for (int k = 0; k < 3; ++k) c->normal[k] /= sqrt(n2);
    if (take_rarely(in, 32)) c->normal[0] += take_extreme(in);
    take_values(in, c->arm_a, 3);
    take_values(in, c->arm_b, 3);
    c->error = take_magnitude(in) * take_in(in, -1, 1);
    c->friction = take_choice(in, 4) ? take_in(in, 0, 1) : take_magnitude(in);
    memset(c->velocity, 0, sizeof c->velocity);
    if (take_choice(in, 4) == 3 && (c->body_a < 0 || c->body_b < 0 || take_rarely(in, 8)))
        take_values(in, c->velocity, 3);
}

static void take_block(struct machine *m, sadmm_problem_block *b)
{
    struct bytes *in = &m->in;
    memset(b, 0, sizeof *b);
    b->kind = (sadmm_block_kind)(take_rarely(in, 32) ? take_byte(in) : take_choice(in, 4));
    b->rows = b->kind == SADMM_BLOCK_CONTACT && !take_rarely(in, 32) ? 3 : take_choice(in, 8);
    if (b->rows == 0) b->rows = 1;
    b->body_a = take_body(m);
    b->body_b = take_body(m);
    take_values(in, b->jacobian_a, 36);
    take_values(in, b->jacobian_b, 36);
    take_values(in, b->error, 6);
    b->friction = take_number(in, 0, 1);
    for (int k = 0; k < 6; ++k) {
        b->stiffness[k] = take_choice(in, 4) ? take_number(in, 0, 100) : fabs(take_magnitude(in));
        b->damping[k] = take_choice(in, 4) ? take_number(in, 0, 1) : fabs(take_magnitude(in));
    }
    for (int k = 0; k < 6 && b->kind == SADMM_BLOCK_ROWS; ++k) {
        b->gain[k] = take_choice(in, 4) ? 1 : fabs(take_magnitude(in));
        b->compliance[k] = take_choice(in, 2);
        b->lower[k] = take_choice(in, 2) ? 0 : -INFINITY;
        b->upper[k] = take_choice(in, 2) ? take_number(in, 0, 1) : INFINITY;
    }
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

static sadmm_status set_bodies(struct machine *m)
{
    double A[36 * MAX_BODIES], b[6 * MAX_BODIES], v0[6 * MAX_BODIES];
    int count = take_choice(&m->in, MAX_BODIES + 1);
    bool start = take_choice(&m->in, 2), null = take_rarely(&m->in, 64);
    for (int k = 0; k < count; ++k) take_mass(&m->in, A + 36 * k);
    take_values(&m->in, b, 6 * count);
    if (start) take_values(&m->in, v0, 6 * count);
    return sadmm_problem_set_bodies(m->problem, take_rarely(&m->in, 64) ? -count : count, null ? NULL : A, b,
                                    start ? v0 : NULL);
}

static sadmm_status set_contacts(struct machine *m)
{
    sadmm_problem_contact contacts[MAX_CONTACTS], read;
    double impulses[3 * MAX_CONTACTS];
    int count = take_choice(&m->in, MAX_CONTACTS + 1);
    bool start = take_choice(&m->in, 2), null = take_rarely(&m->in, 64);
    for (int k = 0; k < count; ++k) {
        take_contact(m, &contacts[k]);
        if (k > 0 && take_choice(&m->in, 2)) { /* a point of the same pair */
            contacts[k].body_a = contacts[k - 1].body_a;
            contacts[k].body_b = contacts[k - 1].body_b;
            memcpy(contacts[k].normal, contacts[k - 1].normal, sizeof contacts[k].normal);
            contacts[k].friction = contacts[k - 1].friction;
            memcpy(contacts[k].velocity, contacts[k - 1].velocity, sizeof contacts[k].velocity);
            for (int i = 0; i < 3; ++i)
                contacts[k].arm_b[i] = contacts[k].arm_a[i] + (contacts[k - 1].arm_b[i] - contacts[k - 1].arm_a[i]);
        }
    }
    if (start) take_values(&m->in, impulses, 3 * count);
    sadmm_status status =
        sadmm_problem_set_contacts(m->problem, count, null ? NULL : contacts, start ? impulses : NULL);
    if (status != SADMM_OK) return status;
    for (int32_t k = 0; k < count; ++k) {
        MUST(sadmm_problem_get_contact(m->problem, k, &read) == SADMM_OK, "contact %d", k);
        MUST(read.body_a == contacts[k].body_a && read.body_b == contacts[k].body_b &&
                 read.error == contacts[k].error && read.friction == contacts[k].friction &&
                 read.velocity[0] == contacts[k].velocity[0] && read.velocity[1] == contacts[k].velocity[1] &&
                 read.velocity[2] == contacts[k].velocity[2],
             "contact %d", k);
    }
    return SADMM_OK;
}

static sadmm_status set_blocks(struct machine *m)
{
    sadmm_problem_block blocks[MAX_BLOCKS];
    double lambda[6 * MAX_BLOCKS];
    int count = take_choice(&m->in, MAX_BLOCKS + 1);
    bool start = take_choice(&m->in, 2), null = take_rarely(&m->in, 64);
    for (int k = 0; k < count; ++k) take_block(m, &blocks[k]);
    if (start) take_values(&m->in, lambda, 6 * count);
    return sadmm_problem_set_blocks(m->problem, count, null ? NULL : blocks, start ? lambda : NULL);
}

static sadmm_settings take_settings(struct bytes *in)
{
    sadmm_settings s = sadmm_settings_default();
    int choice = take_byte(in);
    s.threads = 1;
    s.method = choice & 1 ? SADMM_METHOD_FAST : SADMM_METHOD_PAPER;
    s.warm_start = choice & 2;
    s.measure_residuals = choice & 4;
    s.certify = choice & 8;
    s.penalty_update_warm = choice & 16;
    s.iterations = 1 + take_choice(in, 12);
    s.check_period = 1 + take_choice(in, 4);
    s.penalty_period = take_choice(in, 5);
    s.relaxation = take_rarely(in, 32) ? take_extreme(in) : take_in(in, 1, 1.99);
    if (take_rarely(in, 4)) s.residual_tolerance = take_scale(in, 1e-12, 1);
    if (take_rarely(in, 4)) s.tolerance = take_scale(in, 1e-12, 1);
    if (take_rarely(in, 8)) s.penalty_mass_factor = take_scale(in, 1e-12, 1e12);
    if (take_rarely(in, 8)) s.penalty_offset = take_scale(in, 1e-12, 1e15);
    if (take_rarely(in, 16)) s.dt = take_scale(in, 1e-6, 1);
    return s;
}

static void must_be_good(const sadmm_certificate *c, const struct picture *p)
{
    const double measures[] = {c->siconos == -1 ? 0 : c->siconos, c->ncp_max, c->ncp_mean, c->momentum_max};
    for (int k = 0; k < 4; ++k)
        MUST(isfinite(measures[k]) && measures[k] >= 0, "natural map %g, mean %g, momentum %g, siconos %g", c->ncp_max,
             c->ncp_mean, c->momentum_max, c->siconos);
    MUST(c->ncp_worst >= -1 && c->ncp_worst < p->contacts + p->blocks, "constraint %lld", (long long)c->ncp_worst);
    MUST(c->momentum_worst >= -1 && c->momentum_worst < p->bodies, "body %lld", (long long)c->momentum_worst);
}

static sadmm_status solve(struct machine *m)
{
    static struct picture after;
    sadmm_solve_report report;
    int table = take_choice(&m->in, 3);
    sadmm_settings settings = take_settings(&m->in);
    if (m->solves++ >= MAX_SOLVES) return SADMM_OK;
    sadmm_status status =
        sadmm_problem_solve(m->problem, table == 0 ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU,
                            table == 1 ? SADMM_F32 : SADMM_F64, take_rarely(&m->in, 64) ? NULL : &settings, &report);
    if (status != SADMM_OK) return status;
    inspect(m->problem, &after);
    MUST(all_finite(after.v, 6 * after.bodies) && all_finite(after.impulse, 3 * after.contacts) &&
             all_finite(after.lambda, 6 * after.blocks),
         "a solution that is not finite");
    MUST(report.iterations >= 0 && report.iterations <= settings.iterations, "%d iterations", report.iterations);
    must_be_good(&report.certificate, &after);
    return SADMM_OK;
}

static sadmm_status set_solution(struct machine *m)
{
    double v[6 * MAX_BODIES], impulse[3 * MAX_CONTACTS], lambda[6 * MAX_BLOCKS];
    int parts = take_choice(&m->in, 8);
    take_values(&m->in, v, 6 * MAX_BODIES);
    take_values(&m->in, impulse, 3 * MAX_CONTACTS);
    take_values(&m->in, lambda, 6 * MAX_BLOCKS);
    return sadmm_problem_set_solution(m->problem, parts & 1 ? v : NULL, parts & 2 ? impulse : NULL,
                                      parts & 4 ? lambda : NULL);
}

static sadmm_status certify(struct machine *m)
{
    static struct picture now;
    sadmm_certificate certificate;
    sadmm_status status = sadmm_problem_certify(m->problem, take_rarely(&m->in, 64) ? NULL : &certificate);
    if (status != SADMM_OK) return status;
    inspect(m->problem, &now);
    must_be_good(&certificate, &now);
    return SADMM_OK;
}

static sadmm_status read_wrongly(struct machine *m)
{
    sadmm_problem_contact contact;
    sadmm_problem_block block;
    int32_t index = take_choice(&m->in, 16) - 4;
    return take_choice(&m->in, 2) ? sadmm_problem_get_contact(m->problem, index, index == 0 ? NULL : &contact)
                                  : sadmm_problem_get_block(m->problem, index, index == 0 ? NULL : &block);
}

static sadmm_status make_call(struct machine *m)
{
    switch (take_choice(&m->in, 16)) {
    case 0: case 1: return set_bodies(m);
    case 2: case 3: case 4: return set_contacts(m);
    case 5: case 6: return set_blocks(m);
    case 7: return set_solution(m);
    case 8: case 9: return certify(m);
    case 10: return read_wrongly(m);
    default: return solve(m);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct picture before, after;
    struct machine m = {.in = bytes_of(data, size)};
    MUST(sadmm_problem_create(&m.problem) == SADMM_OK, "a problem");
    for (int call = 0; call < MAX_CALLS && bytes_left(&m.in); ++call) {
        inspect(m.problem, &before);
        if (take_rarely(&m.in, 32)) sadmm_test_fail_allocations_after(take_choice(&m.in, 32));
        sadmm_status status = call == 0 ? set_bodies(&m) : make_call(&m);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) continue;
        MUST(status > SADMM_OK && status < SADMM_STATUS_COUNT, "status %d", (int)status);
        MUST(sadmm_problem_message(m.problem)[0], "%s without a message", sadmm_status_name(status));
        inspect(m.problem, &after);
        MUST(memcmp(&before, &after, sizeof before) == 0, "%s: %s: the problem changed", sadmm_status_name(status),
             sadmm_problem_message(m.problem));
    }
    sadmm_problem_destroy(m.problem);
    return 0;
}
