// A world as lines, triangles, points and texts: arrays for programs that draw.
#include "common.h"

namespace
{

struct drawn {
    std::vector<double> lines, triangles, normals, points;
    std::vector<uint32_t> line_colours, triangle_colours, point_colours;
    std::vector<std::pair<std::string, vec3>> texts;
};

void put(std::vector<double> &to, const double x[3]) { to.insert(to.end(), x, x + 3); }

void on_line(void *user, const double from[3], const double to[3], uint32_t colour)
{
    drawn &d = *(drawn *)user;
    put(d.lines, from), put(d.lines, to);
    d.line_colours.push_back(colour);
}

void on_triangle(void *user, const double a[3], const double b[3], const double c[3], const double normal[3],
                 uint32_t colour)
{
    drawn &d = *(drawn *)user;
    put(d.triangles, a), put(d.triangles, b), put(d.triangles, c);
    put(d.normals, normal);
    d.triangle_colours.push_back(colour);
}

void on_point(void *user, const double position[3], uint32_t colour)
{
    drawn &d = *(drawn *)user;
    put(d.points, position);
    d.point_colours.push_back(colour);
}

void on_text(void *user, const double position[3], const char *text, uint32_t)
{
    ((drawn *)user)->texts.push_back({text, {position[0], position[1], position[2]}});
}

const char *const parts[] = {"shapes",   "edges",  "bounds",  "joints",  "couplings",
                             "contacts", "forces", "centres", "islands", "names"};
enum { PARTS = sizeof parts / sizeof *parts };
static_assert(SADMM_DRAW_ALL == (1 << PARTS) - 1, "every flag has a name");

uint32_t read_flags(nb::handle given)
{
    uint32_t flags = 0;
    std::string all;
    for (const char *part : parts) all += std::string(all.empty() ? "" : ", ") + "'" + part + "'";
    if (nb::isinstance<nb::str>(given) || !PySequence_Check(given.ptr()))
        refuse_type("what", given, "must be a sequence of names: " + all);
    for (nb::handle one : given) {
        if (!nb::isinstance<nb::str>(one)) refuse_type("what", given, "must be a sequence of names: " + all);
        const std::string name = nb::cast<std::string>(one);
        bool known = false;
        for (int k = 0; k < PARTS; ++k)
            if (name == parts[k]) flags |= 1u << k, known = true;
        if (!known) refuse_value("what", given, "must have names of " + all);
    }
    return flags;
}

template <class T> nb::object array(std::vector<T> &values, std::vector<size_t> each)
{
    size_t size = 1;
    for (size_t n : each) size *= n;
    each.insert(each.begin(), values.size() / size);
    return numpy_of(std::move(values), each);
}

nb::dict debug_draw(world &w, nb::object what, const whole &segments, double force_scale, double axis_length,
                    double plane_size, const whole &environment)
{
    drawn d;
    sadmm_draw draw = sadmm_draw_default();
    draw.user = &d;
    draw.line = on_line, draw.triangle = on_triangle, draw.point = on_point, draw.text = on_text;
    draw.flags = read_flags(what);
    draw.segments = segments.as_int("segments");
    draw.force_scale = force_scale, draw.axis_length = axis_length, draw.plane_size = plane_size;
    draw.environment = environment.as_int("environment");
    sadmm_status status;
    std::string message;
    {
        nb::gil_scoped_release release;
        world_lock lock(w);
        status = sadmm_world_prepare_draw(w.handle);
        if (status != SADMM_OK) {
            message = sadmm_world_message(w.handle);
        } else {
            status = sadmm_world_debug_draw(w.handle, &draw);
            if (status != SADMM_OK) message = sadmm_last_message();
        }
    }
    if (status != SADMM_OK) raise_status(status, message);
    nb::dict out;
    out["lines"] = array(d.lines, {2, 3});
    out["line_colours"] = array(d.line_colours, {});
    out["triangles"] = array(d.triangles, {3, 3});
    out["triangle_normals"] = array(d.normals, {3});
    out["triangle_colours"] = array(d.triangle_colours, {});
    out["points"] = array(d.points, {3});
    out["point_colours"] = array(d.point_colours, {});
    nb::list texts;
    for (const auto &[text, at] : d.texts) texts.append(nb::make_tuple(text, nb::make_tuple(at[0], at[1], at[2])));
    out["texts"] = texts;
    return out;
}

} // namespace

void bind_debug_draw(nb::class_<world> &w)
{
    w.def("debug_draw", &debug_draw, "what"_a = nb::make_tuple("shapes"), nb::kw_only(), "segments"_a = 24,
          "force_scale"_a = 0.01, "axis_length"_a = 0.1, "plane_size"_a = 10.0, "environment"_a = -1,
          "What the world is as arrays for a program that draws, in m, world: a dict of lines (n x 2 x 3), triangles "
          "(n x 3 x 3,\ncounter-clockwise from outside), triangle_normals (n x 3), points (n x 3), their colours "
          "(0xRRGGBB), and texts, a list of\n(text, position). what: 'shapes', 'edges', 'bounds', 'joints', "
          "'couplings', 'contacts', 'forces', 'centres', 'islands',\n'names'; include/subadmm/draw.h says what each "
          "is. segments: of a circle; force_scale: m/N; axis_length, plane_size: m.");
}
