// Joints, gears and virtual couplings.
#include "fields.h"
#include "tags.h"

using C = coordinate_of;

#define BIND(X, kind, role, name, ...) \
    bind_##kind(c, #name, [](auto &o) -> auto & { return o.values.name; }, documented(*field++));

static void bind_coordinate(nb::module_ &m)
{
    nb::class_<C> c(m, "Coordinate",
                    "What acts along one free coordinate of a joint; m and N, or rad and N m. Coordinate(limited=True, "
                    "lower=-1, upper=1): the defaults, with changes.");
    c.def("__init__", [](nb::pointer_and_handle<C> self, nb::kwargs values) {
        new (self.p) C();
        nb::inst_mark_ready(self.h);
        set_members(self.h, values);
    });
    const sadmm_field *field = sadmm_coordinate_table;
    SADMM_COORDINATE_FIELDS(BIND, )
}

static joint add_joint(nb::handle_t<world> self, const std::string &kind, const std::optional<body> &a,
                       const std::optional<body> &b, std::optional<numbers<3>> position,
                       std::optional<numbers<4>> orientation SADMM_JOINT_FIELDS(PARAMETER, ),
                       const nb::dict &coordinates, const std::string &name)
{
    world &w = nb::cast<world &>(self);
    joint out{nb::borrow(self), &w, {}};
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = named<sadmm_joint_kind>("kind", kind);
    if (a) def.body_a = id_in(w, *a, "a");
    if (b) def.body_b = id_in(w, *b, "b");
    SADMM_JOINT_FIELDS(PUT, def)
    def.name = without_null("name", name).c_str();
    const vec3 place = position ? position->as("position") : vec3{};
    const quat turn = orientation ? orientation->as("orientation") : quat{1, 0, 0, 0};
    for (auto [k, value] : coordinates) {
        const int64_t index = whole{nb::borrow(k)}.in("key of coordinates", 0, 5);
        const std::string which = "coordinates[" + std::to_string(index) + "]";
        if (!nb::isinstance<C>(value)) refuse_type(which.c_str(), value, "must be a subadmm.Coordinate");
        def.coordinates[index] = nb::cast<C &>(value).values;
    }
    call(w, [&](sadmm_world *h) {
        sadmm_status status = SADMM_OK;
        if (position || orientation) status = sadmm_world_place_joint(h, &def, place.data(), turn.data());
        return status == SADMM_OK ? sadmm_world_add_joint(h, &def, &out.id) : status;
    });
    return out;
}

static sadmm_joint_def def_of(const joint &j)
{
    sadmm_joint_def def;
    call(j.in(), [&](sadmm_world *h) { return sadmm_world_joint_def(h, j.id, &def); });
    return def;
}

static sadmm_joint_state state_of(const joint &j)
{
    sadmm_joint_state state;
    call(j.in(), [&](sadmm_world *h) { return sadmm_world_joint_state(h, j.id, &state); });
    return state;
}

static nb::object body_of(const joint &j, sadmm_body_id id)
{
    return id.slot == 0 ? nb::none() : nb::cast(body{j.owner, j.w, id});
}

static int index_of(const whole &index) { return (int)index.in("index", 0, 5); }

// Frames, bodies, coordinates and flags have forms of their own below.
#define JOINT_IS(X, kind, role, name, value, lo, hi, ends, text) JOINT_IS_##kind(name, text)
#define JOINT_IS_REAL(name, text) READ_ONLY(c, joint, name, text);
#define JOINT_IS_BOUND(name, text) READ_ONLY(c, joint, name, text);
#define JOINT_IS_BITS(name, text) READ_ONLY(c, joint, name, "Bit k: coordinate k is locked.");
#define JOINT_IS_JOINT_KIND(name, text) READ_ONLY(c, joint, name, text);
#define JOINT_IS_VECTOR(name, text)
#define JOINT_IS_TURN(name, text)
#define JOINT_IS_FLAG(name, text)
#define JOINT_IS_ID(name, text)
#define JOINT_IS_OTHER(name, text)

