// Shapes' definitions, hulls, meshes, and the mass of solids.
#include "fields.h"

using points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using triangles = nb::ndarray<const int32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using grid = nb::ndarray<const double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

// src/collision/hull/hull.h and mesh.h, which are C
extern "C" void sadmm_hull_retain(const sadmm_hull *hull);
extern "C" void sadmm_mesh_retain(const sadmm_mesh *mesh);

void hold_parts(shape_def &shape)
{
    if (shape.def.hull) {
        sadmm_hull_retain(shape.def.hull);
        shape.hull = std::make_shared<hull_holder>();
        shape.hull->hull = const_cast<sadmm_hull *>(shape.def.hull);
    }
    if (shape.def.mesh) {
        sadmm_mesh_retain(shape.def.mesh);
        shape.mesh = std::make_shared<mesh_holder>();
        shape.mesh->mesh = const_cast<sadmm_mesh *>(shape.def.mesh);
    }
}

static shape_def make_hull(points at, double merge, double convex_radius)
{
    shape_def out;
    sadmm_hull_def def = sadmm_hull_def_default();
    def.points = at.data(), def.point_count = at.shape(0);
    if (merge >= 0) def.merge = merge;
    def.convex_radius = convex_radius;
    out.def.type = SADMM_SHAPE_HULL;
    out.hull = std::make_shared<hull_holder>();
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        status = sadmm_hull_create(&def, &out.hull->hull);
    }
    check(status);
    out.def.hull = out.hull->hull;
    return out;
}

static shape_def make_mesh(points vertices, triangles corners)
{
    shape_def out;
    sadmm_mesh_def def = sadmm_mesh_def_default();
    def.vertices = vertices.data(), def.vertex_count = vertices.shape(0);
    def.triangles = corners.data(), def.triangle_count = corners.shape(0);
    out.def.type = SADMM_SHAPE_MESH;
    out.mesh = std::make_shared<mesh_holder>();
    sadmm_status status;
    {
        nb::gil_scoped_release release;
        status = sadmm_mesh_create(&def, &out.mesh->mesh);
    }
    check(status);
    out.def.mesh = out.mesh->mesh;
    return out;
}

static shape_def make_heightfield(grid heights, numbers<2> given)
{
    const std::array<double, 2> spacing = given.as("spacing");
    shape_def out;
    sadmm_heightfield_def def = sadmm_heightfield_def_default();
    def.heights = heights.data();
    if (heights.shape(0) > INT32_MAX || heights.shape(1) > INT32_MAX) throw nb::value_error("heights: too many");
    def.rows = (int32_t)heights.shape(0), def.columns = (int32_t)heights.shape(1);
    def.spacing[0] = spacing[0], def.spacing[1] = spacing[1];
    out.def.type = SADMM_SHAPE_MESH;
    out.mesh = std::make_shared<mesh_holder>();
    check(sadmm_heightfield_create(&def, &out.mesh->mesh));
    out.def.mesh = out.mesh->mesh;
    return out;
}

std::vector<shape_def> read_shapes(const char *name, nb::handle given)
{
    std::vector<shape_def> out;
    if (!PySequence_Check(given.ptr()) || nb::isinstance<nb::str>(given))
        refuse_type(name, given, "must be a sequence of subadmm.Shape");
    for (nb::handle one : given) {
        const std::string which = std::string(name) + "[" + std::to_string(out.size()) + "]";
        if (!nb::isinstance<shape_def>(one)) refuse_type(which.c_str(), one, "must be a subadmm.Shape");
        out.push_back(nb::cast<shape_def>(one));
    }
    return out;
}

// What a viewer draws: vertices and triangles, in the frame of the shape.
static nb::object geometry_of(const shape_def &s)
{
    std::vector<double> x;
    std::vector<int32_t> corners;
    if (s.def.hull) {
        const int32_t count = sadmm_hull_vertex_count(s.def.hull);
        const double *at = sadmm_hull_vertices(s.def.hull);
        x.assign(at, at + 3 * (size_t)count);
        for (int32_t f = 0; f < sadmm_hull_face_count(s.def.hull); ++f) {
            sadmm_hull_face face;
            check(sadmm_hull_face_at(s.def.hull, f, &face));
            for (int32_t k = 2; k < face.corner_count; ++k)
                corners.insert(corners.end(), {face.corners[0], face.corners[k - 1], face.corners[k]});
        }
    } else if (s.def.mesh) {
        for (int64_t v = 0; v < sadmm_mesh_vertex_count(s.def.mesh); ++v) {
            double at[3];
            check(sadmm_mesh_vertex_at(s.def.mesh, v, at));
            x.insert(x.end(), at, at + 3);
        }
        for (int64_t t = 0; t < sadmm_mesh_triangle_count(s.def.mesh); ++t) {
            int32_t of[3], number;
            check(sadmm_mesh_triangle_at(s.def.mesh, t, of, &number));
            corners.insert(corners.end(), of, of + 3);
        }
    } else {
        return nb::none();
    }
    const size_t vertices = x.size() / 3, count = corners.size() / 3;
    return nb::make_tuple(numpy_of(std::move(x), {vertices, 3}), numpy_of(std::move(corners), {count, 3}));
}

