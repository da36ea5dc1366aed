#include "draw_marks.h"

#include "core/model/joint_law.h"
#include "pen.h"
#include "world/objects/contacts.h"

enum {
    RED = 0xE03C31,
    GREEN = 0x3CB44B,
    BLUE = 0x4363D8,
    GREY = 0x9A9A9A,
    ARM = 0xC8C8C8,
    POINT = 0xFFD700,
    FORCE = 0xFF4500,
    CENTRE = 0xFFFFFF,
    ISLAND = 0xB15DFF,
    TEXT = 0xFFFFFF
};

/* Contacts that are read at a time. */
enum { CONTACTS = 16 };

bool sadmm_draw_sees_body(const sadmm_world *world, const sadmm_draw *draw, int32_t slot)
{
    if (slot < 0 || draw->environment < 0) return true;
    const int32_t own = world->bodies[slot].environment;
    return own < 0 || own == draw->environment;
}

bool sadmm_draw_sees_point(const sadmm_draw *draw, const double x[3])
{
    for (int k = 0; k < 3; ++k)
        if (!(x[k] >= draw->lowest[k] && x[k] <= draw->highest[k])) return false;
    return true;
}

static void draw_point(const sadmm_draw *draw, const double x[3], uint32_t colour)
{
    if (draw->point) draw->point(draw->user, x, colour);
}

static void draw_text(const sadmm_draw *draw, const double x[3], const char *text)
{
    if (draw->text && *text) draw->text(draw->user, x, text, TEXT);
}

static void draw_line(const sadmm_draw *draw, vec3 from, vec3 to, uint32_t colour)
{
    double ends[2][3];
    if (!draw->line) return;
    v3_store(from, ends[0]);
    v3_store(to, ends[1]);
    draw->line(draw->user, ends[0], ends[1], colour);
}

static void draw_axes(const sadmm_draw *draw, vec3 at, quat turn, bool grey)
{
    static const uint32_t colours[3] = {RED, GREEN, BLUE};
    const mat3 R = q_matrix(q_normalize(turn));
    for (int k = 0; k < 3; ++k)
        draw_line(draw, at, v3_add(at, m3_mul(R, v3_axis(k, draw->axis_length))), grey ? GREY : colours[k]);
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

void sadmm_draw_bodies(const sadmm_world *world, const sadmm_draw *draw)
{
    for (SADMM_OBJECTS(slot, &world->body_ids)) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        const double *x = body->rigid.position;
        if (!sadmm_draw_sees_body(world, draw, (int32_t)slot) || !sadmm_draw_sees_point(draw, x)) continue;
        if (draw->flags & SADMM_DRAW_CENTRES && body->type == SADMM_BODY_DYNAMIC) {
            draw_point(draw, x, CENTRE);
            draw_axes(draw, v3_load(x), q_load(body->rigid.orientation), false);
        }
        if (draw->flags & SADMM_DRAW_NAMES) draw_text(draw, x, sadmm_tags_name(&world->body_ids.tags, slot));
    }
}

/* ---- joints and couplings ---------------------------------------------------------------------------------------- */

static const struct sadmm_rigid *rigid_of(const sadmm_world *world, int32_t slot)
{
    return slot >= 0 ? &world->bodies[slot].rigid : NULL;
}

void sadmm_draw_joints(const sadmm_world *world, const sadmm_draw *draw)
{
    for (SADMM_OBJECTS(slot, &world->joint_ids)) {
        const struct sadmm_world_joint *joint = &world->joints[slot];
        struct joint_end ends[2];
        double at[3];
        for (int s = 0; s < 2; ++s) ends[s] = joint_end_on(&joint->frame[s], rigid_of(world, joint->body[s]));
        v3_store(ends[1].point, at);
        if (!sadmm_draw_sees_body(world, draw, joint->body[0]) ||
            !sadmm_draw_sees_body(world, draw, joint->body[1]) || !sadmm_draw_sees_point(draw, at))
            continue;
        if (draw->flags & SADMM_DRAW_NAMES) draw_text(draw, at, sadmm_tags_name(&world->joint_ids.tags, slot));
        if (!(draw->flags & SADMM_DRAW_JOINTS)) continue;
        for (int s = 0; s < 2; ++s) {
            draw_axes(draw, ends[s].point, ends[s].orientation, !joint->def.enabled);
            if (joint->body[s] >= 0)
                draw_line(draw, v3_load(world->bodies[joint->body[s]].rigid.position), ends[s].point,
                          joint->def.enabled ? ARM : GREY);
        }
        draw_line(draw, ends[0].point, ends[1].point, joint->def.enabled ? ARM : GREY);
    }
}

