#include "problem_builder.h"

#include <stdio.h>

#include "core/base/memory.h"

void problem_builder_start(struct problem_builder *builder)
{
    *builder = (struct problem_builder){.dt = 0.005, .gravity = {0, 0, -9.81}};
}

void problem_builder_free(struct problem_builder *builder)
{
    sadmm_free(builder->bodies);
    sadmm_free(builder->contacts);
    sadmm_free(builder->joints);
}

struct built_body *problem_builder_box(struct problem_builder *builder, double mass, vec3 half_extents, vec3 position)
{
    static struct built_body lost; /* written, never read: finish refuses what is incomplete */
    size_t n = builder->body_count;
    if (!SADMM_GROW(builder->bodies, n, n + 1)) {
        builder->out_of_memory = true;
        return &lost;
    }
    vec3 h = half_extents;
    builder->bodies[n] = (struct built_body){
        .mass = mass,
        .inertia = v3_scale(v3(h.y * h.y + h.z * h.z, h.x * h.x + h.z * h.z, h.x * h.x + h.y * h.y), mass / 3),
        .position = position,
        .orientation = {1, 0, 0, 0},
    };
    ++builder->body_count;
    return &builder->bodies[n];
}

static vec3 arm(const struct problem_builder *builder, int32_t body, vec3 point)
{
    return body < 0 ? v3(0, 0, 0) : v3_sub(point, builder->bodies[body].position);
}

void problem_builder_contact(struct problem_builder *builder, int32_t body, int32_t below, vec3 point, vec3 normal,
                             double friction)
{
    size_t n = builder->contact_count;
    if (builder->out_of_memory || !SADMM_GROW(builder->contacts, n, n + 1)) {
        builder->out_of_memory = true;
        return;
    }
    sadmm_problem_contact *contact = &builder->contacts[builder->contact_count++];
    *contact = (sadmm_problem_contact){.body_a = below, .body_b = body, .friction = friction};
    v3_store(v3_scale(normal, 1 / v3_norm(normal)), contact->normal);
    v3_store(arm(builder, below, point), contact->arm_a);
    v3_store(arm(builder, body, point), contact->arm_b);
}

void problem_builder_rectangle(struct problem_builder *builder, int32_t body, int32_t below, const double x[2],
                               const double y[2], double z, double friction)
{
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
            problem_builder_contact(builder, body, below, v3(x[i], y[j], z), v3(0, 0, 1), friction);
}

/* x = sign (v + w x r): rows (sign I, -sign [r]x). */
static void ball_rows(double sign, vec3 r, double jacobian[36])
{
    const vec3 axes[3] = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)};
    for (int k = 0; k < 3; ++k) {
        v3_store(v3_scale(axes[k], sign), jacobian + 6 * k);
        v3_store(v3_scale(v3_cross(r, axes[k]), sign), jacobian + 6 * k + 3);
    }
}

void problem_builder_ball(struct problem_builder *builder, int32_t a, int32_t b, vec3 point)
{
    size_t n = builder->joint_count;
    if (builder->out_of_memory || !SADMM_GROW(builder->joints, n, n + 1)) {
        builder->out_of_memory = true;
        return;
    }
    sadmm_problem_block *joint = &builder->joints[builder->joint_count++];
    *joint = (sadmm_problem_block){.kind = SADMM_BLOCK_HARD, .rows = 3, .body_a = a, .body_b = b};
    ball_rows(1, arm(builder, a, point), joint->jacobian_a);
    ball_rows(-1, arm(builder, b, point), joint->jacobian_b);
}

static vec3 point_velocity(const double *velocities, int32_t body, const double arm_[3])
{
    if (body < 0) return v3(0, 0, 0);
    const double *v = velocities + 6 * (size_t)body;
    return v3_add(v3_load(v), v3_cross(v3_load(v + 3), v3_load(arm_)));
}

double problem_builder_approach(const struct problem_builder *builder, size_t contact, const double *velocities)
{
    const sadmm_problem_contact *c = &builder->contacts[contact];
    return v3_dot(v3_load(c->normal), v3_sub(point_velocity(velocities, c->body_b, c->arm_b),
                                             point_velocity(velocities, c->body_a, c->arm_a)));
}

/* A = (m I, R diag(I) R^T), v = start velocity + dt g, b = A v. */
static void assemble(const struct problem_builder *builder, size_t i, double A[36], double b[6], double v0[6])
{
    const struct built_body *body = &builder->bodies[i];
    mat3 R = q_matrix(q_normalize(body->orientation));
    double v[6];
    for (int r = 0; r < 3; ++r) {
        A[7 * r] = body->mass;
        for (int c = 0; c < 3; ++c)
            A[6 * (3 + r) + 3 + c] = R.r[r].x * body->inertia.x * R.r[c].x + R.r[r].y * body->inertia.y * R.r[c].y +
                                     R.r[r].z * body->inertia.z * R.r[c].z;
    }
    v3_store(body->linear, v0);
    v3_store(body->angular, v0 + 3);
    v3_store(v3_madd(body->linear, builder->dt, builder->gravity), v);
    v3_store(body->angular, v + 3);
    for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 6; ++c) b[r] += A[6 * r + c] * v[c];
}

static sadmm_status fill(const struct problem_builder *builder, sadmm_problem *problem, double *A, double *b,
                         double *v0)
{
    for (size_t i = 0; i < builder->body_count; ++i) assemble(builder, i, A + 36 * i, b + 6 * i, v0 + 6 * i);
    sadmm_status status = sadmm_problem_set_bodies(problem, (int32_t)builder->body_count, A, b, v0);
    if (status == SADMM_OK)
        status = sadmm_problem_set_contacts(problem, (int32_t)builder->contact_count, builder->contacts, NULL);
    if (status == SADMM_OK)
        status = sadmm_problem_set_blocks(problem, (int32_t)builder->joint_count, builder->joints, NULL);
    return status;
}

sadmm_status problem_builder_finish(const struct problem_builder *builder, sadmm_problem **out,
                                    struct sadmm_error *error)
{
    size_t n = builder->body_count;
    *out = NULL;
    double *values = builder->out_of_memory ? NULL : sadmm_alloc(48 * n, sizeof *values);
    if (!values) return sadmm_fail_memory(error, "the problem's bodies");
    sadmm_problem *problem;
    sadmm_status status = sadmm_problem_create(&problem);
    if (status == SADMM_OK) {
        status = fill(builder, problem, values, values + 36 * n, values + 42 * n);
        if (status == SADMM_OK) {
            *out = problem;
        } else {
            char message[SADMM_MESSAGE_SIZE];
            snprintf(message, sizeof message, "%s", sadmm_problem_message(problem));
            sadmm_fail(error, status, "%s", message);
            sadmm_problem_destroy(problem);
        }
    } else {
        sadmm_fail_memory(error, "the problem");
    }
    sadmm_free(values);
    return status;
}
