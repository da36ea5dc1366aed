/* What a run measures: filled step by step, then printed as a table or as JSON. */
#ifndef SADMM_CLI_RUN_RECORD_H
#define SADMM_CLI_RUN_RECORD_H

#include "cli.h"
#include "scenes/scenes.h"

enum run_phase { RUN_TOTAL, RUN_COLLIDE, RUN_ASSEMBLE, RUN_SOLVE, RUN_FINISH, RUN_PHASES };

struct run_body {
    sadmm_body_id id;
    int32_t index;   /* among all bodies of the world, as in `subadmm scenes SCENE --json` */
    double start[3]; /* m */
};

struct run_record {
    struct run_body *bodies; /* the dynamic ones */
    size_t body_count;
    double *ms[RUN_PHASES];  /* (steps) */
    size_t steps;            /* done */
    double contacts_sum;
    int32_t contacts_max;
    double penetration_max;  /* m, over the run */
    double joint_drift;      /* likewise */
    double ncp_max, momentum_max; /* over the run; -1: not certified */
    double iterations_sum;   /* over the steps, of their means over islands */
    double error;            /* m/s, the largest over the run; -1: not known */
    sadmm_step_error error_kind; /* of it */
    size_t met, unsolved_steps;  /* steps that met the stop rule; with an island that missed the tolerance */
    size_t limited_steps;    /* steps that slowed an island down (sadmm_step_report.limited) */
    struct sadmm_scene_result result; /* the scene's own measure of success */
    sadmm_step_report last;  /* of the last step; zero when steps is 0 */
    double speed_max, displacement_max; /* m/s, m, of the final state */
    bool finite;
    uint64_t hash;
    char failure[SADMM_MESSAGE_SIZE]; /* "" when every step succeeded */
};

/* False (with a message on stderr) when memory ran out or a state cannot be read. */
bool run_record_start(struct run_record *record, sadmm_world *world);
bool run_record_step(struct run_record *record, sadmm_world *world);
bool run_record_finish(struct run_record *record, sadmm_world *world);
void run_record_free(struct run_record *record);

/* Of `count` > 0 values: the median, and the value that 95 % of them do not exceed. Sorts a copy: memory may run out
 * (false). */
bool run_percentiles(const double *values, size_t count, double *median, double *p95);

json_t *run_record_json(const struct run_record *record, const char *spec, const struct sadmm_scene *scene);
void run_record_print(const struct run_record *record, const char *spec, const struct sadmm_scene *scene);

#endif
