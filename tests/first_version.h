/* The structs that may grow (subadmm/status.h), as they were in their first version, 0.1.0: programs compiled then go
 * on using them. Nothing here changes; a struct that a later version begins with is added.
 *
 * FIRST_x(M): M(type, name, dimensions) of every member of sadmm_x. */
#ifndef SADMM_TESTS_FIRST_VERSION_H
#define SADMM_TESTS_FIRST_VERSION_H

#include "subadmm/subadmm.h"

#define FIRST_settings(M) \
    M(size_t, struct_size, ) M(double, dt, ) M(int, substeps, ) M(double, gravity, [3]) M(sadmm_method, method, ) \
    M(double, tolerance, ) M(int, iterations, ) M(double, relaxation, ) M(int, penalty_period, ) \
    M(double, penalty_mass_factor, ) M(double, penalty_offset, ) M(double, penalty_ratio_limit, ) \
    M(bool, penalty_update_warm, ) \
    M(bool, warm_start, ) M(int, ncp_points, ) M(double, residual_tolerance, ) M(int, check_period, ) \
    M(bool, measure_residuals, ) M(bool, certify, ) M(bool, recover_wrenches, ) \
    M(double, correction_factor, ) M(double, slop, ) M(double, correction_speed, ) \
    M(double, restitution_threshold, ) M(int, hits, ) M(int, threads, )

#define FIRST_world_def(M) \
    M(size_t, struct_size, ) M(sadmm_backend, backend, ) M(sadmm_precision, precision, ) M(int, device, ) \
    M(double, contact_margin, ) M(sadmm_tasks, tasks, ) M(struct first_settings, settings, )

#define FIRST_body_def(M) \
    M(size_t, struct_size, ) M(const char *, name, ) M(sadmm_body_type, type, ) M(double, mass, ) \
    M(double, inertia, [3]) M(double, position, [3]) M(double, orientation, [4]) M(double, linear_velocity, [3]) \
    M(double, angular_velocity, [3]) M(int32_t, environment, ) M(double, gravity_scale, ) \
    M(double, linear_damping, ) M(double, angular_damping, )

#define FIRST_shape_def(M) \
    M(size_t, struct_size, ) M(sadmm_shape_type, type, ) M(double, size, [3]) M(double, position, [3]) \
    M(double, orientation, [4]) M(double, friction, ) M(double, restitution, ) M(uint32_t, category, ) \
    M(uint32_t, mask, ) M(bool, sensor, ) M(const sadmm_hull *, hull, ) M(const sadmm_mesh *, mesh, )

#define FIRST_joint_coordinate(M) \
    M(bool, limited, ) M(double, lower, ) M(double, upper, ) M(sadmm_drive, drive, ) M(double, target_position, ) \
    M(double, target_speed, ) M(double, drive_stiffness, ) M(double, drive_damping, ) M(double, drive_force, ) \
    M(double, friction, ) M(double, spring_stiffness, ) M(double, spring_damping, ) M(double, spring_rest, ) \
    M(double, armature, )

#define FIRST_joint_def(M) \
    M(size_t, struct_size, ) M(size_t, coordinate_size, ) M(sadmm_joint_kind, kind, ) M(uint32_t, locks, ) \
    M(sadmm_body_id, body_a, ) M(sadmm_body_id, body_b, ) M(double, position_a, [3]) M(double, orientation_a, [4]) \
    M(double, position_b, [3]) M(double, orientation_b, [4]) M(double, length, ) M(bool, collide, ) \
    M(bool, enabled, ) M(double, break_force, ) M(double, break_torque, ) \
    M(struct first_joint_coordinate, coordinates, [6])

#define FIRST_coupling_def(M) \
    M(size_t, struct_size, ) M(sadmm_body_id, body, ) M(double, position, [3]) M(double, orientation, [4]) \
    M(double, target_position, [3]) M(double, target_orientation, [4]) M(double, target_velocity, [6]) \
    M(double, linear_stiffness, ) M(double, linear_damping, ) M(double, angular_stiffness, ) \
    M(double, angular_damping, ) M(double, max_force, ) M(double, max_torque, ) M(bool, enabled, )

#define FIRST_gear_def(M) \
    M(size_t, struct_size, ) M(sadmm_joint_id, joint_1, ) M(int32_t, coordinate_1, ) M(sadmm_joint_id, joint_2, ) \
    M(int32_t, coordinate_2, ) M(double, ratio, ) M(double, offset, ) M(bool, enabled, )

#define FIRST_hull_def(M) \
    M(size_t, struct_size, ) M(const double *, points, ) M(size_t, point_count, ) M(double, merge, ) \
    M(double, convex_radius, )

#define FIRST_mesh_def(M) \
    M(size_t, struct_size, ) M(const double *, vertices, ) M(size_t, vertex_count, ) M(const int32_t *, triangles, ) \
    M(size_t, triangle_count, )

