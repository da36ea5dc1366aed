/* What a body cannot turn away from: the ball about its centre of mass that its shape holds.
 *
 * A contact is linear in the velocities. Its point may stay outside by turning alone, with the centre of mass going on
 * into the other body: right for small turns, but what is small is turned by radians within a step when it is hit, and
 * ends up on the other side of what is thin. The ball about the centre of mass is part of the body however it turns, so
 * where a pair is fast it has a contact of its own: along the manifold's normal if that is much the same, or else in
 * the manifold's place, together with the deepest point of the shape.
 *
 * A manifold that is deep says by least depth, if the pair remembers nothing that holds, which way is out. If that is
 * not where the ball is, which is outside, it is where the ball is.
 */
#ifndef SADMM_COLLISION_MANIFOLD_INNER_BALL_H
#define SADMM_COLLISION_MANIFOLD_INNER_BALL_H

#include "advance.h"

/* Cosine with the manifold's normal from which the ball's contact is one more point of it. */
#define INNER_BALL_ALONG      ((real)0.7)
/* What goes by more than this many radii of its ball in a step has the ball's contact alone: how a hit would make it
 * turn within the step has nothing to do with one contact that is linear, and a share of its speed that iterations
 * leave would take it through. The ball's contact by itself is solved at once. */
#define INNER_BALL_ALONE      4.0
/* Bodies whose surface turns by less than this share of their thickness in a step do not sink by turning. */
#define INNER_TURNS           0.02
/* Shares of the thinner shape. Deeper than that which way out a manifold says is a question. A body that rocks by so
 * much in a step may sink on by points that take turns, each of them deeper than the last. */
#define INNER_ASKS_SIDE       0.5
#define INNER_SINKS           0.05
#define INNER_ROCKS           0.2

/* Is p's body one that the other's does not move much? Its mass goes by its inertia and size. */
SADMM_INLINE bool inner_is_heavy(const struct sadmm_proxy *p, const struct sadmm_proxy *other)
{
    const double size = proxy_size(p), other_size = proxy_size(other);
    return other->system_body >= 0 && p->inertia * (other_size * other_size) > 4 * other->inertia * (size * size);
}

/* The ball of p's body in this shape, as a shape of that body. False: there is none, or the shape is it. */
SADMM_INLINE bool inner_ball_of(const struct sadmm_proxy *p, const double *hulls, struct sadmm_proxy *ball)
{
    double radius;
    int i;
    if (p->system_body < 0 || is_own_ball(p)) return false;
    radius = (double)geometry_inner_radius(&p->geometry, hulls, proxy_centre(p));
    if (!(radius > 0)) return false;
    *ball = *p;
    ball->geometry.type = SADMM_SHAPE_SPHERE;
    ball->geometry.subshapes = 1;
    ball->geometry.size[0] = radius;
    ball->spin = 0;
    for (i = 0; i < 3; ++i) {
        ball->arm[i] = 0;
        ball->x[i] = p->com[i];
    }
    return true;
}

/* pair_manifold.h */
SADMM_CALLED void ball_manifold(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                                uint32_t subshape, const struct pair_pose *pose, struct manifold *m);

/* Where a ball meets the other shape, in the frame of the pair's b, `time_offset` seconds into the step. */
struct inner_ball {
    vec3 centre, normal; /* the pair's: from a to b */
    vec3 on_other;       /* nearest of the other shape's surface */
    real radius, separation;
    double time_offset;
    bool hits; /* within the step */
    bool of_b;
};

/* a, b: the pair. ball, its proxy: of b where of_b. subshape: of a mesh. from: when the pair does not touch yet;
 * time_offset: where the ball is taken if it does not hit. False: nothing is near. */
