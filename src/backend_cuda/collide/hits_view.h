/* Hits of swept bodies, each at its moment (world/step/hits.c says what for), on the device: between the candidates of
 * a step and its contacts.
 *
 *   list      candidates that are fast; bodies that something presses on; the step's start is copied
 *   foresee   when each of these pairs of swept bodies first touches               a thread a pair
 *   take      hits in the order of time, and what the two come near from then on   a block a group
 *   replace   shapes of what was hit, where they are now; the list of hits; the candidates are searched for again
 *   later     manifolds of what was hit, in what is left of the step               a thread a candidate, after `narrow`
 *   reopen    their points, and separations of swept bodies                        after `emit`
 *
 * Steps have these kernels if they are planned to (CUDA(plan_hits)); where nothing is fast all of them return at once.
 * Lists have no order, and results do not depend on it: the next hit is that of the least (time, key), shapes of a body
 * are taken in order, a list's length and what becomes of it are the same in any order. Bodies of two environments
 * never meet: each environment is a group, whose hits a block takes by itself, unless a body that moves is in none of
 * them; then all are one group. What a group may take is limited, by the world and the group alone: beyond that its
 * bodies are left to the solve, for the (sub-)step. Formulas are the host's: collision/flight/swept_body.h,
 * collision/flight/flight_touch_math.h, core/math/hit.h. */
#ifndef SADMM_CUDA_COLLIDE_HITS_VIEW_H
#define SADMM_CUDA_COLLIDE_HITS_VIEW_H

#include "view.h"

/* C headers: an enumerator beside an unsigned number is fine there. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wextra"
#include "collision/flight/swept_body.h"
#pragma GCC diagnostic pop

enum {
    HIT_THREADS = 128,       /* a block of `list`, `replace`, `reopen` */
    FORESEE_THREADS = 32,    /* long chains of arithmetic */
    FORESEE_BLOCKS = 512,
#ifdef SADMM_CUDA_EMULATED
    TAKE_THREADS = 32, /* which are fibers of one: results do not depend on it */
#else
    TAKE_THREADS = 256,
#endif
    TAKE_BLOCKS = 1024,      /* which go on to other groups */
    TAKE_SHAPES = 64,        /* of a body that was hit, ... */
    TAKE_TESTS = 1 << 18,    /* ... shapes that are tested in a (sub-)step, ... */
    HIT_ROOM = 64,           /* ... hits that are foreseen at a time, ... */
    HIT_ROOM_A_SHAPE = 4,    /* ... and so many more a shape, ... */
    HIT_RECORDS = 32,        /* ... points of a step's hits, ... */
    HIT_RECORDS_A_BODY = 4,  /* ... and so many more a body: more than a group may have */
    TAKE_TIMES = 4           /* as MOST_TIMES of the host */
};

/* In device memory. */
struct hits_state {
    unsigned long long listed;
    uint64_t epoch;      /* (sub-)steps so far: marks of an earlier one do not count */
    int32_t followed;    /* not 0: some bodies are */
    int32_t quiet;       /* not 0: nothing was hit, or the step is aborted */
    int32_t records[2], first[2]; /* by step: hits; from where on they are the last sub-step's */
};

/* Bodies that meet no others but fixed ones. Places in lists. */
struct hit_group {
    int32_t body_first, body_count;   /* group_bodies */
    int32_t leaf_first, leaf_count;   /* group_leaves */
    int32_t room_first, room;         /* foreseen */
    int32_t near_first;               /* near */
    int32_t record_first, record_room; /* taken */
};

/* What a group has done in the (sub-)step. */
struct hit_progress {
    unsigned long long foreseen;
    uint64_t followed;        /* the mark of its swept bodies; 0: there are none */
    int32_t records, earlier; /* of the (sub-)step; of those before it in the step */
};

/* A hit that is foreseen. */
struct foreseen_hit {
    uint64_t key; /* slot of a << 32 | slot of b */
    int32_t body[2];
    uint32_t hits[2];
    struct sadmm_flight_touch touch;
};

/* By body slot. */
struct hit_marks {
    uint64_t pressed;                /* in which (sub-)step */
    uint64_t followed, passes, lost; /* in which of its times (followed_mark): as the host's swept bodies */
};

struct hits_view {
    struct collision_view c;
    struct sadmm_cuda_hits step;
    struct hits_state *state;
    struct hit_progress *progress;  /* by group */
    const struct hit_group *groups;
    const int32_t *group_bodies, *group_leaves; /* slots; as `present` */
    const int32_t *group_of;        /* by body slot; -1: fixed, and all groups meet it */
    const int32_t *shared_leaves;   /* of those */
    int32_t group_count, shared_leaf_count;
    struct hit_marks *marks;
    const uint8_t *held;             /* by body slot: joints hold it */
    unsigned char *kinds;            /* by body slot: enum sadmm_swept_kind */
    struct swept_body *swept_bodies; /* by body slot */
    double *since;                   /* by body slot: of its last hit, s */
    double *impulse;                 /* by body slot x 6: what its hits gave it, N s, N m s */
    int32_t *listed;                 /* candidates; ~ of one that took too many tests to decide */
    struct foreseen_hit *foreseen;
    struct sadmm_box3 *boxes;       /* of leaves, as `present`: from the last hit on */
    uint64_t *near;                 /* keys */
    struct sadmm_world_hit *taken, *records; /* by group, of the sub-step; of two steps, record_capacity each */
    int32_t record_capacity, shape_count;
    bool few;                       /* candidates are ranked: the list need not be cleared */
    bool takes;                     /* `take`, else `foresee`: they are one kernel */
};

struct hits_launch {
    void (*kernel)(const hits_view);
    int threads;
    size_t shared;
    const char *name;
};
struct hits_kernels {
    struct hits_launch list, foresee, take, replace, later, reopen, give;
};

/* Of swept bodies of the (sub-)step that were tested the times + 1st time. */
static __device__ __forceinline__ uint64_t followed_mark(uint64_t epoch, int times)
{
    return epoch * TAKE_TIMES + (uint64_t)times;
}

/* Is the body followed no further? What is not dynamic always is. mark: followed_mark of the last time. */
static __device__ __forceinline__ bool gives_up(const hits_view &v, int32_t slot, uint64_t mark)
{
    return v.swept_bodies[slot].dynamic >= 0 && (v.swept_bodies[slot].too_many || v.marks[slot].lost == mark);
}

void COLLISION(hits_take_kernels)(struct hits_kernels *kernels);
void COLLISION(hits_contacts_kernels)(struct hits_kernels *kernels);

#endif
