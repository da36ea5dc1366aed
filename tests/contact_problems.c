#include "contact_problems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/model/system_math.h"

static uint64_t random_state = 1;

void contact_problem_seed(uint64_t seed)
{
    random_state = seed * 2862933555777941757u + 3037000493u;
}

double contact_problem_random(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) * 0x1p-52 - 1;
}

/* Tests may abort when memory runs out. */
static void *resize(void *block, size_t count, size_t size)
{
    block = realloc(block, (count ? count : 1) * size);
    if (!block) abort();
    return block;
}

static void *duplicate(const void *block, size_t count, size_t size)
{
    void *copy = resize(NULL, count, size);
    if (count) memcpy(copy, block, count * size);
    return copy;
}

static void rebind(struct contact_problem *p)
{
    p->system.rigid = p->rigid;
    p->system.A = p->A;
    p->system.b = p->b;
    p->system.contacts = &p->contacts;
    p->system.rows = &p->rows;
}

struct contact_problem *contact_problem_new(void)
{
    struct contact_problem *p = resize(NULL, 1, sizeof *p);
    memset(p, 0, sizeof *p);
    rebind(p);
    return p;
}

void contact_problem_free(struct contact_problem *p)
{
    if (!p) return;
    free(p->rigid);
    free(p->A);
    free(p->b);
    free(p->blocks);
    free(p->system.velocity);
    free(p->block_lambda);
    sadmm_rows_free(&p->rows);
    free(p->contacts.pairs);
    free(p->contacts.points);
    free(p);
}

struct contact_problem *contact_problem_copy(const struct contact_problem *p)
{
    struct contact_problem *q = duplicate(p, 1, sizeof *p);
    size_t n = (size_t)p->system.body_count, m = (size_t)p->block_count;
    q->rigid = p->rigid ? duplicate(p->rigid, n, sizeof *p->rigid) : NULL;
    q->A = p->A ? duplicate(p->A, 36 * n, sizeof(double)) : NULL;
    q->b = p->b ? duplicate(p->b, 6 * n, sizeof(double)) : NULL;
    q->blocks = duplicate(p->blocks, m, sizeof *p->blocks);
    q->system.velocity = duplicate(p->system.velocity, 6 * n, sizeof(double));
    q->block_lambda = duplicate(p->block_lambda, 6 * m, sizeof(double));
    memset(&q->rows, 0, sizeof q->rows);
    q->contacts.pairs = duplicate(p->contacts.pairs, p->contacts.pair_count, sizeof *p->contacts.pairs);
    q->contacts.points = duplicate(p->contacts.points, p->contacts.point_count, sizeof *p->contacts.points);
    rebind(q);
    contact_problem_rows(q);
    return q;
}

void contact_problem_rows(struct contact_problem *p)
{
    sadmm_rows_clear(&p->rows);
    for (int32_t k = 0; k < p->block_count; ++k)
        if (!sadmm_rows_add_block(&p->rows, &p->blocks[k], p->block_lambda + 6 * (size_t)k)) abort();
}

int32_t contact_problem_box(struct contact_problem *p, double mass, double hx, double hy, double hz, double x, double y,
                            double z)
{
    int32_t index = p->system.body_count++;
    size_t n = (size_t)p->system.body_count;
    p->rigid = resize(p->rigid, n, sizeof *p->rigid);
    p->system.velocity = resize(p->system.velocity, 6 * n, sizeof(double));
    memset(p->system.velocity + 6 * (n - 1), 0, 6 * sizeof(double));
    struct sadmm_rigid *body = &p->rigid[index];
    memset(body, 0, sizeof *body);
    body->mass = mass;
    body->inertia[0] = mass / 3 * (hy * hy + hz * hz);
    body->inertia[1] = mass / 3 * (hx * hx + hz * hz);
    body->inertia[2] = mass / 3 * (hx * hx + hy * hy);
    body->position[0] = x, body->position[1] = y, body->position[2] = z;
    body->orientation[0] = 1;
    body->gravity_scale = 1;
    rebind(p);
    return index;
}

