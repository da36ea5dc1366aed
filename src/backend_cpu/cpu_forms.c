/* Which form each body has: rigid, with LANES others in a body block, or general (cpu.h). It depends on the body alone:
 * on its A, and on whether other constraints than three-row contacts act on it. */
#include "core/base/memory.h"
#include "cpu.h"

/* The determinant over the product of the moments, 1 for principal axes, is what cofactors lose digits by; moments
 * beyond these could make it overflow. Rods a thousand times as long as thick are within. */
#define LEAST_DETERMINANT 1e-9
#define LEAST_MOMENT 1e-60
#define MOST_MOMENT 1e60

bool CPU(has_rigid_mass)(const struct sadmm_context *c, const double A[PACKED6])
{
    if (c->plan.rigid) return true;
    bool rigid = A[0] == A[2] && A[0] == A[5] && A[1] == 0 && A[3] == 0 && A[4] == 0;
    for (int r = 3; r < 6; ++r)
        for (int k = 0; k < 3; ++k) rigid = rigid && A[r * (r + 1) / 2 + k] == 0;
    double xx = A[9], yy = A[14], zz = A[20], xy = A[13], xz = A[18], yz = A[19];
    double smallest = min_of(xx, min_of(yy, zz)), largest = max_of(xx, max_of(yy, zz));
    if (!rigid || smallest < LEAST_MOMENT || largest > MOST_MOMENT) return false;
    double determinant = xx * (yy * zz - yz * yz) + xy * (xz * yz - xy * zz) + xz * (xy * yz - xz * yy);
    return determinant > LEAST_DETERMINANT * (xx * yy * zz);
}

static bool has_rigid_form(const struct sadmm_context *c, size_t body)
{
    double packed[PACKED6];
    if (c->plan.contact_rows == 1) return false;
    if (c->plan.rigid) return true;
    for (int r = 0, at = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k) packed[at++] = c->system->A[36 * body + (size_t)(6 * r + k)];
    return CPU(has_rigid_mass)(c, packed);
}

static void classify_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) c->general_of[i] = has_rigid_form(c, i) ? -1 : 0;
}

static void mark(struct sadmm_context *c, int32_t body)
{
    if (body >= 0) c->general_of[body] = 0;
}

bool CPU(find_forms)(struct sadmm_context *c)
{
    const size_t n = (size_t)c->bodies, rows = sadmm_row_constraint_count(c->system);
    c->general_count = 0;
    if (!SADMM_GROW(c->general_of, 0, n) || !SADMM_GROW(c->general_bodies, 0, n) ||
        !SADMM_GROW(c->general_lanes, 0, c->body_block_count))
        return false;
    for (size_t block = 0; block < c->body_block_count; ++block) c->general_lanes[block] = 0;
    cpu_parallel(c, classify_share, c);
    if (c->plan.rigid && c->plan.contact_rows != 1 && rows == 0) return true; /* as in worlds: none */
    for (size_t k = 0; k < rows; ++k) {
        mark(c, c->system->rows->constraints[k].body_a);
        mark(c, c->system->rows->constraints[k].body_b);
    }
    for (size_t i = 0; i < n; ++i) {
        if (c->general_of[i] < 0) continue;
        c->general_of[i] = (int32_t)c->general_count;
        c->general_bodies[c->general_count++] = (int32_t)i;
        c->general_lanes[i / (size_t)LANES] |= 1u << (i % (size_t)LANES);
    }
    for (size_t i = n; i < c->body_block_count * (size_t)LANES; ++i)
        c->general_lanes[i / (size_t)LANES] |= 1u << (i % (size_t)LANES);
    return true;
}