SADMM_INLINE bool inner_ball_meets(const struct sadmm_proxy *a, const struct sadmm_proxy *b,
                                   const struct sadmm_proxy *ball, bool of_b, const double *hulls, uint32_t subshape,
                                   double from, double gravity, double dt, double time_offset, struct inner_ball *found)
{
    const bool swapped = of_b && a->geometry.type != SADMM_SHAPE_PLANE;
    const struct sadmm_proxy *first = swapped || !of_b ? ball : a, *second = swapped ? a : of_b ? ball : b;
    const struct first_touch touch = pair_first_touch(first, second, hulls, subshape, from, gravity, dt);
    const double at = touch.missed ? time_offset : touch.time_offset;
    struct proxy_place there;
    const struct pair_pose pose = proxies_pose(first, second, at, dt, &there),
                           own = proxies_pose(a, b, at, dt, &there);
    const struct manifold_point *point;
    struct manifold m;
    mat3 R;
    int k;
    found->hits = !touch.missed;
    found->time_offset = at;
    found->of_b = of_b;
    found->radius = (real)ball->geometry.size[0];
    m.count = 0;
    m.cache = 0;
    m.normal = v3(0, 0, 1); /* set in any case, for compilers that do not see that it is where there is a point */
    ball_manifold(&first->geometry, &second->geometry, hulls, subshape, &pose, &m);
    if (m.count == 0) return false;
    point = &m.points[0];
    found->separation = point->separation;
    for (k = 0; k < 3; ++k) R.r[k] = r3_vec3(own.R[k]);
    if (!of_b) {
        found->centre = r3_vec3(pose.t);
        found->normal = m.normal;
        found->on_other = v3_madd(point->position, point->separation / 2, m.normal);
        return true;
    }
    found->centre = proxy_centre(b); /* in its frame, which turns along */
    if (!swapped) {
        found->normal = m.normal;
        found->on_other = v3_add(found->centre, v3_madd(point->position, -point->separation / 2, m.normal));
    } else {
        const vec3 on_a = v3_madd(point->position, point->separation / 2, m.normal);
        found->normal = v3_neg(m3_mul(R, m.normal));
        found->on_other = v3_add(m3_mul(R, on_a), r3_vec3(own.t));
    }
    return true;
}

/* One more point, in place of the one farthest apart where there is no room. */
SADMM_INLINE void inner_add(struct manifold *m, vec3 position, real separation, uint32_t feature)
{
    int k, most = 0;
    if (m->count < SADMM_MANIFOLD_POINTS) {
        manifold_add(m, position, separation, feature);
        return;
    }
    for (k = 1; k < m->count; ++k)
        if (m->points[k].separation > m->points[most].separation) most = k;
    m->points[most].position = position;
    m->points[most].separation = separation;
    m->points[most].feature = feature;
}

/* The ball's point along n against a plane of the other shape, n . x = offset, with the ball's centre at x. On the
 * ball, not halfway: with accelerations it may be found at a distance that would make a long arm. */
SADMM_INLINE void inner_add_ball(const struct inner_ball *ball, vec3 centre, real offset, struct manifold *m)
{
    const real side = ball->of_b ? -1 : 1, along = v3_dot(m->normal, centre),
               separation = side * (offset - along) - ball->radius;
    inner_add(m, v3_madd(centre, side * ball->radius, m->normal), separation,
              INNER_BALL_FEATURE + (uint32_t)ball->of_b);
}

/* The contact along the ball's own normal: the ball's point, and the deepest one of its shape. */
SADMM_INLINE void inner_instead(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                double dt, const struct inner_ball *ball, struct manifold *m)
{
    const vec3 n = ball->normal;
    struct proxy_place of_b;
    const struct pair_pose pose = proxies_pose(a, b, ball->time_offset, dt, &of_b);
    const real offset = v3_dot(n, ball->on_other);
    vec3 x;
    real separation;
    mat3 R;
    int k;
    for (k = 0; k < 3; ++k) R.r[k] = r3_vec3(pose.R[k]);
    m->normal = n;
    m->count = 0;
    m->cache = 0;
    m->time_offset = ball->time_offset;
    if (ball->of_b) {
        x = geometry_farthest(&b->geometry, hulls, v3_neg(n));
        separation = v3_dot(n, x) - offset;
    } else {
        x = v3_add(m3_mul(R, geometry_farthest(&a->geometry, hulls, m3_tmul(R, n))), r3_vec3(pose.t));
        separation = offset - v3_dot(n, x);
    }
    manifold_add(m, x, separation, INNER_DEEPEST_FEATURE + (uint32_t)ball->of_b);
    inner_add_ball(ball, ball->centre, offset, m);
}

/* Points that hold the centre up by themselves: it is over a triangle, or a line, of some that are no farther apart
 * than the ball. x: their places across the normal, from the ball's centre. */