void contact_problem_touch(struct contact_problem *p, int32_t a, int32_t b, const double at[3], const double normal[3],
                           double separation, double friction, double restitution)
{
    struct sadmm_contact_set *set = &p->contacts;
    struct sadmm_contact_pair *last = set->pair_count ? &set->pairs[set->pair_count - 1] : NULL;
    bool joins = last && last->body_a == a && last->body_b == b && last->count < SADMM_MAX_POINTS &&
                 memcmp(last->normal, normal, sizeof last->normal) == 0 && last->friction == friction &&
                 last->restitution == restitution;
    set->points = resize(set->points, set->point_count + 1, sizeof *set->points);
    struct sadmm_contact_point *point = &set->points[set->point_count];
    memset(point, 0, sizeof *point);
    for (int i = 0; i < 3; ++i) {
        if (a >= 0) point->arm_a[i] = at[i] - p->rigid[a].position[i];
        if (b >= 0) point->arm_b[i] = at[i] - p->rigid[b].position[i];
    }
    point->separation = separation;
    if (!joins) {
        set->pairs = resize(set->pairs, set->pair_count + 1, sizeof *set->pairs);
        last = &set->pairs[set->pair_count++];
        memset(last, 0, sizeof *last);
        last->body_a = a, last->body_b = b;
        last->shape_a = last->shape_b = -1;
        last->first = (int32_t)set->point_count;
        memcpy(last->normal, normal, sizeof last->normal);
        last->friction = friction;
        last->restitution = restitution;
    }
    ++last->count;
    ++set->point_count;
}

sadmm_problem_block *contact_problem_block(struct contact_problem *p, sadmm_block_kind kind, int32_t rows, int32_t a,
                                           int32_t b)
{
    size_t m = (size_t)++p->block_count;
    p->blocks = resize(p->blocks, m, sizeof *p->blocks);
    p->block_lambda = resize(p->block_lambda, 6 * m, sizeof(double));
    memset(p->block_lambda + 6 * (m - 1), 0, 6 * sizeof(double));
    sadmm_problem_block *block = &p->blocks[m - 1];
    memset(block, 0, sizeof *block);
    block->kind = kind;
    block->rows = rows;
    block->body_a = a;
    block->body_b = b;
    rebind(p);
    return block;
}

void contact_problem_raw(struct contact_problem *p, const sadmm_settings *settings, double coupling)
{
    size_t n = (size_t)p->system.body_count;
    for (size_t k = 0; k < p->contacts.pair_count; ++k) {
        struct sadmm_contact_pair *pair = &p->contacts.pairs[k];
        for (int32_t i = pair->first; i < pair->first + pair->count; ++i)
            p->contacts.points[i].error = sadmm_contact_e(&p->system, settings, pair,
                                                          &p->contacts.points[pair->first], i - pair->first);
    }
    p->A = resize(p->A, 36 * n, sizeof(double));
    p->b = resize(p->b, 6 * n, sizeof(double));
    for (size_t i = 0; i < n; ++i) {
        double *A = p->A + 36 * i;
        sadmm_system_body(&p->system, settings, (int32_t)i, A, p->b + 6 * i);
        for (int r = 0; r < 3; ++r)
            for (int c = 3; c < 6; ++c)
                A[6 * r + c] = A[6 * c + r] = coupling * contact_problem_random() * sqrt(A[7 * r] * A[7 * c]);
    }
    free(p->rigid);
    p->rigid = NULL;
    p->system.errors_given = true;
    rebind(p);
    contact_problem_rows(p);
}

void contact_problem_warm(struct contact_problem *p, double speed, double impulse)
{
    for (size_t i = 0; i < 6 * (size_t)p->system.body_count; ++i)
        p->system.velocity[i] = speed * contact_problem_random();
    for (size_t k = 0; k < p->contacts.pair_count; ++k) {
        const struct sadmm_contact_pair *pair = &p->contacts.pairs[k];
        for (int32_t i = pair->first; i < pair->first + pair->count; ++i)
            for (int j = 0; j < 3; ++j) /* along the normal alone without friction */
                p->contacts.points[i].impulse[j] =
                    impulse * (pair->normal[j] + (pair->friction > 0 ? 0.3 * contact_problem_random() : 0));
    }
    for (int32_t k = 0; k < p->block_count; ++k)
        for (int r = 0; r < p->blocks[k].rows; ++r)
            p->block_lambda[6 * k + r] = impulse * contact_problem_random();
    contact_problem_rows(p);
}

/* ---- scenes -------------------------------------------------------------------------------------------------- */

static const double up[3] = {0, 0, 1};

