/* A step's pose and box of every shape. */
#include "check_shape.h"
#include "core/math/lanes.h"
#include "kernels.h"

/* The larger box: this share of the shape's radius on every side, and the way it goes in some steps, up to its radius.
 * Larger: fewer updates, more pairs to test. A first sub-step renews it where the shape is about to leave it within the
 * step, so that the broad phase runs once a step unless velocities change much in it. */
#define ENLARGED_BY 0.1
#define STEPS_AHEAD 4
/* How far sub-steps search, as a share of the way that is left: the first one farthest, so that no later one finds, by
 * its rounding, what that one has not. */
#define SUBSTEPS_AHEAD 1.1

static bool contains(const struct sadmm_box3 *outer, const struct sadmm_box3 *inner)
{
    for (int k = 0; k < 3; ++k)
        if (!(outer->lo[k] <= inner->lo[k] && inner->hi[k] <= outer->hi[k])) return false;
    return true;
}

/* What the shape goes until its last sub-step, and a little more. */
static double way_left(const struct sadmm_collision_input *input, double velocity)
{
    return SUBSTEPS_AHEAD * input->substeps_left * (input->dt * velocity);
}

/* Where will the shape be in its last sub-step? */
static void move_on(const struct sadmm_box3 *box, const struct sadmm_proxy *p,
                    const struct sadmm_collision_input *input, struct sadmm_box3 *last)
{
    for (int k = 0; k < 3; ++k) {
        const double way = way_left(input, p->velocity[k]);
        last->lo[k] = box->lo[k] + way;
        last->hi[k] = box->hi[k] + way;
    }
}

/* Is the list of pairs good for the shape, and will it be in the sub-steps to come? */
static bool stays(const struct sadmm_broad_entry *entry, const struct sadmm_box3 *box, const struct sadmm_proxy *p,
                  const struct sadmm_collision_input *input)
{
    struct sadmm_box3 last;
    if (!contains(&entry->box, box)) return false;
    if (input->substeps_left == 0) return true;
    move_on(box, p, input, &last);
    return contains(&entry->box, &last);
}

static void enlarge(const struct sadmm_box3 *box, const struct sadmm_proxy *p,
                    const struct sadmm_collision_input *input, struct sadmm_box3 *larger)
{
    double radius = sadmm_body_moves(p->system_body) ? geometry_radius(&p->geometry) : 0;
    for (int k = 0; k < 3; ++k) {
        const double dt = input->dt * (1 + input->substeps_left),
                     most = fmax(radius, fabs(way_left(input, p->velocity[k])));
        double way = fmin(fmax(STEPS_AHEAD * dt * p->velocity[k], -most), most);
        larger->lo[k] = box->lo[k] - ENLARGED_BY * radius + fmin(way, 0.0);
        larger->hi[k] = box->hi[k] + ENLARGED_BY * radius + fmax(way, 0.0);
    }
}

/* A plane has no box: its entry remembers a point and the normal. */
static bool plane_stays(const struct sadmm_broad_entry *entry, const struct sadmm_proxy *plane)
{
    for (int k = 0; k < 3; ++k)
        if (!(entry->box.lo[k] == plane->x[k] && entry->box.hi[k] == plane->R[3 * k + 2])) return false;
    return true;
}

/* Pose and box of a slot; its entry, enlarged, when the old one does not hold it any more. */
static void update_slot(struct sadmm_candidates *c, const struct sadmm_collision_input *input, size_t slot,
                        const struct proxy_pose *pose, bool renew)
{
    const struct sadmm_shape *shape = slot < input->shape_count ? &input->shapes[slot] : NULL;
    struct sadmm_broad_entry *entry = &c->entries[slot];
    struct sadmm_seen *seen = &c->seen[slot], now = {0};
    const struct sadmm_collision_body *body;
    const struct sadmm_geometry *geometry;
    struct sadmm_error refusal;
    unsigned char kind, seams;
    bool plane, same;

    if (!shape || !sadmm_shape_collides(shape)) {
        const bool was_plane = seen->alive && !entry->present;
        c->state[slot] = (unsigned char)((seen->alive ? SLOT_LEFT | SLOT_SEAMS : 0) | (was_plane ? SLOT_PLANE : 0));
        entry->present = false;
        *seen = now;
        return;
    }
    body = &input->bodies[shape->body];
    now.revision = shape->revision;
    now.formed = shape->formed;
    now.body = shape->body;
    now.group = body->environment;
    now.alive = true;
    now.moves = body->system_body >= 0;
    now.still = body->system_body == -1;
    now.placed = now.still ? body->placed : 0;
    same = seen->alive && seen->revision == now.revision && seen->formed == now.formed && seen->body == now.body &&
           seen->group == now.group && seen->moves == now.moves;
    seams = same && seen->still == now.still && seen->placed == now.placed ? 0 : SLOT_SEAMS;
    same = same && !renew;
    seen->still = now.still;
    seen->placed = now.placed;
    if (!same && sadmm_collision_check_shape(input, slot, &refusal) != SADMM_OK) {
        c->state[slot] = SLOT_REFUSED;
        return;
    }
    geometry = &input->geometries[shape->geometry];
    plane = geometry->type == SADMM_SHAPE_PLANE;
    kind = (unsigned char)((plane ? SLOT_PRESENT | SLOT_PLANE : SLOT_PRESENT) | seams);
    proxy_put(shape, geometry, body, pose, input->dt, input->margin, input->gravity, &c->proxies[slot],
              &c->boxes[slot].box);
    c->boxes[slot].of_plane = plane;
    if (!plane) swept_box_make(c->proxies[slot].velocity, input->dt, &c->boxes[slot]);
    c->state[slot] = kind;
    if (same && (plane ? plane_stays(entry, &c->proxies[slot])
                       : stays(entry, &c->boxes[slot].box, &c->proxies[slot], input)))
        return;
    c->state[slot] = (unsigned char)(kind | SLOT_LEFT);
    *seen = now;
    entry->present = !plane;
    entry->group = now.group;
    entry->moves = now.moves;
    if (plane) {
        for (int k = 0; k < 3; ++k) {
            entry->box.lo[k] = c->proxies[slot].x[k];
            entry->box.hi[k] = c->proxies[slot].R[3 * k + 2];
        }
    } else {
        enlarge(&c->boxes[slot].box, &c->proxies[slot], input, &entry->box);
    }
}