static void bind_joint(nb::module_ &m)
{
    nb::class_<joint> c(
        m, "Joint", collected<sadmm_joint_id>(),
        "A joint of a world. Coordinates 0 to 2 are translations along the axes of a's frame, 3 to 5 rotations.");
    c.def(
         "__eq__", [](const joint &a, const joint &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_joint_id>)
        .def_prop_ro("world", [](const joint &j) { return j.owner; })
        .def_prop_ro(
            "index",
            [](const joint &j) {
                int32_t index;
                call(j.in(), [&](sadmm_world *h) { return sadmm_world_joint_index(h, j.id, &index); });
                return index;
            },
            "Row of the world's arrays.")
        .def_prop_ro(
            "body_a", [](const joint &j) { return body_of(j, def_of(j).body_a); }, "None: the static world.")
        .def_prop_ro("body_b", [](const joint &j) { return body_of(j, def_of(j).body_b); })
        .def_prop_ro(
            "frame_a",
            [](const joint &j) {
                const auto d = def_of(j);
                return std::make_pair(array_of<3>(d.position_a), array_of<4>(d.orientation_a));
            },
            "(position, orientation) in a's body frame.")
        .def_prop_ro("frame_b",
                     [](const joint &j) {
                         const auto d = def_of(j);
                         return std::make_pair(array_of<3>(d.position_b), array_of<4>(d.orientation_b));
                     })
        .def_prop_ro(
            "collide", [](const joint &j) { return def_of(j).collide; }, "Whether the two bodies collide.")
        .def_prop_rw(
            "enabled", [](const joint &j) { return def_of(j).enabled; },
            [](const joint &j, bool on) {
                call(j.in(), [&](sadmm_world *h) { return sadmm_world_set_joint_enabled(h, j.id, on); });
            })
        .def(
            "coordinate",
            [](const joint &j, whole index) {
                return C{def_of(j).coordinates[index_of(index)], true};
            },
            "index"_a, "What acts along the coordinate: a copy, which is not to be written to.")
        .def(
            "set_coordinate",
            [](const joint &j, whole index, const C &given) {
                const int k = index_of(index);
                const sadmm_joint_coordinate value = given.values; // another thread may change it
                call(j.in(), [&](sadmm_world *h) { return sadmm_world_set_joint_coordinate(h, j.id, k, &value); });
            },
            "index"_a, "coordinate"_a, "From the next step on.")
        .def(
            "set_target",
            [](const joint &j, whole index, std::optional<double> x, std::optional<double> v) {
                const int k = index_of(index);
                call(j.in(), [&](sadmm_world *h) { // nobody else sets it in between
                    sadmm_joint_def def;
                    const sadmm_status status = sadmm_world_joint_def(h, j.id, &def);
                    if (status != SADMM_OK) return status;
                    if (x) def.coordinates[k].target_position = *x;
                    if (v) def.coordinates[k].target_speed = *v;
                    return sadmm_world_set_joint_coordinate(h, j.id, k, &def.coordinates[k]);
                });
            },
            "index"_a, "position"_a = nb::none(), "speed"_a = nb::none(), "Set the target of the coordinate's drive.")
        .def(
            "set_spring_table",
            [](const joint &j, whole index, const std::vector<double> &x, const std::vector<double> &f) {
                const int k = index_of(index);
                if (x.size() != f.size()) throw nb::value_error("forces: must be as many as positions");
                call(j.in(), [&](sadmm_world *h) {
                    return sadmm_world_set_joint_spring_table(h, j.id, k, x.data(), f.data(), (int32_t)x.size());
                });
            },
            "index"_a, "positions"_a, "forces"_a, "A nonlinear spring: loads at positions; empty lists: none.")
        .def("remove",
             [](const joint &j) { call(j.in(), [&](sadmm_world *h) { return sadmm_world_remove_joint(h, j.id); }); });
    SADMM_JOINT_FIELDS(JOINT_IS, )
    bind_tags(c);
#define OF_STATE(name, doc) .def_prop_ro(#name, [](const joint &j) { return array_of<6>(state_of(j).name); }, doc)
    c OF_STATE(position, "Coordinates, m and rad; of locked ones the error.")
        OF_STATE(speed, "m/s and rad/s.")
        OF_STATE(wrench_a, "On a: force (N), torque about the joint's point (N m), world.")
        OF_STATE(wrench_b, "On b.")
        OF_STATE(wrench_joint, "wrench_b along the axes of a's frame.")
        OF_STATE(lock_force, "By coordinate, N or N m.")
        OF_STATE(limit_force, "By coordinate.")
        OF_STATE(drive_force, "By coordinate.")
        OF_STATE(friction_force, "By coordinate.")
        OF_STATE(spring_force, "By coordinate.")
        OF_STATE(armature_force, "By coordinate.")
        .def_prop_ro("broken", [](const joint &j) { return state_of(j).broken; });
#undef OF_STATE
}

static gear add_gear(nb::handle_t<world> self, const joint &a, whole coordinate_a, const joint &b, whole coordinate_b,
                     double ratio, std::optional<double> offset, bool enabled, const std::string &name)
{
    world &w = nb::cast<world &>(self);
    gear out{nb::borrow(self), &w, {}};
    sadmm_gear_def def = sadmm_gear_def_default();
    def.joint_1 = id_in(w, a, "joint_1"), def.coordinate_1 = coordinate_a.as_int("coordinate_1");
    def.joint_2 = id_in(w, b, "joint_2"), def.coordinate_2 = coordinate_b.as_int("coordinate_2");
    def.ratio = ratio, def.enabled = enabled;
    if (offset) def.offset = *offset;
    def.name = without_null("name", name).c_str();
    call(w, [&](sadmm_world *h) { return sadmm_world_add_gear(h, &def, &out.id); });
    return out;
}

static coupling add_coupling(nb::handle_t<world> self, const body &b SADMM_COUPLING_FIELDS(PARAMETER, ),
                             const std::string &name)
{
    world &w = nb::cast<world &>(self);
    coupling out{nb::borrow(self), &w, {}};
    sadmm_coupling_def def = sadmm_coupling_def_default();
    def.body = id_in(w, b, "body");
    SADMM_COUPLING_FIELDS(PUT, def)
    def.name = without_null("name", name).c_str();
    call(w, [&](sadmm_world *h) { return sadmm_world_add_coupling(h, &def, &out.id); });
    return out;
}

static sadmm_coupling_state state_of(const coupling &c)
{
    sadmm_coupling_state state;
    call(c.in(), [&](sadmm_world *h) { return sadmm_world_coupling_state(h, c.id, &state); });
    return state;
}

static sadmm_coupling_def def_of(const coupling &c)
{
    sadmm_coupling_def def;
    call(c.in(), [&](sadmm_world *h) { return sadmm_world_coupling_def(h, c.id, &def); });
    return def;
}

// Frame, target and body have forms of their own below.
#define COUPLING_IS(X, kind, role, name, value, lo, hi, ends, text) COUPLING_IS_##kind(name, text)
#define COUPLING_IS_REAL(name, text) READ_ONLY(c, coupling, name, text);
#define COUPLING_IS_BOUND(name, text) READ_ONLY(c, coupling, name, text);
#define COUPLING_IS_FLAG(name, text) READ_ONLY(c, coupling, name, text);
#define COUPLING_IS_VECTOR(name, text)
#define COUPLING_IS_TURN(name, text)
#define COUPLING_IS_TWIST(name, text)
#define COUPLING_IS_ID(name, text)
#define COUPLING_IS_OTHER(name, text)

static void bind_coupling(nb::module_ &m)
{
    nb::class_<coupling> c(m, "Coupling", collected<sadmm_coupling_id>(),
                           "A spring and damper that pulls a body to a target pose.");
    c.def(
         "__eq__", [](const coupling &a, const coupling &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_coupling_id>)
        .def_prop_ro("world", [](const coupling &c) { return c.owner; })
        .def_prop_ro(
            "index",
            [](const coupling &c) {
                int32_t index;
                call(c.in(), [&](sadmm_world *h) { return sadmm_world_coupling_index(h, c.id, &index); });
                return index;
            },
            "Row of the world's arrays.")
        .def_prop_ro("body",
                     [](const coupling &c) {
                         return body{c.owner, c.w, def_of(c).body};
                     })
        .def_prop_ro(
            "frame",
            [](const coupling &c) {
                const auto d = def_of(c);
                return std::make_pair(array_of<3>(d.position), array_of<4>(d.orientation));
            },
            "(position, orientation) on the body, in its body frame.")
        .def_prop_ro(
            "target",
            [](const coupling &c) {
                const auto d = def_of(c);
                return std::make_pair(array_of<3>(d.target_position), array_of<4>(d.target_orientation));
            },
            "(position, orientation) now, world.")
        .def(
            "set_target",
            [](const coupling &c, numbers<3> position, numbers<4> orientation, std::optional<numbers<6>> velocity) {
                const vec3 x = position.as("position");
                const quat q = orientation.as("orientation");
                const std::optional<vec6> v = velocity ? std::optional(velocity->as("velocity")) : std::nullopt;
                call(c.in(), [&](sadmm_world *h) {
                    return sadmm_world_set_coupling_target(h, c.id, x.data(), q.data(), v ? v->data() : nullptr);
                });
            },
            "position"_a, "orientation"_a = quat{1, 0, 0, 0}, "velocity"_a = nb::none(),
            "Set the target at the current time, world frame; velocity: linear, angular.")
        .def(
            "set_gains",
            [](const coupling &c, double k, double d, double ka, double da) {
                call(c.in(), [&](sadmm_world *h) { return sadmm_world_set_coupling_gains(h, c.id, k, d, ka, da); });
            },
            "linear_stiffness"_a, "linear_damping"_a, "angular_stiffness"_a, "angular_damping"_a)
        .def(
            "set_limits",
            [](const coupling &c, double f, double t) {
                call(c.in(), [&](sadmm_world *h) { return sadmm_world_set_coupling_limits(h, c.id, f, t); });
            },
            "max_force"_a, "max_torque"_a)
        .def(
            "set_enabled",
            [](const coupling &c, bool on) {
                call(c.in(), [&](sadmm_world *h) { return sadmm_world_set_coupling_enabled(h, c.id, on); });
            },
            "enabled"_a)
        .def_prop_ro(
            "reaction_force", [](const coupling &c) { return array_of<3>(state_of(c).reaction_force); },
            "Reaction on the user, N.")
        .def_prop_ro(
            "reaction_torque", [](const coupling &c) { return array_of<3>(state_of(c).reaction_torque); },
            "About the target's origin, N m.")
        .def_prop_ro(
            "position_error", [](const coupling &c) { return array_of<3>(state_of(c).position_error); }, "m.")
        .def_prop_ro(
            "rotation_error", [](const coupling &c) { return array_of<3>(state_of(c).rotation_error); },
            "Rotation vector, rad.")
        .def("remove", [](const coupling &c) {
            call(c.in(), [&](sadmm_world *h) { return sadmm_world_remove_coupling(h, c.id); });
        });
    SADMM_COUPLING_FIELDS(COUPLING_IS, )
    bind_tags(c);
    nb::class_<gear> g(m, "Gear", collected<sadmm_gear_id>(), "A ratio between two coordinates of joints.");
    bind_tags(g);
    g.def(
         "__eq__", [](const gear &a, const gear &b) { return same_id(a, b); }, nb::is_operator())
        .def("__hash__", &hash_of<sadmm_gear_id>)
        .def_prop_ro("world", [](const gear &g) { return g.owner; })
        .def(
            "set_enabled",
            [](const gear &g, bool on) {
                call(g.in(), [&](sadmm_world *h) { return sadmm_world_set_gear_enabled(h, g.id, on); });
            },
            "enabled"_a)
        .def_prop_ro("error",
                     [](const gear &g) {
                         sadmm_gear_state state;
                         call(g.in(), [&](sadmm_world *h) { return sadmm_world_gear_state(h, g.id, &state); });
                         return state.error;
                     })
        .def("remove",
             [](const gear &g) { call(g.in(), [&](sadmm_world *h) { return sadmm_world_remove_gear(h, g.id); }); });
}

#define KIND_AND_USE(X, value, name, locks, free, use) "  '" name "': " use "\n"

void bind_joints(nb::module_ &m, nb::class_<world> &w)
{
    bind_coordinate(m);
    bind_joint(m);
    bind_coupling(m);
    w.def(
        "add_joint", &add_joint, "kind"_a, "a"_a.none() = nb::none(), "b"_a.none() = nb::none(), nb::kw_only(),
        "position"_a = nb::none(), "orientation"_a = nb::none() SADMM_JOINT_FIELDS(ARGUMENT, ),
        "coordinates"_a = nb::dict(), "name"_a = "",
        "A joint between body a and body b (None: the static world). kind:\n" SADMM_JOINT_KINDS(KIND_AND_USE, )
        "Frames: `position` and `orientation` in the world at the current poses, or position_a ... in the bodies' "
        "frames.\ncoordinates: {5: Coordinate(drive='speed', target_speed=2)}, what acts along free ones.");
    w.def("add_gear", &add_gear, "joint_1"_a, "coordinate_1"_a, "joint_2"_a, "coordinate_2"_a, "ratio"_a = 1.0,
          "offset"_a = nb::none(), "enabled"_a = true, "name"_a = "",
          "q_1 + ratio q_2 = offset; None: the current value.");
    w.def("add_coupling", &add_coupling, "body"_a, nb::kw_only() SADMM_COUPLING_FIELDS(ARGUMENT, ), "name"_a = "",
          "A virtual coupling of a frame on the body to a target pose in the world. N/m, N s/m, N m/rad, N m s/rad.");
    w.def_prop_ro("joints", [](nb::handle_t<world> self) {
        return all_of<joint>(self, &sadmm_world_joint_count, &sadmm_world_joint_at);
    }, "All joints, in the order of the arrays' rows.");
    w.def_prop_ro("couplings", [](nb::handle_t<world> self) {
        return all_of<coupling>(self, &sadmm_world_coupling_count, &sadmm_world_coupling_at);
    }, "All couplings.");
    w.def_prop_ro("gears", [](nb::handle_t<world> self) {
        return all_of<gear>(self, &sadmm_world_gear_count, &sadmm_world_gear_at);
    }, "All gears.");
}
