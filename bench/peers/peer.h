/* What bench/peers asks of an engine written in C or C++: a shared library with these functions, `run.py --driver
 * NAME=FILE`. Bullet and ODE have one here.
 *
 * SI units, z up, world frame; orientations are unit quaternions w x y z. Masses and moments are given. One thread,
 * nothing sleeps, no damping; bodies of a joint do not collide; friction and restitution of a pair are those given,
 * which all bodies of a scene share. A function that cannot do what it is asked returns -1 or NULL. */
#ifndef PEER_H
#define PEER_H

#ifdef __cplusplus
extern "C" {
#endif

enum peer_body_kind { PEER_STATIC, PEER_DYNAMIC, PEER_KINEMATIC };
enum peer_shape_kind { PEER_NO_SHAPE, PEER_BOX, PEER_SPHERE, PEER_PLANE }; /* half extents; radius; z <= 0 */
enum peer_joint_kind { PEER_BALL, PEER_HINGE, PEER_SLIDER };

struct peer_scene {
    double dt, gravity, friction, restitution;
    int tuned;    /* 0: the engine's default settings */
    int smooth;   /* nothing rubs: motions that keep their energy */
    int round;    /* all moving shapes are spheres */
    int forces;   /* peer_contacts will be called */
};

struct peer_body {
    int kind, shape;
    double mass, inertia[3], size[3];
    double pose[7], velocity[6]; /* position, orientation; linear, angular */
};

struct peer_contact {
    int a, b;
    double point[3], normal[3]; /* from a to b */
    double gap, force[3];       /* on b */
};

const char *peer_version(void);
const char *peer_settings(int tuned); /* what is set, for people */
struct peer_world *peer_create(const struct peer_scene *scene);
void peer_destroy(struct peer_world *world);
int peer_add_body(struct peer_world *world, const struct peer_body *body); /* its number, from 0 */
int peer_add_joint(struct peer_world *world, int kind, int a, int b, const double point[3], const double axis[3]);
                                                                           /* a = -1: the world */
void peer_move(struct peer_world *world, int body, const double position[3]); /* kinematic: at the next step's end */
void peer_push(struct peer_world *world, int body, const double force[3]);    /* through the next step */
double peer_step(struct peer_world *world);                                   /* s that the engine took */
void peer_state(struct peer_world *world, int body, double pose[7], double velocity[6]);
/* Of the last step; -1: the engine does not tell them. */
int peer_contacts(struct peer_world *world, struct peer_contact *contacts, int room);

#ifdef __cplusplus
}
#endif
#endif
