/* What environments are. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_TYPES_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_TYPES_H

#include "environment_state.h"
#include "subadmm/environments.h"

/* An array that is bound; of an input array, what environments have. */
struct sadmm_bound_array {
    sadmm_array array;
    sadmm_precision precision;
    size_t numbers; /* an environment: rows x columns */
    void *values; /* what the caller has: the host's, or where in_backend the backend's memory */
    void *host;
    bool in_backend, host_behind; /* host_behind: `values` are newer */
    bool by_host;                 /* the host writes it, in the call at hand */
    bool given_unknown;           /* the merged world has taken others than `given` by itself */
    double *start; /* (numbers) of an input array: the template's */
    double *given; /* (count x numbers) of an input array: what the merged world has; NULL: there is none */
};

/* Contacts that are kept of an environment. */
struct sadmm_environment_contacts {
    sadmm_contact *list; /* a growable block */
    int32_t count;
};

/* Objects of the template of one kind: their slots in order; by slot, which one it is. */
struct sadmm_environment_slots {
    size_t *slots;
    int32_t *numbers;
    int32_t count;
};

/* How far an environment of a merged world has come. */
struct sadmm_environment_progress {
    int64_t step;
    double time;          /* s */
    bool stepped, moved;  /* since the template; since a state was put into it, */
    sadmm_step_report report; /* which this is of */
};

/* A state that is kept, in the backend's memory; NULL: it is not there. */
struct sadmm_kept_block {
    void *block;
    uint8_t *enabled; /* of the template's joints, in order: is it? */
    sadmm_step_report report;
    bool stepped;
};

/* All environments in one world (environment_merge.h); world NULL: each is a state by itself. */
struct sadmm_merged_world {
    sadmm_world *world;
    struct sadmm_environment_slots bodies, shapes, joints;
    int32_t *groups, group_count;                /* by the template's body: which of its own environments it is in */
    struct sadmm_environment_progress *progress; /* (count) */
    struct sadmm_contact_set *contacts;          /* (count) of those whose contacts are to be replaced */
    bool *replaced, any_replaced;                /* (count) which these are */
    bool *unwritten, any_unwritten; /* (count) marked, and output arrays do not have what they are left as */
    struct sadmm_contact_set spare;

    /* In the backend's memory, where it has some for environments (environment_backend.h). */
    bool has_backend;
    struct sadmm_resident_copies copies;
    const int32_t *objects;   /* of rows of bodies; then of rows of anything else */
    uint8_t *left, *refused;  /* (count) not 0: marked; what is out of range; */
    uint8_t *left_last, *refusals; /* (count) as they were written, and read, last */
    struct sadmm_copy_measures *measures; /* (count) of the last step, where they are */
    bool measurable, measured; /* not read yet, and can be; read */
    bool static_moved;         /* some static body may not be where the template has it */
    double *gravities;         /* (count x 3) m/s^2, of an array that is bound; NULL: all have the settings' */
    struct sadmm_kept_block *kept; /* by state; made when it is begun with */
    size_t kept_count;
};

/* What one thread works with: a world that becomes one environment after the other. */
struct sadmm_environment_worker {
    sadmm_world *world;
    double *numbers;   /* of the largest array of an environment */
    sadmm_contact *contacts; /* a growable block: of a merged world */
    int32_t failed_at; /* the first of a call's environments that failed, by its place in the call; -1: none */
    struct sadmm_error failed;
};

struct sadmm_environments {
    struct sadmm_error error;
    struct sadmm_team team;
    int32_t count, workers;
    bool is_merged; /* all are in one world, of a backend that keeps it */
    struct sadmm_environment_worker *worker;
    struct sadmm_environment_state *states; /* (count); in a merged world of those that are marked alone */
    struct sadmm_environment_state *kept;   /* to reset to, the first is the template's; of size 0: forgotten */
    size_t kept_count;
    uint8_t *marked; /* (count) */
    char **marks;    /* (count) why; NULL where it is not marked, or no memory was left to say so */
    void *stream;    /* of the caller, whose work on inputs comes before a step; NULL: the default one */
    uint64_t *seen;  /* (count) the last call that named it */
    uint64_t calls;
    struct sadmm_bound_array *bound;
    size_t bound_count;
    struct sadmm_merged_world merged;
    struct sadmm_environment_contacts *contacts; /* (count) where they are recorded; else NULL */
    sadmm_settings settings; /* of all; a worker has one thread, and the gravity of the environment that it is */
};

#endif
