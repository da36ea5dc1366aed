/* Open Dynamics Engine. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <ode/ode.h>

#include "peer.h"

enum {
    MOST_POINTS = 8, /* of a pair of boxes */
    MOST_DIRECT = 8, /* bodies with contacts that the direct step takes: stacks of ten fall with it, and it is cubic */
};

struct touch {
    int a, b;
    dContactGeom geom;
    dJointFeedback feedback;
};

struct peer_world {
    struct peer_scene scene;
    dWorldID world;
    dSpaceID space;
    dJointGroupID contacts;
    dBodyID bodies[1024];
    struct peer_body given[1024];
    double target[1024][3];
    int count, touches;
    struct touch touch[16384];
};

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

const char *peer_version(void) { return "0.16.2"; }

const char *peer_settings(int tuned)
{
    /* The manual: QuickStep for speed, the direct step for accuracy. Without Approx1 its mu is a force. */
    return tuned ? "up to 8 bodies, or without friction: direct step (dWorldStep); else QuickStep, 500 iterations; "
                   "surface layer 1e-5 m, ERP 0.2, CFM 1e-10, friction by Approx1, finite rotations"
                 : "QuickStep, 20 iterations, ERP 0.2, CFM 1e-10, friction by Approx1";
}

struct peer_world *peer_create(const struct peer_scene *scene)
{
    static int started;
    struct peer_world *w = calloc(1, sizeof *w);
    if (!w) return NULL;
    if (!started++) dInitODE2(0);
    w->scene = *scene;
    w->world = dWorldCreate();
    w->space = dHashSpaceCreate(0);
    w->contacts = dJointGroupCreate(0);
    dWorldSetGravity(w->world, 0, 0, -scene->gravity);
    dWorldSetAutoDisableFlag(w->world, 0);
    if (scene->tuned) {
        dWorldSetContactSurfaceLayer(w->world, 1e-5);
        dWorldSetQuickStepNumIterations(w->world, 500);
    }
    return w;
}

void peer_destroy(struct peer_world *w)
{
    dJointGroupDestroy(w->contacts);
    dSpaceDestroy(w->space);
    dWorldDestroy(w->world);
    free(w);
}

int peer_add_body(struct peer_world *w, const struct peer_body *b)
{
    if (w->count == 1024) return -1;
    dBodyID body = 0;
    if (b->kind != PEER_STATIC) {
        body = dBodyCreate(w->world);
        dBodySetPosition(body, b->pose[0], b->pose[1], b->pose[2]);
        dBodySetQuaternion(body, b->pose + 3);
        if (b->kind == PEER_KINEMATIC) {
            dBodySetKinematic(body);
        } else {
            dMass mass;
            dMassSetParameters(&mass, b->mass, 0, 0, 0, b->inertia[0], b->inertia[1], b->inertia[2], 0, 0, 0);
            dBodySetMass(body, &mass);
        }
        dBodySetLinearVel(body, b->velocity[0], b->velocity[1], b->velocity[2]);
        dBodySetAngularVel(body, b->velocity[3], b->velocity[4], b->velocity[5]);
        if (w->scene.tuned) dBodySetFiniteRotationMode(body, 1);
    }
    dGeomID geom = 0;
    if (b->shape == PEER_BOX) geom = dCreateBox(w->space, 2 * b->size[0], 2 * b->size[1], 2 * b->size[2]);
    if (b->shape == PEER_SPHERE) geom = dCreateSphere(w->space, b->size[0]);
    if (b->shape == PEER_PLANE) {
        dMatrix3 r;
        dRfromQ(r, b->pose + 3);
        geom = dCreatePlane(w->space, r[2], r[6], r[10], r[2] * b->pose[0] + r[6] * b->pose[1] + r[10] * b->pose[2]);
    }
    if (geom) {
        dGeomSetData(geom, (char *)0 + w->count);
        if (body) {
            dGeomSetBody(geom, body);
        } else if (b->shape != PEER_PLANE) {
            dGeomSetPosition(geom, b->pose[0], b->pose[1], b->pose[2]);
            dGeomSetQuaternion(geom, b->pose + 3);
        }
    }
    w->bodies[w->count] = body;
    w->given[w->count] = *b;
    return w->count++;
}

