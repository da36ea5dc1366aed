// Rays, overlaps, closest points.
#include <limits>

#include "common.h"

using rows3 = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

static sadmm_query_filter filter_of(world &w, const std::optional<body> &ignore, const std::vector<std::string> &types,
                                    const whole &category, const whole &mask, bool from_inside, bool from_behind,
                                    bool sensors)
{
    sadmm_query_filter filter = sadmm_query_filter_default();
    if (ignore) filter.ignored = id_in(w, *ignore, "ignore");
    if (!types.empty()) filter.body_types = 0;
    for (const std::string &type : types) filter.body_types |= 1u << named<sadmm_body_type>("types", type);
    filter.category = category.as_bits("category"), filter.mask = mask.as_bits("mask");
    filter.from_inside = from_inside, filter.from_behind = from_behind, filter.sensors = sensors;
    return filter;
}

// By index of the shape, so that all of it is arrays.
static nb::dict cast_rays(nb::handle_t<world> self, rows3 origins, rows3 directions, double length,
                          const std::optional<body> &ignore, const std::vector<std::string> &types, whole category,
                          whole mask, bool from_inside, bool from_behind, bool sensors)
{
    world &w = nb::cast<world &>(self);
    const size_t n = origins.shape(0);
    if (directions.shape(0) != n) throw nb::value_error("directions: must be as many as origins");
    if (n > INT32_MAX) throw nb::value_error("origins: too many");
    const sadmm_query_filter filter = filter_of(w, ignore, types, category, mask, from_inside, from_behind, sensors);
    std::vector<sadmm_ray> rays(n + 1);
    std::vector<sadmm_ray_hit> hits(n + 1);
    for (size_t i = 0; i < n; ++i) {
        for (size_t k = 0; k < 3; ++k) rays[i].origin[k] = origins(i, k), rays[i].direction[k] = directions(i, k);
        rays[i].length = length;
    }
    std::vector<int32_t> shapes(n), triangles(n);
    std::vector<double> distances(n), points(3 * n), normals(3 * n);
    call(w, [&](sadmm_world *h) {
        sadmm_status status = sadmm_world_cast_rays(h, (int32_t)n, rays.data(), &filter, hits.data());
        for (size_t i = 0; i < n && status == SADMM_OK; ++i) {
            const bool hit = hits[i].shape.slot != 0;
            shapes[i] = -1;
            if (hit) status = sadmm_world_shape_index(h, hits[i].shape, &shapes[i]);
            distances[i] = hit ? hits[i].distance : std::numeric_limits<double>::infinity();
            triangles[i] = hits[i].triangle;
            for (size_t k = 0; k < 3; ++k) points[3 * i + k] = hits[i].point[k], normals[3 * i + k] = hits[i].normal[k];
        }
        return status;
    });
    nb::dict out;
    out["shape"] = numpy_of(std::move(shapes), {n});
    out["distance"] = numpy_of(std::move(distances), {n});
    out["point"] = numpy_of(std::move(points), {n, 3});
    out["normal"] = numpy_of(std::move(normals), {n, 3});
    out["triangle"] = numpy_of(std::move(triangles), {n});
    return out;
}

// ask(capacity, ids, count): a query of the library's.
template <class F> static std::vector<shape> overlaps(nb::handle self, F ask)
{
    world &w = nb::cast<world &>(self);
    std::vector<sadmm_shape_id> ids;
    call(w, [&](sadmm_world *h) {
        int32_t count = 0;
        sadmm_status status = ask(h, 0, nullptr, &count);
        ids.resize((size_t)count);
        if (status == SADMM_OK && count > 0) status = ask(h, count, ids.data(), &count);
        return status;
    });
    std::vector<shape> out;
    for (const sadmm_shape_id &id : ids) out.push_back(shape{nb::borrow(self), &w, id});
    return out;
}

static nb::dict dict_of(const sadmm_closest_points &c)
{
    nb::dict out;
    out["distance"] = c.distance;
    out["normal"] = array_of<3>(c.normal);
    out["a"] = array_of<3>(c.a), out["b"] = array_of<3>(c.b);
    out["triangle"] = c.triangle;
    return out;
}

