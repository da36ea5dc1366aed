#include "public_problems.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void must(sadmm_status status, const sadmm_problem *problem)
{
    if (status == SADMM_OK) return;
    fprintf(stderr, "%s: %s\n", sadmm_status_name(status),
            problem ? sadmm_problem_message(problem) : sadmm_last_message());
    abort();
}

static void *zeroed(size_t count, size_t size)
{
    void *block = calloc(count ? count : 1, size);
    if (!block) abort();
    return block;
}

/* ---- stack ---------------------------------------------------------------------------------------------------- */

sadmm_problem *public_problem_stack(int count, double friction, double lean, double other)
{
    const double half = 0.1, dt = 0.005, gravity = 9.81;
    double *A = zeroed((size_t)count, 36 * sizeof *A), *b = zeroed((size_t)count, 6 * sizeof *b);
    sadmm_problem_contact *contacts = zeroed((size_t)count, 4 * sizeof *contacts);
    for (int i = 0; i < count; ++i) {
        double mass = i % 2 ? other : 1, inertia = mass * (2 * half) * (2 * half) / 6;
        for (int k = 0; k < 6; ++k) A[36 * i + 7 * k] = k < 3 ? mass : inertia;
        b[6 * i] = mass * dt * gravity * sin(lean);
        b[6 * i + 2] = -mass * dt * gravity * cos(lean);
        for (int k = 0; k < 4; ++k) {
            sadmm_problem_contact *c = &contacts[4 * i + k];
            double x = k & 1 ? half : -half, y = k & 2 ? half : -half;
            *c = (sadmm_problem_contact){.body_a = i - 1, .body_b = i, .normal = {0, 0, 1}, .arm_a = {x, y, half},
                                         .arm_b = {x, y, -half}, .friction = friction};
        }
    }
    sadmm_problem *problem;
    must(sadmm_problem_create(&problem), NULL);
    must(sadmm_problem_set_bodies(problem, count, A, b, NULL), problem);
    must(sadmm_problem_set_contacts(problem, 4 * count, contacts, NULL), problem);
    free(A);
    free(b);
    free(contacts);
    return problem;
}

/* ---- random --------------------------------------------------------------------------------------------------- */

static uint64_t state;

/* Uniform in [-1, 1). */
static double uniform(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-52 - 1;
}

static int32_t pick(int count) { return (int32_t)((uniform() + 1) / 2 * count) % count; }

/* Two different bodies, or (one time in three) a body and the world on either side. */
static void pick_pair(int bodies, int32_t *a, int32_t *b)
{
    *a = pick(bodies);
    *b = bodies > 1 && uniform() > -0.3 ? (*a + 1 + pick(bodies - 1)) % bodies : -1;
    if (uniform() > 0) {
        int32_t swap = *a;
        *a = *b;
        *b = swap;
    }
}

static void random_unit(double n[3])
{
    double length;
    do {
        for (int k = 0; k < 3; ++k) n[k] = uniform();
        length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    } while (length < 0.1);
    for (int k = 0; k < 3; ++k) n[k] /= length;
}

/* I plus a random part, exactly symmetric, diagonally dominant: positive definite. */
static void random_bodies(int count, double *A, double *b)
{
    for (int i = 0; i < count; ++i) {
        double *M = A + 36 * i;
        for (int r = 0; r < 6; ++r)
            for (int c = 0; c <= r; ++c) M[6 * r + c] = M[6 * c + r] = r == c ? 1.5 + uniform() * 0.4 : 0.1 * uniform();
        for (int r = 0; r < 6; ++r) b[6 * i + r] = uniform();
    }
}

static void random_jacobian(double *jacobian, int rows)
{
    for (int k = 0; k < 6 * rows; ++k) jacobian[k] = uniform();
}

sadmm_problem *public_problem_random(unsigned seed, int bodies, int contact_count, int block_count, int joint_count,
                                     double friction)
{
    state = seed * 2862933555777941757u + 3037000493u;
    int all = block_count + joint_count;
    double *A = zeroed((size_t)bodies, 36 * sizeof *A), *b = zeroed((size_t)bodies, 6 * sizeof *b);
    sadmm_problem_contact *contacts = zeroed((size_t)contact_count, sizeof *contacts);
    sadmm_problem_block *blocks = zeroed((size_t)all, sizeof *blocks);
    random_bodies(bodies, A, b);
    for (int k = 0; k < contact_count; ++k) {
        sadmm_problem_contact *c = &contacts[k];
        pick_pair(bodies, &c->body_a, &c->body_b);
        random_unit(c->normal);
        for (int i = 0; i < 3; ++i) c->arm_a[i] = uniform(), c->arm_b[i] = uniform();
        c->error = 0.1 * uniform();
        c->friction = friction;
    }
    for (int k = 0; k < all; ++k) {
        sadmm_problem_block *block = &blocks[k];
        bool contact = k < block_count;
        block->kind = contact ? SADMM_BLOCK_CONTACT : SADMM_BLOCK_HARD;
        block->rows = contact ? 3 : 1 + k % 6;
        block->friction = contact ? friction : 0;
        pick_pair(bodies, &block->body_a, &block->body_b);
        random_jacobian(block->jacobian_a, block->rows);
        random_jacobian(block->jacobian_b, block->rows);
        for (int i = 0; i < block->rows; ++i) block->error[i] = 0.1 * uniform();
    }
    sadmm_problem *problem;
    must(sadmm_problem_create(&problem), NULL);
    must(sadmm_problem_set_bodies(problem, bodies, A, b, NULL), problem);
    must(sadmm_problem_set_contacts(problem, contact_count, contacts, NULL), problem);
    must(sadmm_problem_set_blocks(problem, all, blocks, NULL), problem);
    free(A);
    free(b);
    free(contacts);
    free(blocks);
    return problem;
}
