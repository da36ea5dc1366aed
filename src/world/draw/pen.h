/* What is drawn of one thing: in its own frame, to the callbacks of a program. */
#ifndef SADMM_WORLD_DRAW_PEN_H
#define SADMM_WORLD_DRAW_PEN_H

#include "core/math/quat.h"
#include "subadmm/draw.h"

struct sadmm_pen {
    const sadmm_draw *draw;
    mat3 R; /* the frame of what is drawn, to the world */
    vec3 x;
    uint32_t colour;
};

static inline vec3 pen_place(const struct sadmm_pen *pen, vec3 own) { return v3_add(pen->x, m3_mul(pen->R, own)); }

/* Counter-clockwise seen from outside; normal: outward, of any length but 0. */
static inline void pen_facet(const struct sadmm_pen *pen, vec3 a, vec3 b, vec3 c, vec3 normal)
{
    double corners[3][3], unit[3];
    if (!pen->draw->triangle) return;
    v3_store(pen_place(pen, a), corners[0]);
    v3_store(pen_place(pen, b), corners[1]);
    v3_store(pen_place(pen, c), corners[2]);
    v3_store(m3_mul(pen->R, v3_scale(normal, 1 / v3_norm(normal))), unit);
    pen->draw->triangle(pen->draw->user, corners[0], corners[1], corners[2], unit, pen->colour);
}

static inline void pen_triangle(const struct sadmm_pen *pen, vec3 a, vec3 b, vec3 c)
{
    pen_facet(pen, a, b, c, v3_cross(v3_sub(b, a), v3_sub(c, a)));
}

static inline void pen_line(const struct sadmm_pen *pen, vec3 from, vec3 to)
{
    double ends[2][3];
    if (!pen->draw->line) return;
    v3_store(pen_place(pen, from), ends[0]);
    v3_store(pen_place(pen, to), ends[1]);
    pen->draw->line(pen->draw->user, ends[0], ends[1], pen->colour);
}

#endif