/* ---- turning ----------------------------------------------------------------------------------------------------- */

enum { LANES = 4, TURNED_AT_ONCE = 16 };

/* A shape that is to be turned. */
struct turning {
    const struct sadmm_shape *shape;
    const struct sadmm_collision_body *body;
    double since;
    struct proxy_pose *to;
};

_Static_assert(sizeof(struct proxy_pose) == 14 * sizeof(double), "what turn_four writes");

/* proxy_turn_since and proxy_pose_of, four at once. */
static void turn_four(const struct turning four[LANES], double dt)
{
    lanes start[4], w[4], own[4], place[4];
    const double *at[4][LANES];
    double *to[LANES];
    lanes_mask moves;
    for (int k = 0; k < LANES; ++k) {
        const struct sadmm_collision_body *body = four[k].body;
        at[0][k] = body->orientation, at[1][k] = body->velocity + 2;
        at[2][k] = four[k].shape->orientation, at[3][k] = four[k].shape->position;
        to[k] = (double *)four[k].to;
        moves[k] = sadmm_body_moves(body->system_body) ? -1 : 0;
    }
    lanes_gather(at[0], start);
    lanes_gather(at[1], w);
    lanes_gather(at[2], own);
    lanes_gather(at[3], place);
    const lanes since = {four[0].since, four[1].since, four[2].since, four[3].since}, zero = lanes_fill(0),
                left = lanes_fill(dt) - since, rate = lanes_root(w[1] * w[1] + w[2] * w[2] + w[3] * w[3]),
                most = lanes_fill(MIDPOINT_TURN),
                offset = since + lanes_choose(rate * left > lanes_fill(2 * MIDPOINT_TURN), most / rate,
                                              lanes_fill(0.5) * left),
                half = lanes_fill(0.5) * (offset - since);
    const struct lanes_quat from = {start[0], start[1], start[2], start[3]},
                            turn = {lanes_fill(1), half * w[1], half * w[2], half * w[3]},
                            turned = lanes_quat_normalize(lanes_quat_mul(turn, from)),
                            body = {lanes_choose(moves, turned.w, from.w), lanes_choose(moves, turned.x, from.x),
                                    lanes_choose(moves, turned.y, from.y), lanes_choose(moves, turned.z, from.z)},
                            shape = lanes_quat_normalize(
                                lanes_quat_mul(body, (struct lanes_quat){own[0], own[1], own[2], own[3]}));
    const struct lanes_matrix R = lanes_matrix_of(shape), B = lanes_matrix_of(body);
    const struct lanes3 arm = lanes_turn(&B, (struct lanes3){place[0], place[1], place[2]}), *r = R.r;
    const lanes turned_rate = lanes_choose(moves, rate, zero), turned_offset = lanes_choose(moves, offset, zero);
    lanes_scatter(r[0].x, r[0].y, r[0].z, r[1].x, to, 0);
    lanes_scatter(r[1].y, r[1].z, r[2].x, r[2].y, to, 4);
    lanes_scatter(r[2].z, arm.x, arm.y, arm.z, to, 8);
    for (int k = 0; k < LANES; ++k) four[k].to->rate = turned_rate[k], four[k].to->time_offset = turned_offset[k];
}

/* Where there are not four, others are turned to nowhere. */
static void turn_all(struct turning *turning, int count, double dt)
{
    struct proxy_pose nowhere;
    for (; count % LANES; ++count) {
        turning[count] = turning[count - 1];
        turning[count].to = &nowhere;
    }
    for (int first = 0; first < count; first += LANES) turn_four(turning + first, dt);
}

void SADMM_COLLISION_KERNEL(place_slots)(struct sadmm_candidates *c, const struct sadmm_collision_input *input,
                                         size_t begin, size_t end, bool renew)
{
    struct proxy_pose poses[TURNED_AT_ONCE];
    struct turning turning[TURNED_AT_ONCE];
    for (size_t last; begin < end; begin = last) {
        int count = 0;
        last = end - begin < TURNED_AT_ONCE ? end : begin + TURNED_AT_ONCE;
        for (size_t slot = begin; slot < last && slot < input->shape_count; ++slot) {
            const struct sadmm_shape *shape = &input->shapes[slot];
            if (!sadmm_shape_collides(shape)) continue;
            turning[count++] = (struct turning){shape, &input->bodies[shape->body],
                                                input->since ? input->since[shape->body] : 0, &poses[slot - begin]};
        }
        turn_all(turning, count, input->dt);
        for (size_t slot = begin; slot < last; ++slot) update_slot(c, input, slot, &poses[slot - begin], renew);
    }
}
