/* The entries of the kernel table for one precision, in C: CUDA(name) is set by the includer. */
#include "layout.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether a device can be used; *about (static storage): what was found, or why not. */
bool CUDA(probe)(const char **about);
/* Whole steps: the first capacities for candidates and points; 0: by the number of shapes (tests). */
void CUDA(tune_capacities)(struct sadmm_context *, int64_t first_capacity);
void CUDA(set_tier)(struct sadmm_context *, enum sadmm_cuda_tier tier);
/* For tests: blocks a cluster where there are clusters (0: as likely the fastest); what `live` says from now on. */
void CUDA(set_cluster)(struct sadmm_context *, int blocks);
sadmm_status CUDA(set_abort)(struct sadmm_context *, enum cuda_abort, struct sadmm_error *);
enum sadmm_cuda_tier CUDA(get_tier)(const struct sadmm_context *, int32_t *blocks);

/* For tests: a convergence check after `done` iterations of a solve; *unmet: islands that do not meet it yet. */
sadmm_status CUDA(check_convergence)(struct sadmm_context *, int done, int32_t *unmet, struct sadmm_error *);

/* For tests: statistics and layout of the last begin's system once more, for this partition, aborted from the start or
 * not; `way`: of enum cuda_layout_way. */
sadmm_status CUDA(lay_out_again)(struct sadmm_context *, const struct cuda_partition *, enum cuda_abort, int way,
                                 struct cuda_layout_copy *, struct sadmm_error *);

sadmm_status CUDA(create)(int device, struct sadmm_context **out, struct sadmm_error *error);
void CUDA(destroy)(struct sadmm_context *);
sadmm_status CUDA(begin)(struct sadmm_context *, const struct sadmm_system *, const struct sadmm_plan *,
                         const struct sadmm_settings *, struct sadmm_error *);
sadmm_status CUDA(assemble_bodies)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(assemble_contacts)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(assemble_rows)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(init_penalty)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(update_weights)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(factorize)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(update_velocity)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(update_constraints)(struct sadmm_context *, bool measure, struct sadmm_error *);
sadmm_status CUDA(iterate)(struct sadmm_context *, int count, bool goes_on, bool measure, struct sadmm_error *);
sadmm_status CUDA(measure_residuals)(struct sadmm_context *, struct sadmm_residual *, struct sadmm_error *);
sadmm_status CUDA(update_penalty)(struct sadmm_context *, double ratio, struct sadmm_error *);
sadmm_status CUDA(limit_energy)(struct sadmm_context *, int32_t *limited, struct sadmm_error *);
sadmm_status CUDA(read_solution)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CUDA(read_penalty)(struct sadmm_context *, double *beta, struct sadmm_error *);
sadmm_status CUDA(integrate)(struct sadmm_context *, struct sadmm_rigid *next, struct sadmm_error *);
sadmm_status CUDA(recover_wrenches)(struct sadmm_context *, double *wrench, struct sadmm_error *);

/* core/solve/resident.h */
sadmm_status CUDA(load_world)(struct sadmm_context *, const struct sadmm_resident_world *,
                              const struct sadmm_settings *, struct sadmm_error *);
sadmm_status CUDA(step_world)(struct sadmm_context *, const struct sadmm_settings *,
                              const struct sadmm_resident_update *, size_t, struct sadmm_error *);
sadmm_status CUDA(wait_world)(struct sadmm_context *, struct sadmm_resident_report *, struct sadmm_error *);
sadmm_status CUDA(read_bodies)(struct sadmm_context *, struct sadmm_rigid *, struct sadmm_extrapolation *,
                               double *wrench, struct sadmm_error *);
sadmm_status CUDA(read_kinematic)(struct sadmm_context *, struct sadmm_kinematic_body *, double *wrench,
                                  double *velocity, struct sadmm_error *);
sadmm_status CUDA(read_contacts)(struct sadmm_context *, struct sadmm_contact_set *, struct sadmm_error *);
sadmm_status CUDA(read_hits)(struct sadmm_context *, struct sadmm_world_hit *, size_t capacity, size_t *count,
                             size_t *first, struct sadmm_error *);
sadmm_status CUDA(read_touching)(struct sadmm_context *, struct sadmm_touching_shapes *, struct sadmm_error *);
sadmm_status CUDA(view_world)(struct sadmm_context *, struct sadmm_resident_view *, struct sadmm_error *);
sadmm_status CUDA(read_start)(struct sadmm_context *, struct sadmm_rigid *, double *velocity, double *impulse,
                              struct sadmm_error *);
sadmm_status CUDA(read_joints)(struct sadmm_context *, struct sadmm_joint_memory *, struct sadmm_coupling_memory *,
                               double *gear_force, struct sadmm_error *);
sadmm_status CUDA(read_rows)(struct sadmm_context *, struct sadmm_rows *, double *solution, double *velocity,
                             struct sadmm_error *);
sadmm_status CUDA(allocate)(struct sadmm_context *, size_t bytes, void **out, struct sadmm_error *);
void CUDA(release)(struct sadmm_context *, void *memory);
size_t CUDA(memory)(const struct sadmm_context *);
sadmm_status CUDA(to_backend)(struct sadmm_context *, void *to, const void *from, size_t bytes, struct sadmm_error *);
sadmm_status CUDA(from_backend)(struct sadmm_context *, void *to, const void *from, size_t bytes,
                                struct sadmm_error *);
bool CUDA(has_array)(int32_t array, bool in);
sadmm_status CUDA(exchange)(struct sadmm_context *, const struct sadmm_resident_copies *,
                            const struct sadmm_resident_array *, bool in, const uint8_t *left, uint8_t *refused,
                            void *stream, struct sadmm_error *);
sadmm_status CUDA(measure)(struct sadmm_context *, const struct sadmm_resident_copies *, struct sadmm_copy_measures *,
                           struct sadmm_error *);
sadmm_status CUDA(keep_state)(struct sadmm_context *, const struct sadmm_resident_copies *,
                              const struct sadmm_resident_state *, void **out, struct sadmm_error *);
sadmm_status CUDA(put_states)(struct sadmm_context *, const struct sadmm_resident_copies *, int32_t count,
                              const int32_t *which, void *const *states, bool *fits, struct sadmm_error *);

#ifdef __cplusplus
}
#endif