SADMM_INLINE bool inner_over_line(const real p[2], const real q[2], real beside)
{
    const real d[2] = {q[0] - p[0], q[1] - p[1]}, length2 = d[0] * d[0] + d[1] * d[1],
               along = -(p[0] * d[0] + p[1] * d[1]), across = d[0] * p[1] - d[1] * p[0];
    return along >= 0 && along <= length2 && across * across <= beside * beside * length2;
}
SADMM_INLINE bool inner_over_triangle(const real p[2], const real q[2], const real r[2])
{
    const real a = p[0] * q[1] - p[1] * q[0], b = q[0] * r[1] - q[1] * r[0], c = r[0] * p[1] - r[1] * p[0];
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}
SADMM_INLINE bool inner_is_held(const struct manifold *m, vec3 centre, real separation, real radius)
{
    const real beside = (real)0.1 * radius;
    real x[SADMM_MANIFOLD_POINTS][2];
    vec3 e1, e2;
    int i, j, k, count = 0;
    v3_tangents(m->normal, &e1, &e2);
    for (k = 0; k < m->count; ++k) {
        const vec3 d = v3_sub(m->points[k].position, centre);
        if (m->points[k].separation > separation + beside) continue;
        x[count][0] = v3_dot(e1, d);
        x[count++][1] = v3_dot(e2, d);
    }
    for (i = 0; i < count; ++i)
        for (j = 0; j < i; ++j) {
            if (inner_over_line(x[i], x[j], beside)) return true;
            for (k = 0; k < j; ++k)
                if (inner_over_triangle(x[i], x[j], x[k])) return true;
        }
    return false;
}

/* Does the body tumble about an axis across the normal, so that points let its centre of mass come down by turning? */
SADMM_INLINE bool inner_tumbles(const struct sadmm_proxy *p, const double Rb[9], vec3 n, double dt)
{
    double normal[3];
    rotate_to_world(Rb, n, normal);
    return turning_speed(p, normal, 1) * dt > MIDPOINT_TURN;
}

/* Along the manifold's normal, against the outermost of its points on the other shape, unless they hold it. */
SADMM_INLINE void inner_along(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const struct sadmm_proxy *proxy,
                              double dt, const struct inner_ball *ball, struct manifold *m)
{
    const real side = ball->of_b ? -1 : 1;
    struct proxy_place of_b;
    const struct pair_pose pose = proxies_pose(ball->of_b ? a : proxy, b, m->time_offset, dt, &of_b);
    const vec3 centre = ball->of_b ? ball->centre : r3_vec3(pose.t);
    real offset = 0;
    int k;
    for (k = 0; k < m->count; ++k) {
        const real at = v3_dot(m->normal, m->points[k].position) + side * m->points[k].separation / 2;
        if (k == 0 || side * at < side * offset) offset = at;
    }
    if (inner_tumbles(proxy, of_b.R, m->normal, dt) ||
        !inner_is_held(m, centre, side * (offset - v3_dot(m->normal, centre)) - ball->radius, ball->radius))
        inner_add_ball(ball, centre, offset, m);
}

/* Is the pair's memory of the side it came from as good as none: a body turns by more than it is
 * turned to the time offset at most? */
SADMM_INLINE bool inner_forgets(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double dt)
{
    return turning_rate(a->angular) * dt > MIDPOINT_TURN || turning_rate(b->angular) * dt > MIDPOINT_TURN;
}

/* Is a manifold deep by more than this share of the thinner shape? */
SADMM_INLINE bool inner_is_deep(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const struct manifold *m,
                                double share)
{
    const double deep = -share * min_of(a->thin, b->thin);
    int k;
    for (k = 0; k < m->count; ++k)
        if ((double)m->points[k].separation < deep) return true;
    return false;
}

/* Of one body's ball. */
SADMM_INLINE void inner_ball_add(const struct sadmm_proxy *a, const struct sadmm_proxy *b, bool of_b,
                                 const double *hulls, uint32_t subshape, bool remembers, double from, double gravity,
                                 double dt, struct manifold *m)
{
    struct sadmm_proxy proxy;
    struct inner_ball ball;
    real along;
    bool alone;
    if (inner_is_heavy(of_b ? b : a, of_b ? a : b) || !inner_ball_of(of_b ? b : a, hulls, &proxy) ||
        !inner_ball_meets(a, b, &proxy, of_b, hulls, subshape, from, gravity, dt, m->time_offset, &ball))
        return;
    along = v3_dot(ball.normal, m->normal);
    alone = ball.hits && relative_speed(a->velocity, b->velocity) * dt > INNER_BALL_ALONE * (double)ball.radius;
    if (!alone && m->count > 0 && along > INNER_BALL_ALONG) {
        if (ball.hits) inner_along(a, b, &proxy, dt, &ball, m);
        return;
    }
    if (alone || (m->count == 0 && ball.hits) ||
        (m->count > 0 &&
         ((ball.hits && 2 * ball.separation > -ball.radius) ||
          (along < -INNER_BALL_ALONG && !remembers && ball.separation > -ball.radius &&
           (double)ball.separation < geometry_radius(&(of_b ? b : a)->geometry) &&
           inner_is_deep(a, b, m, INNER_ASKS_SIDE)))))
        inner_instead(a, b, hulls, dt, &ball, m);
    if (!alone) return;
    m->points[0] = m->points[1];
    m->count = 1;
}

