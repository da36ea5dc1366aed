/* One precision's kernel table, from device/entries.h's symbols with a suffix. */
#ifndef SADMM_CUDA_TABLE_TABLES_H
#define SADMM_CUDA_TABLE_TABLES_H

#define CUDA_TABLE(suffix, floats)                             \
    {                                                          \
        .backend = SADMM_BACKEND_CUDA,                         \
        .precision = floats,                                   \
        .variant = "cuda",                                     \
        .create = sadmm_cuda_create##suffix,                   \
        .destroy = sadmm_cuda_destroy##suffix,                 \
        .begin = sadmm_cuda_begin##suffix,                     \
        .assemble_bodies = sadmm_cuda_assemble_bodies##suffix, \
        .assemble_contacts = sadmm_cuda_assemble_contacts##suffix, \
        .assemble_rows = sadmm_cuda_assemble_rows##suffix, \
        .init_penalty = sadmm_cuda_init_penalty##suffix,       \
        .update_weights = sadmm_cuda_update_weights##suffix,   \
        .factorize = sadmm_cuda_factorize##suffix,             \
        .update_velocity = sadmm_cuda_update_velocity##suffix, \
        .update_constraints = sadmm_cuda_update_constraints##suffix, \
        .iterate = sadmm_cuda_iterate##suffix,                 \
        .measure_residuals = sadmm_cuda_measure_residuals##suffix, \
        .update_penalty = sadmm_cuda_update_penalty##suffix,   \
        .limit_energy = sadmm_cuda_limit_energy##suffix,       \
        .read_solution = sadmm_cuda_read_solution##suffix,     \
        .read_penalty = sadmm_cuda_read_penalty##suffix,       \
        .integrate = sadmm_cuda_integrate##suffix,             \
        .recover_wrenches = sadmm_cuda_recover_wrenches##suffix, \
        .resident = &(const struct sadmm_resident_kernels){    \
            .load = sadmm_cuda_load_world##suffix,             \
            .step = sadmm_cuda_step_world##suffix,             \
            .wait = sadmm_cuda_wait_world##suffix,             \
            .read_bodies = sadmm_cuda_read_bodies##suffix,     \
            .read_kinematic = sadmm_cuda_read_kinematic##suffix, \
            .view = sadmm_cuda_view_world##suffix,             \
            .read_contacts = sadmm_cuda_read_contacts##suffix, \
            .read_touching = sadmm_cuda_read_touching##suffix, \
            .read_hits = sadmm_cuda_read_hits##suffix, \
            .read_start = sadmm_cuda_read_start##suffix,       \
            .read_joints = sadmm_cuda_read_joints##suffix,     \
            .read_rows = sadmm_cuda_read_rows##suffix,         \
            .allocate = sadmm_cuda_allocate##suffix,           \
            .release = sadmm_cuda_release##suffix,             \
            .memory = sadmm_cuda_memory##suffix,               \
            .to_backend = sadmm_cuda_to_backend##suffix,       \
            .from_backend = sadmm_cuda_from_backend##suffix,   \
            .has_array = sadmm_cuda_has_array##suffix,         \
            .exchange = sadmm_cuda_exchange##suffix,           \
            .measure = sadmm_cuda_measure##suffix,             \
            .keep_state = sadmm_cuda_keep_state##suffix,       \
            .put_states = sadmm_cuda_put_states##suffix,       \
        },                                                     \
    }

#endif
