#include "lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double HALF = 0.05, MASS = 1;
enum { LAYERS = 8 };

static void add_pair(struct lattice *lattice, int32_t below, int32_t above, double from, double to, double low)
{
    struct sadmm_contact_set *set = &lattice->contacts;
    struct sadmm_contact_pair *pair = &set->pairs[set->pair_count++];
    const double *a = below >= 0 ? lattice->bodies[below].position : NULL, *b = lattice->bodies[above].position;
    pair->body_a = below;
    pair->body_b = above;
    pair->shape_a = pair->shape_b = -1;
    pair->first = (int32_t)set->point_count;
    pair->count = 4;
    pair->normal[2] = 1;
    pair->friction = 0.5;
    for (int corner = 0; corner < 4; ++corner) {
        struct sadmm_contact_point *point = &set->points[set->point_count++];
        double at[3] = {corner & 1 ? to : from, b[1] + (corner & 2 ? HALF : -HALF), low};
        for (int k = 0; k < 3; ++k) {
            point->arm_b[k] = at[k] - b[k];
            if (a) point->arm_a[k] = at[k] - a[k];
        }
    }
}

bool lattice_create(struct lattice *lattice, long contacts)
{
    memset(lattice, 0, sizeof *lattice);
    long per_column = 4 + 8 * (LAYERS - 1);
    long side = (long)ceil(sqrt((double)contacts / (double)per_column)) + 1, n = side * side * LAYERS;
    size_t bodies = (size_t)n;
    lattice->bodies = calloc(bodies, sizeof *lattice->bodies);
    lattice->contacts.pairs = calloc(2 * bodies, sizeof *lattice->contacts.pairs);
    lattice->contacts.points = calloc(8 * bodies, sizeof *lattice->contacts.points);
    lattice->system.velocity = calloc(6 * bodies, sizeof(double));
    if (!lattice->bodies || !lattice->contacts.pairs || !lattice->contacts.points || !lattice->system.velocity) {
        lattice_destroy(lattice);
        return false;
    }
    double step = 2.2 * HALF;
    for (long z = 0; z < LAYERS; ++z)
        for (long y = 0; y < side; ++y)
            for (long x = 0; x < side; ++x) {
                struct sadmm_rigid *body = &lattice->bodies[(z * side + y) * side + x];
                body->position[0] = step * ((double)x + 0.5 * (double)(z & 1));
                body->position[1] = step * (double)y;
                body->position[2] = HALF * (double)(2 * z + 1);
                body->orientation[0] = 1;
                body->mass = MASS;
                body->gravity_scale = 1;
                for (int k = 0; k < 3; ++k) body->inertia[k] = MASS * 2 / 3 * HALF * HALF;
            }
    for (long i = 0; i < n; ++i) {
        const double *above = lattice->bodies[i].position;
        long z = i / (side * side), x = i % side;
        if (z == 0) {
            add_pair(lattice, -1, (int32_t)i, above[0] - HALF, above[0] + HALF, 0);
            continue;
        }
        /* Odd layers lie on x and x + 1 of the layer below, even ones on x - 1 and x. */
        for (long dx = z & 1 ? 0 : -1; dx <= (z & 1 ? 1 : 0); ++dx) {
            if (x + dx < 0 || x + dx >= side) continue;
            long j = i - side * side + dx;
            const double *below = lattice->bodies[j].position;
            add_pair(lattice, (int32_t)j, (int32_t)i, fmax(above[0], below[0]) - HALF, fmin(above[0], below[0]) + HALF,
                     above[2] - HALF);
        }
    }
    lattice->system.body_count = (int32_t)n;
    lattice->system.rigid = lattice->bodies;
    lattice->system.contacts = &lattice->contacts;
    return true;
}

void lattice_reset(struct lattice *lattice)
{
    memset(lattice->system.velocity, 0, 6 * (size_t)lattice->system.body_count * sizeof(double));
    for (size_t k = 0; k < lattice->contacts.point_count; ++k)
        memset(lattice->contacts.points[k].impulse, 0, sizeof lattice->contacts.points[k].impulse);
}

void lattice_destroy(struct lattice *lattice)
{
    free(lattice->bodies);
    free(lattice->contacts.pairs);
    free(lattice->contacts.points);
    free(lattice->system.velocity);
    memset(lattice, 0, sizeof *lattice);
}