void bind_queries(nb::class_<world> &w)
{
    w.def("_cast_rays", &cast_rays, "origins"_a.noconvert(), "directions"_a.noconvert(), "length"_a, "ignore"_a.none(),
          "types"_a, "category"_a, "mask"_a, "from_inside"_a, "from_behind"_a, "sensors"_a);
    w.def(
        "cast_shape",
        [](nb::handle_t<world> self, const shape_def &shape_, numbers<3> direction, numbers<3> position,
           numbers<4> orientation, double length, const std::optional<body> &ignore,
           const std::vector<std::string> &types, whole category, whole mask, bool from_inside, bool from_behind,
           bool sensors) -> std::optional<nb::dict> {
            world &w = nb::cast<world &>(self);
            const sadmm_shape_def def = shape_.def; // another thread may change it
            const vec3 way = direction.as("direction"), x = position.as("position");
            const quat q = orientation.as("orientation");
            const sadmm_query_filter filter =
                filter_of(w, ignore, types, category, mask, from_inside, from_behind, sensors);
            sadmm_ray_hit hit;
            call(w, [&](sadmm_world *h) {
                return sadmm_world_cast_shape(h, &def, x.data(), q.data(), way.data(), length, &filter, &hit);
            });
            if (hit.shape.slot == 0) return std::nullopt;
            nb::dict out;
            out["shape"] = shape{nb::borrow(self), &w, hit.shape};
            out["distance"] = hit.distance;
            out["point"] = array_of<3>(hit.point), out["normal"] = array_of<3>(hit.normal);
            out["triangle"] = hit.triangle;
            out["inside"] = hit.inside;
            return out;
        },
        "shape"_a, "direction"_a, "position"_a = vec3{}, "orientation"_a = quat{1, 0, 0, 0},
        "length"_a = std::numeric_limits<double>::infinity(), nb::kw_only(), "ignore"_a.none() = nb::none(),
        "types"_a = std::vector<std::string>{}, "category"_a = 0, "mask"_a = 0, "from_inside"_a = true,
        "from_behind"_a = false, "sensors"_a = false,
        "What a shape definition at a pose in the world touches first as it moves along `direction` without turning, "
        "by up to `length` m: a dict with shape, distance (m, that it moves), point and normal (of the shape it "
        "touches, outward; world), triangle (of a mesh, else -1), inside (they overlap where it begins); None: "
        "nothing. Filters as of cast_rays.");
    w.def("overlap_box", [](nb::handle_t<world> self, numbers<3> from, numbers<3> to) {
        const vec3 lowest = from.as("lowest"), highest = to.as("highest");
        return overlaps(self, [&](sadmm_world *h, int32_t capacity, sadmm_shape_id *ids, int32_t *count) {
            return sadmm_world_overlap_box(h, lowest.data(), highest.data(), nullptr, capacity, ids, count);
        });
    }, "lowest"_a, "highest"_a, "Shapes whose bounding boxes overlap the box from lowest to highest (m, world).");
    w.def(
        "overlap",
        [](nb::handle_t<world> self, const shape_def &shape, numbers<3> position, numbers<4> orientation) {
            const sadmm_shape_def def = shape.def; // another thread may change it
            const vec3 x = position.as("position");
            const quat q = orientation.as("orientation");
            return overlaps(self, [&](sadmm_world *h, int32_t capacity, sadmm_shape_id *ids, int32_t *count) {
                return sadmm_world_overlap_shape(h, &def, x.data(), q.data(), nullptr, capacity, ids, count);
            });
        },
        "shape"_a, "position"_a = vec3{}, "orientation"_a = quat{1, 0, 0, 0},
        "Shapes that overlap this one at a pose in the world.");
    w.def(
        "closest_points",
        [](world &w, const shape &a, const shape &b) {
            const sadmm_shape_id first = id_in(w, a, "a"), second = id_in(w, b, "b");
            sadmm_closest_points c;
            call(w, [&](sadmm_world *h) { return sadmm_world_closest_points(h, first, second, &c); });
            return dict_of(c);
        },
        "a"_a, "b"_a,
        "Distance of two shapes: a dict with distance (m; negative: penetration), normal from a to b, points a and b, "
        "triangle.");
    w.def(
        "closest_to",
        [](world &w, const shape_def &shape_, const shape &other, numbers<3> position, numbers<4> orientation) {
            const sadmm_shape_def def = shape_.def; // another thread may change it
            const sadmm_shape_id id = id_in(w, other, "other");
            const vec3 x = position.as("position");
            const quat q = orientation.as("orientation");
            sadmm_closest_points c;
            call(w, [&](sadmm_world *h) { return sadmm_world_closest_to_shape(h, &def, x.data(), q.data(), id, &c); });
            return dict_of(c);
        },
        "shape"_a, "other"_a, "position"_a = vec3{}, "orientation"_a = quat{1, 0, 0, 0},
        "The same for a shape definition at a pose and a shape.");
}