/* Four contacts at the corners of the rectangle [x0, x1] x [y0, y1]. */
static void touch_rectangle(struct contact_problem *p, int32_t a, int32_t b, double x0, double x1, double y0, double y1,
                            double z, double friction)
{
    for (int i = 0; i < 4; ++i)
        contact_problem_touch(p, a, b, (double[3]){i & 1 ? x1 : x0, i & 2 ? y1 : y0, z}, up, 0, friction, 0);
}

struct contact_problem *contact_problem_stack(const double *masses, int count, double friction)
{
    struct contact_problem *p = contact_problem_new();
    for (int i = 0; i < count; ++i) {
        contact_problem_box(p, masses[i], 0.1, 0.1, 0.1, 0, 0, 0.1 + 0.2 * i);
        touch_rectangle(p, i - 1, i, -0.1, 0.1, -0.1, 0.1, 0.2 * i, friction);
    }
    return p;
}

struct contact_problem *contact_problem_pyramid(int rows, double friction)
{
    struct contact_problem *p = contact_problem_new();
    double h = 0.1;
    int32_t below = 0; /* first box of the row below */
    for (int row = 0; row < rows; ++row) {
        int32_t first = p->system.body_count;
        for (int q = 0; q < rows - row; ++q) {
            double x = 2.2 * h * (q + 0.5 * row), z = 2 * h * row;
            int32_t box = contact_problem_box(p, 1, h, h, h, x, 0, z + h);
            if (row == 0) {
                touch_rectangle(p, -1, box, x - h, x + h, -h, h, z, friction);
            } else {
                for (int s = 0; s < 2; ++s) {
                    double other = p->rigid[below + q + s].position[0];
                    touch_rectangle(p, below + q + s, box, fmax(x, other) - h, fmin(x, other) + h, -h, h, z, friction);
                }
            }
        }
        below = first;
    }
    return p;
}

struct contact_problem *contact_problem_plates(int layers, double friction)
{
    struct contact_problem *p = contact_problem_new();
    double c = 0.05, z = 0;
    int32_t under = -1;
    for (int layer = 0; layer < layers; ++layer) {
        int32_t cubes = p->system.body_count;
        for (int i = 0; i < 4; ++i) {
            double x = i & 1 ? 0.3 : -0.3, y = i & 2 ? 0.3 : -0.3;
            int32_t cube = contact_problem_box(p, 0.05, c, c, c, x, y, z + c);
            touch_rectangle(p, under, cube, x - c, x + c, y - c, y + c, z, friction);
        }
        int32_t plate = contact_problem_box(p, 10, 0.4, 0.4, 0.02, 0, 0, z + 2 * c + 0.02);
        for (int i = 0; i < 4; ++i) {
            double x = i & 1 ? 0.3 : -0.3, y = i & 2 ? 0.3 : -0.3;
            touch_rectangle(p, cubes + i, plate, x - c, x + c, y - c, y + c, z + 2 * c, friction);
        }
        under = plate;
        z += 2 * c + 0.04;
    }
    return p;
}

static void random_unit(double *x, int size)
{
    double n2 = 0;
    for (int i = 0; i < size; ++i) {
        x[i] = contact_problem_random();
        n2 += x[i] * x[i];
    }
    for (int i = 0; i < size; ++i) x[i] /= sqrt(n2);
}

/* Rows of a weld of a and b at a world point: relative velocity there, then relative angular velocity. */
static void weld_rows(const struct contact_problem *p, sadmm_problem_block *block, const double at[3])
{
    for (int side = 0; side < 2; ++side) {
        int32_t body = side ? block->body_b : block->body_a;
        double *J = side ? block->jacobian_b : block->jacobian_a, sign = side ? 1 : -1, arm[3];
        if (body < 0) continue;
        for (int i = 0; i < 3; ++i) arm[i] = at[i] - p->rigid[body].position[i];
        for (int r = 0; r < block->rows; ++r) {
            if (r < 3) sadmm_contact_row(v3(r == 0, r == 1, r == 2), arm, sign, J + 6 * r);
            else J[6 * r + r] = sign;
        }
    }
}