/* Onto the surface of the body that its impulses turn, or the one that is easier to turn: halfway to what accelerations
 * are yet to close may be a long arm. */
SADMM_INLINE void inner_on_surface(const struct sadmm_proxy *a, const struct sadmm_proxy *b, struct manifold *m)
{
    const bool on_b = a->system_body < 0 || (b->system_body >= 0 && b->inertia < a->inertia);
    int k;
    for (k = 0; k < m->count; ++k)
        if (m->points[k].separation > 0 && m->points[k].feature < INNER_BALL_FEATURE)
            m->points[k].position =
                v3_madd(m->points[k].position, (on_b ? (real)0.5 : (real)-0.5) * m->points[k].separation, m->normal);
}

SADMM_INLINE void inner_balls_of(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                 uint32_t subshape, bool remembers, struct first_touch touch, double gravity, double dt,
                                 struct manifold *m)
{
    int of_b; /* a loop: compilers are not to make it twice */
    remembers &= !inner_forgets(a, b, dt);
    for (of_b = 0; of_b < 2 && !touch.missed; ++of_b)
        inner_ball_add(a, b, of_b, hulls, subshape, remembers, touch.time_offset, gravity, dt, m);
    inner_on_surface(a, b, m);
}
SADMM_RARE void inner_balls_with_hulls(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                       uint32_t subshape, bool remembers, struct first_touch touch, double gravity,
                                       double dt, struct manifold *m)
{
    inner_balls_of(a, b, hulls, subshape, remembers, touch, gravity, dt, m);
}
SADMM_RARE void inner_balls_plain(const struct sadmm_proxy *a, const struct sadmm_proxy *b, bool remembers,
                                  struct first_touch touch, double gravity, double dt, struct manifold *m)
{
    inner_balls_of(a, b, NULL, 0, remembers, touch, gravity, dt, m);
}

/* To the manifold of a pair. remembers: its cache is of the last step; touch: of the pair, and so none of the balls in
 * it is earlier; hulls: NULL as of pair_first_touch. */
SADMM_INLINE void inner_balls_add(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                  uint32_t subshape, bool remembers, struct first_touch touch, double gravity,
                                  double dt, struct manifold *m)
{
    if (hulls) inner_balls_with_hulls(a, b, hulls, subshape, remembers, touch, gravity, dt, m);
    else inner_balls_plain(a, b, remembers, touch, gravity, dt, m);
}

/* Is the centre of mass of a's body behind the triangle of a mesh b, over it? Other triangles may be what the body
 * touches, or would, if it were not so deep. pose: of a in b's frame. */
SADMM_INLINE bool inner_is_behind(const struct sadmm_proxy *a, const struct sadmm_proxy *b, const double *hulls,
                                  uint32_t subshape, const struct pair_pose *pose)
{
    struct mesh_triangle t;
    struct mesh mesh;
    double x[3];
    vec3 centre;
    real height;
    int k;
    if (a->system_body < 0 || is_own_ball(a) || !(a->spin > INNER_TURNS * a->thin)) return false;
    for (k = 0; k < 3; ++k) x[k] = b->R[k] * a->arm[0] + b->R[3 + k] * a->arm[1] + b->R[6 + k] * a->arm[2];
    mesh_at(hulls, b->geometry.hull, &mesh);
    mesh_triangle_of(&mesh, (int32_t)subshape, &t);
    centre = v3_sub(v3_sub(r3_vec3(pose->t), v3_load(x)), t.origin);
    height = v3_dot(t.normal, centre);
    return height < 0 && height > -(real)geometry_radius(&a->geometry) && mesh_is_over(&t, centre, 0);
}

/* Is one asked for? Of a manifold that is deep, of bodies that turn, and where accelerations alone may turn the pair
 * anywhere within the step. */
SADMM_INLINE bool inner_is_asked(const struct sadmm_proxy *a, const struct sadmm_proxy *b, double gravity, double dt,
                                 const struct manifold *m)
{
    return fall_of(gravity, dt) + a->fall + b->fall > 2 * MIDPOINT_TRAVEL * min_of(a->thin, b->thin) ||
           (a->spin + b->spin > INNER_ROCKS * min_of(a->thin, b->thin) && inner_is_deep(a, b, m, INNER_SINKS));
}

#endif
