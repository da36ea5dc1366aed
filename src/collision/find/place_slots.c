/* A step's pose and box of every shape. */
#include "check_shape.h"
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
                        const struct proxy_turn *turn, bool renew)
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
    now.body = shape->body;
    now.group = body->environment;
    now.alive = true;
    now.moves = body->system_body >= 0;
    now.still = body->system_body == -1;
    now.placed = now.still ? body->placed : 0;
    same = seen->alive && seen->revision == now.revision && seen->body == now.body && seen->group == now.group &&
           seen->moves == now.moves;
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
    proxy_place(shape, geometry, body, turn, input->dt, input->margin, input->gravity, &c->proxies[slot],
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

/* Turning a shape is a long chain of roots and divisions: several shapes' at once, none waits for another's. */
enum { TURNED_AT_ONCE = 16 };

void SADMM_COLLISION_KERNEL(place_slots)(struct sadmm_candidates *c, const struct sadmm_collision_input *input,
                                         size_t begin, size_t end, bool renew)
{
    struct proxy_turn turns[TURNED_AT_ONCE];
    for (size_t last; begin < end; begin = last) {
        last = end - begin < TURNED_AT_ONCE ? end : begin + TURNED_AT_ONCE;
        for (size_t slot = begin; slot < last && slot < input->shape_count; ++slot) {
            const struct sadmm_shape *shape = &input->shapes[slot];
            if (!sadmm_shape_collides(shape)) continue;
            const double since = input->since ? input->since[shape->body] : 0;
            turns[slot - begin] = proxy_turn_since(shape, &input->bodies[shape->body], since, input->dt);
        }
        for (size_t slot = begin; slot < last; ++slot) update_slot(c, input, slot, &turns[slot - begin], renew);
    }
}