#define FIRST_heightfield_def(M) \
    M(size_t, struct_size, ) M(const double *, heights, ) M(int32_t, columns, ) M(int32_t, rows, ) \
    M(double, spacing, [2])

#define FIRST_mesh_file_def(M) \
    M(size_t, struct_size, ) M(const char *, path, ) M(const void *, bytes, ) M(size_t, size, ) \
    M(sadmm_mesh_file_format, format, ) M(double, scale, ) M(const char *, object, ) M(bool, merge, ) \
    M(bool, drop_degenerate, )

#define FIRST_query_filter(M) \
    M(size_t, struct_size, ) M(uint32_t, body_types, ) M(sadmm_body_id, ignored, ) M(int32_t, environment, ) \
    M(uint32_t, category, ) M(uint32_t, mask, ) M(bool, from_inside, ) M(bool, from_behind, ) M(bool, sensors, )

/* Callbacks have the size of pointers. */
#define FIRST_draw(M) \
    M(size_t, struct_size, ) M(void *, user, ) M(void *, line, ) M(void *, triangle, ) M(void *, point, ) \
    M(void *, text, ) M(void *, shape_colour, ) M(uint32_t, flags, ) M(int32_t, segments, ) M(double, force_scale, ) \
    M(double, axis_length, ) M(double, plane_size, ) M(double, lowest, [3]) M(double, highest, [3]) \
    M(int32_t, environment, )

#define FIRST_backend_info(M) \
    M(sadmm_backend, backend, ) M(const char *, name, ) M(bool, available, [2]) M(const char *, reason, )

#define FIRST_solve_report(M) \
    M(sadmm_backend, backend, ) M(sadmm_precision, precision, ) M(int, iterations, ) M(bool, converged, ) \
    M(int32_t, limited, ) M(sadmm_residual, residual, ) M(sadmm_certificate, certificate, ) M(double, solve_ms, ) \
    M(int, threads, )

#define FIRST_step_report(M) \
    M(sadmm_backend, backend, ) M(sadmm_precision, precision, ) M(int, threads, ) M(int64_t, step, ) \
    M(double, time, ) M(int32_t, bodies, ) M(int32_t, joints, ) M(int32_t, couplings, ) M(int32_t, contacts, ) \
    M(int32_t, pairs, ) M(int, iterations, ) M(double, iterations_mean, ) M(double, error, ) \
    M(sadmm_step_error, error_kind, ) M(int64_t, unsolved, ) M(bool, converged, ) M(int32_t, limited, ) \
    M(int64_t, repeated, ) M(double, penetration_max, ) M(double, joint_drift, ) M(sadmm_phase_times, ms, ) \
    M(double, certify_ms, ) M(sadmm_residual, residual, ) M(sadmm_certificate, certificate, )

#define FIRST_mesh_file_info(M) \
    M(sadmm_mesh_file_format, format, ) M(bool, binary, ) M(int64_t, vertices, ) M(int64_t, merged_vertices, ) \
    M(int64_t, unused_vertices, ) M(int64_t, faces, ) M(int64_t, split_faces, ) M(int64_t, crossing_faces, ) \
    M(int64_t, degenerate_triangles, ) M(int64_t, short_faces, ) M(int64_t, other_faces, ) M(int64_t, points, ) \
    M(int64_t, lines, ) M(int64_t, others, )

#define FIRST_MEMBER(type, name, dimensions) type name dimensions;
struct first_settings { FIRST_settings(FIRST_MEMBER) };
struct first_world_def { FIRST_world_def(FIRST_MEMBER) };
struct first_body_def { FIRST_body_def(FIRST_MEMBER) };
struct first_shape_def { FIRST_shape_def(FIRST_MEMBER) };
struct first_joint_coordinate { FIRST_joint_coordinate(FIRST_MEMBER) };
struct first_joint_def { FIRST_joint_def(FIRST_MEMBER) };
struct first_coupling_def { FIRST_coupling_def(FIRST_MEMBER) };
struct first_gear_def { FIRST_gear_def(FIRST_MEMBER) };
struct first_hull_def { FIRST_hull_def(FIRST_MEMBER) };
struct first_mesh_def { FIRST_mesh_def(FIRST_MEMBER) };
struct first_heightfield_def { FIRST_heightfield_def(FIRST_MEMBER) };
struct first_mesh_file_def { FIRST_mesh_file_def(FIRST_MEMBER) };
struct first_query_filter { FIRST_query_filter(FIRST_MEMBER) };
struct first_draw { FIRST_draw(FIRST_MEMBER) };
struct first_backend_info { FIRST_backend_info(FIRST_MEMBER) };
struct first_solve_report { FIRST_solve_report(FIRST_MEMBER) };
struct first_step_report { FIRST_step_report(FIRST_MEMBER) };
struct first_mesh_file_info { FIRST_mesh_file_info(FIRST_MEMBER) };

#endif
