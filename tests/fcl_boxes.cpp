/* FCL's box against box, for test_manifold_fcl.c. */
#include <memory>

#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>

namespace
{

fcl::Transform3<double> transform(const double R[9], const double x[3])
{
    fcl::Transform3<double> t = fcl::Transform3<double>::Identity();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) t.linear()(i, j) = R[3 * i + j];
        t.translation()(i) = x[i];
    }
    return t;
}

} // namespace

/* Number of contacts; the deepest one's depth and normal (first to second). */
extern "C" int fcl_boxes(const double half_a[3], const double Ra[9], const double xa[3], const double half_b[3],
                         const double Rb[9], const double xb[3], double *depth, double normal[3])
{
    const fcl::Box<double> a(2 * half_a[0], 2 * half_a[1], 2 * half_a[2]),
        b(2 * half_b[0], 2 * half_b[1], 2 * half_b[2]);
    const fcl::CollisionRequest<double> request(8, true);
    fcl::CollisionResult<double> result;
    fcl::collide(&a, transform(Ra, xa), &b, transform(Rb, xb), request, result);
    *depth = 0;
    for (size_t i = 0; i < result.numContacts(); ++i) {
        const fcl::Contact<double> &c = result.getContact(i);
        if (i > 0 && c.penetration_depth <= *depth) continue;
        *depth = c.penetration_depth;
        for (int k = 0; k < 3; ++k) normal[k] = c.normal(k);
    }
    return static_cast<int>(result.numContacts());
}