void sadmm_draw_couplings(const sadmm_world *world, const sadmm_draw *draw)
{
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        const struct sadmm_world_coupling *coupling = &world->couplings[slot];
        const struct sadmm_rigid *target = &coupling->last.target;
        const int32_t body = coupling->joint.body[1];
        const struct joint_end end = joint_end_on(&coupling->joint.frame[1], rigid_of(world, body));
        double at[3];
        v3_store(end.point, at);
        if (!sadmm_draw_sees_body(world, draw, body) || !sadmm_draw_sees_point(draw, at)) continue;
        draw_axes(draw, end.point, end.orientation, !coupling->def.enabled);
        draw_axes(draw, v3_load(target->position), q_load(target->orientation), !coupling->def.enabled);
        draw_line(draw, end.point, v3_load(target->position), coupling->def.enabled ? ARM : GREY);
    }
}

/* ---- contacts and islands ---------------------------------------------------------------------------------------- */

static void draw_contact(const sadmm_draw *draw, const sadmm_contact *contact)
{
    const vec3 at = v3_load(contact->position);
    if (draw->flags & SADMM_DRAW_CONTACTS) {
        draw_point(draw, contact->position, POINT);
        draw_line(draw, at, v3_madd(at, draw->axis_length, v3_load(contact->normal)), POINT);
    }
    if (draw->flags & SADMM_DRAW_FORCES)
        draw_line(draw, at, v3_madd(at, draw->force_scale, v3_load(contact->force)), FORCE);
}

void sadmm_draw_contacts(const sadmm_world *world, const sadmm_draw *draw)
{
    const int32_t all = sadmm_world_readable_contacts(world);
    sadmm_contact contacts[CONTACTS];
    for (int32_t first = 0; first < all; first += CONTACTS) {
        const int32_t count = all - first < CONTACTS ? all - first : CONTACTS;
        sadmm_world_copy_contacts(world, first, count, contacts);
        for (int32_t k = 0; k < count; ++k)
            if (sadmm_draw_sees_body(world, draw, (int32_t)contacts[k].body_a.slot - 1) &&
                sadmm_draw_sees_body(world, draw, (int32_t)contacts[k].body_b.slot - 1) &&
                sadmm_draw_sees_point(draw, contacts[k].position))
                draw_contact(draw, &contacts[k]);
    }
}

/* Two bodies that are connected, if both move by forces. */
static void draw_connection(const sadmm_world *world, const sadmm_draw *draw, int32_t a, int32_t b)
{
    if (a < 0 || b < 0 || a == b || !sadmm_draw_sees_body(world, draw, a) || !sadmm_draw_sees_body(world, draw, b))
        return;
    const struct sadmm_world_body *of_a = &world->bodies[a], *of_b = &world->bodies[b];
    if (of_a->type != SADMM_BODY_DYNAMIC || of_b->type != SADMM_BODY_DYNAMIC ||
        !(sadmm_draw_sees_point(draw, of_a->rigid.position) || sadmm_draw_sees_point(draw, of_b->rigid.position)))
        return;
    draw_line(draw, v3_load(of_a->rigid.position), v3_load(of_b->rigid.position), ISLAND);
}

void sadmm_draw_islands(const sadmm_world *world, const sadmm_draw *draw)
{
    const struct sadmm_contact_set *contacts = &world->contacts;
    for (size_t p = 0; world->contacts_readable && p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        if (pair->count > 0)
            draw_connection(world, draw, world->shapes[pair->shape_a].body, world->shapes[pair->shape_b].body);
    }
    for (SADMM_OBJECTS(slot, &world->joint_ids)) {
        const struct sadmm_world_joint *joint = &world->joints[slot];
        if (joint->def.enabled) draw_connection(world, draw, joint->body[0], joint->body[1]);
    }
}