struct contact_problem *contact_problem_mixed(uint64_t seed, double friction)
{
    struct contact_problem *p = contact_problem_new();
    contact_problem_seed(seed);
    enum { BODIES = 14 };
    for (int i = 0; i < BODIES; ++i) {
        double mass = pow(10, 1.5 * contact_problem_random()), at[3], hy;
        /* One by one: compilers differ in the order they evaluate arguments in, and so would build different scenes. */
        for (int j = 0; j < 3; ++j) at[j] = contact_problem_random();
        hy = 0.1 + 0.05 * contact_problem_random();
        int32_t k = contact_problem_box(p, mass, 0.2, hy, 0.15, at[2], at[1], 0.5 + at[0]);
        random_unit(p->rigid[k].orientation, 4);
        for (int j = 0; j < 6; ++j) {
            p->rigid[k].velocity[j] = (j < 3 ? 1 : 10) * contact_problem_random();
            p->rigid[k].wrench[j] = (j < 3 ? 5 : 0.5) * contact_problem_random();
        }
    }
    /* Body BODIES - 1 stays alone. Contacts: pairs of 1 to 4 points. */
    for (int k = 0; k < 24; ++k) {
        int32_t a = k % 4 == 3 ? -1 : k % (BODIES - 1), b = (k * 5 + 3) % (BODIES - 1);
        if (a == b) b = (b + 1) % (BODIES - 1);
        if (k % 8 == 7) { int32_t t = a; a = b; b = t; } /* the static world on side b too */
        double normal[3], mu = friction * (1 + 0.5 * contact_problem_random());
        double restitution = k % 5 == 0 ? 0.4 : 0;
        random_unit(normal, 3);
        for (int j = 0; j <= k % 4; ++j) {
            double at[3] = {contact_problem_random(), contact_problem_random(), contact_problem_random()};
            double separation = 2e-3 * contact_problem_random();
            contact_problem_touch(p, a, b, at, normal, separation, mu, restitution);
        }
    }
    /* Contacts given by Jacobians, with an error in every row. */
    for (int k = 0; k < 4; ++k) {
        int32_t a = k == 1 ? -1 : k, b = k == 2 ? -1 : k + 5;
        sadmm_problem_block *block = contact_problem_block(p, SADMM_BLOCK_CONTACT, 3, a, b);
        double n[3];
        random_unit(n, 3);
        mat3 frame = sadmm_contact_frame(n);
        for (int side = 0; side < 2; ++side) {
            int32_t body = side ? b : a;
            double arm[3] = {0.2 * contact_problem_random(), 0.1, -0.1};
            for (int r = 0; body >= 0 && r < 3; ++r)
                sadmm_contact_row(frame.r[r], arm, side ? 1 : -1,
                                  (side ? block->jacobian_b : block->jacobian_a) + 6 * r);
        }
        for (int r = 0; r < 3; ++r) block->error[r] = 0.1 * contact_problem_random();
        block->friction = k == 3 ? 0 : 0.6;
    }
    /* A weld, a ball joint with three free rows (Sec. III-C), and a hinge to the world with a moving axis. */
    double at[3] = {0.1, 0.2, 0.4};
    sadmm_problem_block *block = contact_problem_block(p, SADMM_BLOCK_HARD, 6, 0, 1);
    weld_rows(p, block, at);
    for (int r = 0; r < 6; ++r) block->error[r] = 0.02 * contact_problem_random();
    block = contact_problem_block(p, SADMM_BLOCK_HARD, 6, 2, 3);
    weld_rows(p, block, at);
    memset(block->jacobian_a + 18, 0, 18 * sizeof(double));
    memset(block->jacobian_b + 18, 0, 18 * sizeof(double));
    block->error[4] = 0.3; /* must have no effect */
    block = contact_problem_block(p, SADMM_BLOCK_HARD, 5, 4, -1);
    weld_rows(p, block, at);
    block->error[3] = 0.2;
    /* Springs: soft, with damping, stiff; between bodies and to the world. */
    for (int k = 0; k < 4; ++k) {
        int32_t a = k == 3 ? -1 : 5 + k, b = 9 + k % 4;
        block = contact_problem_block(p, SADMM_BLOCK_SOFT, 1 + 2 * k > 6 ? 6 : 1 + 2 * k, a, b);
        weld_rows(p, block, at);
        for (int r = 0; r < block->rows; ++r) {
            block->error[r] = 0.05 * contact_problem_random();
            block->stiffness[r] = pow(10, 3 * contact_problem_random());
            block->damping[r] = k == 0 ? 0 : pow(10, 2 * contact_problem_random());
        }
    }
    return p;
}