int peer_add_joint(struct peer_world *w, int kind, int a, int b, const double p[3], const double axis[3])
{
    dBodyID first = a < 0 ? 0 : w->bodies[a], second = w->bodies[b];
    dJointID joint;
    if (kind == PEER_BALL) {
        joint = dJointCreateBall(w->world, 0);
        dJointAttach(joint, first, second);
        dJointSetBallAnchor(joint, p[0], p[1], p[2]);
    } else if (kind == PEER_HINGE) {
        joint = dJointCreateHinge(w->world, 0);
        dJointAttach(joint, first, second);
        dJointSetHingeAnchor(joint, p[0], p[1], p[2]);
        dJointSetHingeAxis(joint, axis[0], axis[1], axis[2]);
    } else {
        joint = dJointCreateSlider(w->world, 0);
        dJointAttach(joint, first, second);
        dJointSetSliderAxis(joint, axis[0], axis[1], axis[2]);
    }
    return 0;
}

void peer_move(struct peer_world *w, int body, const double position[3])
{
    const double *x = dBodyGetPosition(w->bodies[body]);
    dBodySetLinearVel(w->bodies[body], (position[0] - x[0]) / w->scene.dt, (position[1] - x[1]) / w->scene.dt,
                      (position[2] - x[2]) / w->scene.dt);
}

void peer_push(struct peer_world *w, int body, const double force[3])
{
    dBodyAddForce(w->bodies[body], force[0], force[1], force[2]);
}

static void near(void *data, dGeomID one, dGeomID other)
{
    struct peer_world *w = data;
    dContact contacts[MOST_POINTS];
    dBodyID a = dGeomGetBody(one), b = dGeomGetBody(other);
    if ((!a && !b) || (a && b && dAreConnectedExcluding(a, b, dJointTypeContact))) return;
    if (!a) { /* forces are told for the first body, which must be one */
        dGeomID swap = one;
        one = other, other = swap;
        a = b, b = 0;
    }
    const int count = dCollide(one, other, MOST_POINTS, &contacts[0].geom, sizeof *contacts);
    for (int k = 0; k < count; ++k) {
        dSurfaceParameters *s = &contacts[k].surface;
        memset(s, 0, sizeof *s);
        s->mode = dContactApprox1;
        s->mu = w->scene.friction;
        if (w->scene.restitution > 0) {
            s->mode |= dContactBounce;
            s->bounce = w->scene.restitution;
        }
        dJointID joint = dJointCreateContact(w->world, w->contacts, &contacts[k]);
        dJointAttach(joint, a, b);
        if (w->scene.forces && w->touches < (int)(sizeof w->touch / sizeof *w->touch)) {
            struct touch *t = &w->touch[w->touches++];
            t->a = (int)((char *)dGeomGetData(one) - (char *)0);
            t->b = (int)((char *)dGeomGetData(other) - (char *)0);
            t->geom = contacts[k].geom;
            dJointSetFeedback(joint, &t->feedback);
        }
    }
}

double peer_step(struct peer_world *w)
{
    const double start = now();
    dJointGroupEmpty(w->contacts);
    w->touches = 0;
    dSpaceCollide(w->space, w, near);
    if (w->scene.tuned && (w->scene.smooth || w->count <= MOST_DIRECT)) dWorldStep(w->world, w->scene.dt);
    else dWorldQuickStep(w->world, w->scene.dt);
    return now() - start;
}

void peer_state(struct peer_world *w, int body, double pose[7], double velocity[6])
{
    memset(velocity, 0, 6 * sizeof *velocity);
    memcpy(pose, w->given[body].pose, 7 * sizeof *pose);
    if (!w->bodies[body]) return;
    memcpy(pose, dBodyGetPosition(w->bodies[body]), 3 * sizeof *pose);
    memcpy(pose + 3, dBodyGetQuaternion(w->bodies[body]), 4 * sizeof *pose);
    memcpy(velocity, dBodyGetLinearVel(w->bodies[body]), 3 * sizeof *velocity);
    memcpy(velocity + 3, dBodyGetAngularVel(w->bodies[body]), 3 * sizeof *velocity);
}

int peer_contacts(struct peer_world *w, struct peer_contact *out, int room)
{
    int count = 0;
    for (; count < w->touches && count < room; ++count) {
        const struct touch *t = &w->touch[count];
        struct peer_contact *c = &out[count];
        c->a = t->a, c->b = t->b, c->gap = -t->geom.depth;
        for (int i = 0; i < 3; ++i) {
            c->point[i] = t->geom.pos[i];
            c->normal[i] = -t->geom.normal[i];
            c->force[i] = -t->feedback.f1[i];
        }
    }
    return count;
}
