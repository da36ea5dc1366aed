/* A world's insides, shared by the world_*.c files. */
#ifndef SADMM_CORE_WORLD_INTERNAL_H
#define SADMM_CORE_WORLD_INTERNAL_H

#include "../collision/collision.h"
#include "certificate.h"
#include "kernels.h"
#include "schedule.h"
#include "subadmm/world.h"

enum { SADMM_NAME_SIZE = 64, SADMM_WHY_SIZE = 256 };

/* A body slot. Dynamic bodies are numbered in slot order for the solver at every step. */
struct sadmm_world_body {
    bool alive;
    uint32_t generation; /* of the next id when dead, of the current one when alive */
    sadmm_body_type type;
    int32_t environment;
    int32_t system_body; /* in the last step, -1: static or not there */
    struct sadmm_rigid rigid;
    int32_t shape_count;
    size_t first_shape;  /* none of its shapes is in a lower slot */
    double contact_wrench[6];
    double change[6];  /* of the velocity in the last step */
    int32_t steady[2]; /* steps in a row with nearly the same change: linear, angular (world_step.c) */
    char name[SADMM_NAME_SIZE];
};

/* Where to begin looking among the slots of an array, so that no call walks over all of them. */
struct sadmm_slot_marks {
    size_t free;   /* no slot below is free */
    size_t at;     /* any slot, */
    int32_t below; /* and how many live ones are below it */
};

/* A set of slot pairs, key = low slot << 32 | high slot, sorted; `values` where the set has them. */
struct sadmm_pair_table {
    uint64_t *keys;
    double *values;
    size_t count, key_capacity, value_capacity;
};

struct sadmm_world {
    sadmm_world_def def; /* settings inside are the current ones */
    struct sadmm_error error;

    struct sadmm_world_body *bodies;
    size_t body_slots, body_capacity;
    int32_t body_count, dynamic_count;
    struct sadmm_slot_marks body_marks;
    struct sadmm_shape *shapes;
    uint32_t *shape_generations;
    size_t shape_slots, shape_capacity, shape_generation_capacity;
    int32_t shape_count;
    struct sadmm_slot_marks shape_marks;
    uint32_t shape_revisions;
    struct sadmm_pair_table disabled_pairs, friction_pairs;

    /* The last step: everything freeze, contacts and the next warm start need. */
    struct sadmm_collision *collision;
    struct sadmm_contact_set contacts;
    bool contacts_readable;
    struct sadmm_collision_body *collision_bodies; /* by slot */
    struct sadmm_rigid *start, *next;              /* dynamic bodies: before and after the step */
    double *velocity, *wrench;                     /* dynamic bodies x 6 */
    double *start_velocity;                        /* dynamic bodies x 6: the warm start */
    double *start_impulse;                         /* points x 3: the warm start */
    int32_t *slot_of;                              /* dynamic body -> slot */
    size_t collision_body_capacity, start_capacity, next_capacity, velocity_capacity, wrench_capacity,
        start_velocity_capacity, start_impulse_capacity, slot_of_capacity;
    struct sadmm_plan plan;
    sadmm_settings step_settings;
    bool stepped;

    const struct sadmm_kernels *kernels; /* chosen at the first step */
    struct sadmm_context *context;
    char why[SADMM_WHY_SIZE];
    struct sadmm_certificate_workspace certificate_workspace;
    sadmm_step_report report;
};

/* The slot of a live object, or NULL with SADMM_ERROR_STALE_ID set on `error`. */
struct sadmm_world_body *sadmm_world_find_body(const sadmm_world *world, sadmm_body_id id, const char *argument,
                                               struct sadmm_error *error);
struct sadmm_shape *sadmm_world_find_shape(const sadmm_world *world, sadmm_shape_id id, const char *argument,
                                           struct sadmm_error *error);
void sadmm_world_kill_shape(sadmm_world *world, size_t slot);

/* The lowest free slot, where there is one; sadmm_slot_taken says that it is free no more. `alive` tells of one slot. */
size_t sadmm_slot_free(struct sadmm_slot_marks *marks, const sadmm_world *world,
                       bool (*alive)(const sadmm_world *world, size_t slot));
/* The slot of the index-th live one, where there is one. */
size_t sadmm_slot_at(struct sadmm_slot_marks *marks, int32_t index, const sadmm_world *world,
                     bool (*alive)(const sadmm_world *world, size_t slot));
void sadmm_slot_taken(struct sadmm_slot_marks *marks, size_t slot);
void sadmm_slot_freed(struct sadmm_slot_marks *marks, size_t slot);

/* Is `key` in the table? *at is where it is or belongs. */
bool sadmm_pair_table_find(const struct sadmm_pair_table *table, uint64_t key, size_t *at);
sadmm_status sadmm_pair_table_set(struct sadmm_pair_table *table, uint64_t key, double value, struct sadmm_error *error);
void sadmm_pair_table_remove(struct sadmm_pair_table *table, uint64_t key);
/* Remove every pair that names the slot. */
void sadmm_pair_table_forget(struct sadmm_pair_table *table, uint32_t slot);
uint64_t sadmm_pair_key(size_t a, size_t b);

/* Checks of input values, each with the argument's name in the message. */
sadmm_status sadmm_check_vector(const char *name, const double *x, int count, double limit, struct sadmm_error *error);
sadmm_status sadmm_check_range(const char *name, double x, double low, double high, struct sadmm_error *error);
/* Unit within 1e-6; normalised into `out`. */
sadmm_status sadmm_check_orientation(const char *name, const double q[4], double out[4], struct sadmm_error *error);

#endif