#define BIND(X, kind, role, name, ...) BIND_##kind(kind, name) ++field;
#define BIND_AS(kind, name) bind_##kind(c, #name, [](auto &o) -> auto & { return o.def.name; }, documented(*field));
#define BIND_REAL BIND_AS
#define BIND_FLAG BIND_AS
#define BIND_BITS BIND_AS
#define BIND_VECTOR BIND_AS
#define BIND_TURN BIND_AS
#define BIND_SHAPE_TYPE(kind, name) // stays what it is
#define BIND_OTHER(kind, name) // has a form of its own

void bind_shapes(nb::module_ &m)
{
    using S = shape_def;
    nb::class_<S> c(m, "Shape",
                    "A shape's definition; made by subadmm.sphere, box, hull, ... and given to World.add_shape "
                    "or World.add_solid.");
    c.def(
         "__init__",
         [](S *self, const std::string &type, const std::vector<double> &size) {
             new (self) S();
             self->def.type = named<sadmm_shape_type>("type", type);
             if (self->def.type == SADMM_SHAPE_HULL || self->def.type == SADMM_SHAPE_MESH)
                 throw nb::value_error("a hull is made by subadmm.hull, a mesh by subadmm.mesh or subadmm.heightfield");
             const size_t count = (size_t)sadmm_shape_sizes[self->def.type];
             if (size.size() != count)
                 throw nb::value_error(("size: must have " + std::to_string(count) + " numbers").c_str());
             for (size_t k = 0; k < size.size(); ++k) self->def.size[k] = size[k];
         },
         "type"_a, "size"_a = std::vector<double>())
        .def_prop_ro("type", [](const S &s) { return name_of(s.def.type); })
        .def(
            "copy",
            [](const S &s) {
                S out(s);
                out.of_world = false;
                return out;
            },
            "A copy of the definition; hulls and meshes are shared.")
        .def_prop_rw(
            "name", [](const S &s) { return s.name; },
            [](S &s, const std::string &name) { change(s, [&](S &t) { t.name = without_null("name", name); }); },
            "The name of the shape on its body, up to 63 bytes of UTF-8; '': none.")
        .def("geometry", &geometry_of,
             "(vertices n x 3 in m, triangles m x 3) of a hull or a mesh; None of other types.")
        .def_prop_ro(
            "convex_radius", [](const S &s) { return sadmm_hull_convex_radius(s.def.hull); },
            "Convex radius of a hull, m; geometry() is the polyhedron without it. 0 for other types.");
    const sadmm_field *field = sadmm_shape_table;
    SADMM_SHAPE_FIELDS(BIND, )

    m.def("_hull", &make_hull, "points"_a.noconvert(), "merge"_a, "convex_radius"_a);
    m.def("_mesh", &make_mesh, "vertices"_a.noconvert(), "triangles"_a.noconvert());
    m.def("_heightfield", &make_heightfield, "heights"_a.noconvert(), "spacing"_a);

    using M = sadmm_mass;
    nb::class_<M>(m, "Mass", "Mass, centre of mass and principal axes of solids.")
        .def_ro("mass", &M::mass, "kg.")
        .def_prop_ro(
            "centre", [](const M &a) { return array_of<3>(a.centre); }, "m, in the frame of the layout.")
        .def_prop_ro(
            "inertia", [](const M &a) { return array_of<3>(a.inertia); }, "Principal moments, kg m^2.")
        .def_prop_ro(
            "orientation", [](const M &a) { return array_of<4>(a.orientation); },
            "Principal axes to the frame of the layout.")
        .def(
            "pose_in_body",
            [](const M &a, numbers<3> position, numbers<4> orientation) {
                vec3 x = position.as("position");
                quat q = orientation.as("orientation");
                check(sadmm_mass_pose_in_body(&a, x.data(), q.data()));
                return std::make_pair(x, q);
            },
            "position"_a, "orientation"_a, "Convert a pose from the frame of the layout to that of the body.")
        .def(
            "pose_of_body",
            [](const M &a, numbers<3> position, numbers<4> orientation) {
                vec3 x = position.as("position");
                quat q = orientation.as("orientation");
                check(sadmm_mass_pose_of_body(&a, x.data(), q.data()));
                return std::make_pair(x, q);
            },
            "position"_a, "orientation"_a, "The body's pose in the world for a pose of the layout's frame.");
    m.def("mass_of", [](nb::object given, double density) {
        const std::vector<S> shapes = read_shapes("shapes", given);
        std::vector<M> parts(shapes.size());
        M sum;
        for (size_t k = 0; k < shapes.size(); ++k) check(sadmm_shape_mass(&shapes[k].def, density, &parts[k]));
        check(sadmm_mass_sum(parts.data(), parts.size(), &sum));
        return sum;
    }, "shapes"_a, "density"_a, "Mass of solid shapes of uniform density (kg/m^3) as one body; overlaps count twice.");
}
