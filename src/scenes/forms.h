/* Convex bodies that are made by formula. */
#ifndef SADMM_SCENES_FORMS_H
#define SADMM_SCENES_FORMS_H

enum sadmm_form {
    SADMM_FORM_ICOSAHEDRON,
    SADMM_FORM_DODECAHEDRON,
    SADMM_FORM_BALL, /* the corners of both, on one sphere: 60 triangles */
    SADMM_FORM_CONE, /* 16 corners round its base */
    SADMM_FORM_LENS, /* two caps on a rim of 16 corners, 5 to 12 as thick as wide */
    SADMM_FORM_ROCK, /* 32 points in all directions, at irregular distances */
    SADMM_FORM_COUNT
};
enum { SADMM_FORM_MOST = 40 };

/* The points of a form whose largest radius is 1; their number. */
int sadmm_form_points(enum sadmm_form form, double points[SADMM_FORM_MOST][3]);

#endif
