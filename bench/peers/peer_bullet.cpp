/* Bullet, rigid bodies with maximal coordinates. */
#include <cmath>
#include <cstring>
#include <ctime>
#include <memory>
#include <vector>

#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>
#include <btBulletDynamicsCommon.h>

#include "peer.h"

struct peer_world {
    peer_scene scene{};
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver sequential;
    btDantzigSolver dantzig;
    btMLCPSolver direct{&dantzig};
    std::unique_ptr<btDiscreteDynamicsWorld> world;
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btDefaultMotionState>> states;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    std::vector<std::unique_ptr<btTypedConstraint>> joints;
    ~peer_world()
    {
        for (auto &joint : joints) world->removeConstraint(joint.get());
        for (auto &body : bodies) world->removeRigidBody(body.get());
    }
};

static double now()
{
    timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static btVector3 vector(const double x[3]) { return btVector3(x[0], x[1], x[2]); }

const char *peer_version(void)
{
    static char text[16];
    snprintf(text, sizeof text, "%d.%02d", btGetVersion() / 100, btGetVersion() % 100);
    return text;
}

const char *peer_settings(int tuned)
{
    /* With one friction direction, its default, boxes slide more exactly, but card houses fall and grips are lost. */
    return tuned ? "1000 iterations or a residual of 1e-30, two friction directions, split impulse at any depth; "
                   "joints without contacts: direct solver (btMLCPSolver, Dantzig), ERP 0.8"
                 : "10 iterations, split impulse below 4 cm, ERP 0.2";
}

peer_world *peer_create(const peer_scene *scene)
{
    auto *w = new peer_world;
    w->scene = *scene;
    btConstraintSolver *solver = &w->sequential;
    if (scene->tuned && scene->smooth && scene->restitution == 0) solver = &w->direct;
    w->world = std::make_unique<btDiscreteDynamicsWorld>(&w->dispatcher, &w->broadphase, solver, &w->configuration);
    w->world->setGravity(btVector3(0, 0, -scene->gravity));
    btContactSolverInfo &info = w->world->getSolverInfo();
    if (scene->tuned) {
        info.m_numIterations = 1000;
        info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
        info.m_leastSquaresResidualThreshold = 1e-30; /* ends where nothing changes any more */
        info.m_splitImpulsePenetrationThreshold = 0;
        if (scene->smooth) info.m_erp = 0.8;
    }
    if (scene->restitution > 0) info.m_restitutionVelocityThreshold = 0;
    return w;
}

void peer_destroy(peer_world *w) { delete w; }

int peer_add_body(peer_world *w, const peer_body *b)
{
    btTransform pose(btQuaternion(b->pose[4], b->pose[5], b->pose[6], b->pose[3]), vector(b->pose));
    btCollisionShape *shape = nullptr;
    if (b->shape == PEER_BOX) shape = new btBoxShape(vector(b->size));
    if (b->shape == PEER_SPHERE) shape = new btSphereShape(b->size[0]);
    if (b->shape == PEER_PLANE && w->scene.round) shape = new btStaticPlaneShape(btVector3(0, 0, 1), 0);
    if (b->shape == PEER_PLANE && !w->scene.round) {
        /* As in its examples: of a plane Bullet finds one point a step, of a box all of them. */
        shape = new btBoxShape(btVector3(20, 20, 5));
        pose.setOrigin(pose * btVector3(0, 0, -5));
    }
    const bool collides = shape != nullptr;
    if (!shape) shape = new btEmptyShape;
    w->shapes.emplace_back(shape);
    w->states.emplace_back(new btDefaultMotionState(pose));
    btRigidBody::btRigidBodyConstructionInfo info(b->kind == PEER_DYNAMIC ? b->mass : 0, w->states.back().get(), shape,
                                                  vector(b->inertia));
    info.m_friction = sqrt(w->scene.friction); /* Bullet multiplies */
    info.m_restitution = sqrt(w->scene.restitution);
    auto *body = new btRigidBody(info);
    w->bodies.emplace_back(body);
    if (b->kind == PEER_KINEMATIC) {
        body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    }
    if (b->kind == PEER_DYNAMIC) {
        body->setLinearVelocity(vector(b->velocity));
        body->setAngularVelocity(vector(b->velocity + 3));
    }
    body->setActivationState(DISABLE_DEACTIVATION);
    w->world->addRigidBody(body, collides ? 1 : 0, collides ? 1 : 0);
    return (int)w->bodies.size() - 1;
}

int peer_add_joint(peer_world *w, int kind, int a, int b, const double p[3], const double axis[3])
{
    btRigidBody &first = a < 0 ? btTypedConstraint::getFixedBody() : *w->bodies[a], &second = *w->bodies[b];
    const btTransform to_first = first.getWorldTransform().inverse(), to_second = second.getWorldTransform().inverse();
    const btVector3 along = vector(axis);
    btTypedConstraint *joint;
    if (kind == PEER_BALL) {
        joint = new btPoint2PointConstraint(first, second, to_first * vector(p), to_second * vector(p));
    } else if (kind == PEER_HINGE) {
        joint = new btHingeConstraint(first, second, to_first * vector(p), to_second * vector(p),
                                      to_first.getBasis() * along, to_second.getBasis() * along);
    } else {
        const btTransform frame(shortestArcQuat(btVector3(1, 0, 0), along), vector(p));
        auto *slider = new btGeneric6DofSpring2Constraint(first, second, to_first * frame, to_second * frame);
        slider->setLimit(0, 1, -1); /* free */
        for (int k = 1; k < 6; ++k) slider->setLimit(k, 0, 0);
        joint = slider;
    }
    w->joints.emplace_back(joint);
    w->world->addConstraint(joint, true);
    return 0;
}

void peer_move(peer_world *w, int body, const double position[3])
{
    btTransform pose = w->bodies[body]->getWorldTransform();
    pose.setOrigin(vector(position));
    w->states[body]->setWorldTransform(pose);
}

void peer_push(peer_world *w, int body, const double force[3]) { w->bodies[body]->applyCentralForce(vector(force)); }

double peer_step(peer_world *w)
{
    const double start = now();
    w->world->stepSimulation(w->scene.dt, 0);
    return now() - start;
}

void peer_state(peer_world *w, int body, double pose[7], double velocity[6])
{
    const btTransform &t = w->bodies[body]->getWorldTransform();
    const btQuaternion q = t.getRotation();
    const double own[7] = {t.getOrigin().x(), t.getOrigin().y(), t.getOrigin().z(), q.w(), q.x(), q.y(), q.z()};
    memcpy(pose, own, sizeof own);
    for (int k = 0; k < 3; ++k) {
        velocity[k] = w->bodies[body]->getLinearVelocity()[k];
        velocity[3 + k] = w->bodies[body]->getAngularVelocity()[k];
    }
}

static int number_of(const peer_world *w, const btCollisionObject *object)
{
    for (size_t k = 0; k < w->bodies.size(); ++k)
        if (w->bodies[k].get() == object) return (int)k;
    return -1;
}

int peer_contacts(peer_world *w, peer_contact *out, int room)
{
    int count = 0;
    for (int m = 0; m < w->dispatcher.getNumManifolds(); ++m) {
        const btPersistentManifold *manifold = w->dispatcher.getManifoldByIndexInternal(m);
        const int a = number_of(w, manifold->getBody1()), b = number_of(w, manifold->getBody0());
        for (int k = 0; k < manifold->getNumContacts() && count < room; ++k) {
            const btManifoldPoint &p = manifold->getContactPoint(k);
            /* Its normal points from body 1 to body 0, on which the impulse acts. */
            btVector3 impulse = p.m_appliedImpulse * p.m_normalWorldOnB;
            impulse += p.m_appliedImpulseLateral1 * p.m_lateralFrictionDir1;
            if (w->world->getSolverInfo().m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS)
                impulse += p.m_appliedImpulseLateral2 * p.m_lateralFrictionDir2;
            peer_contact &c = out[count++];
            c.a = a, c.b = b, c.gap = p.getDistance();
            for (int i = 0; i < 3; ++i) {
                c.point[i] = p.getPositionWorldOnB()[i];
                c.normal[i] = p.m_normalWorldOnB[i];
                c.force[i] = impulse[i] / w->scene.dt;
            }
        }
    }
    return count;
}
