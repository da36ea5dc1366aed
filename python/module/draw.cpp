// Pictures in software: triangles with a depth buffer, a sun with a shadow map, ambient occlusion. What is drawn is
// said in subadmm/show/picture.py; here is what takes time.
//
// Triangles are put into lists by bands of rows. A band belongs to one thread, which goes through its list in the
// triangles' order: pictures do not depend on threads.
#include "common.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/base/parallel.h"

using floats = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;
using doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using ints = nb::ndarray<const int32_t, nb::c_contig, nb::device::cpu>;
using bytes8 = nb::ndarray<const uint8_t, nb::c_contig, nb::device::cpu>;

namespace
{

struct v3 {
    float x, y, z;
};
v3 operator+(v3 a, v3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
v3 operator-(v3 a, v3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
v3 operator*(float s, v3 a) { return {s * a.x, s * a.y, s * a.z}; }
float dot(v3 a, v3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
v3 cross(v3 a, v3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
v3 unit(v3 a)
{
    float length = std::sqrt(dot(a, a));
    return length > 0 ? (1 / length) * a : a;
}
v3 read3(const float *p) { return {p[0], p[1], p[2]}; }

constexpr int BAND = 16;       // rows
constexpr float BRIGHT = 2.2f; // sRGB, nearly
constexpr float FAR = 1e30f;

struct texture {
    // Halved again and again, each in linear light, for what is seen from afar.
    struct level {
        int width, height;
        std::vector<v3> at;
    };
    std::vector<level> levels;

    v3 sample(float u, float v, float across) const
    {
        // across: texels of the first level along a sample's side
        int k = across > 1 ? std::min((int)(std::log2(across) + 0.5f), (int)levels.size() - 1) : 0;
        const level &l = levels[(size_t)k];
        float x = (u - std::floor(u)) * (float)l.width - 0.5f, y = (v - std::floor(v)) * (float)l.height - 0.5f;
        int x0 = (int)std::floor(x), y0 = (int)std::floor(y);
        float fx = x - (float)x0, fy = y - (float)y0;
        auto texel = [&](int i, int j) {
            i = (i % l.width + l.width) % l.width, j = (j % l.height + l.height) % l.height;
            return l.at[(size_t)j * (size_t)l.width + (size_t)i];
        };
        return (1 - fy) * ((1 - fx) * texel(x0, y0) + fx * texel(x0 + 1, y0)) +
               fy * ((1 - fx) * texel(x0, y0 + 1) + fx * texel(x0 + 1, y0 + 1));
    }
};

struct form {
    size_t first, corners; // of `vertices`; triangles are from `triangle` on
    size_t triangle, triangles;
    bool ground, textured;
    texture image;
    std::vector<float> uv; // 6 a triangle
    std::vector<int32_t> body;
    std::vector<double> position, orientation, scale;
    std::vector<float> colour; // rgba, sRGB
};

struct turn3 {
    double m[9];
};
turn3 matrix(const double *q)
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    return {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
             1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
             1 - 2 * (x * x + y * y)}};
}

// A corner of a triangle that is drawn.
struct corner {
    v3 at, normal; // world, from the picture's centre
    float u, v;
};
struct triangle {
    corner c[3];
    v3 flat; // unit normal
    int32_t form, instance;
};
struct flat_triangle {
    float x[3], y[3], d[3]; // pixels, depth that is linear over the picture: less is nearer
};
// What all samples of a triangle have in common.
struct shared {
    v3 to_b, to_c;  // shares of corners b and c are these times a place, from corner a
    float from_eye; // of its plane, along its normal
    float texels;   // of a texture, a length
    bool even;      // all corners have one normal
};

struct buffer {
    int width, height;
    bool keeps; // which triangles are seen, not only how far away
    std::vector<float> depth;
    std::vector<int32_t> which;
};

// For f(piece), pieces of [0, count) as threads are free.
struct pieces {
    std::atomic<size_t> next;
    size_t count;
    void *closure;
    void (*call)(void *, size_t);
};
void work(void *argument, int, int)
{
    pieces &p = *(pieces *)argument;
    for (size_t k = p.next++; k < p.count; k = p.next++) p.call(p.closure, k);
}
template <class F> void each(size_t count, int threads, F f)
{
    pieces p;
    p.next = 0, p.count = count, p.closure = &f;
    p.call = [](void *closure, size_t k) { (*(F *)closure)(k); };
    int with = sadmm_team_threads(nullptr, threads, std::min(count, (size_t)64));
    if (with > 1) sadmm_parallel_open(nullptr, with, &work, &p);
    else work(&p, 0, 1);
}

void rasterise(const std::vector<flat_triangle> &all, const std::vector<uint8_t> &alpha, buffer &out, int threads)
{
    int bands = (out.height + BAND - 1) / BAND;
    out.depth.assign((size_t)out.width * (size_t)out.height, FAR);
    if (out.keeps) out.which.assign(out.depth.size(), -1);
    std::vector<std::vector<int32_t>> in((size_t)bands);
    for (size_t t = 0; t < all.size(); ++t) {
        const flat_triangle &f = all[t];
        float area = (f.x[1] - f.x[0]) * (f.y[2] - f.y[0]) - (f.x[2] - f.x[0]) * (f.y[1] - f.y[0]);
        if (!(area < 0)) continue; // seen from behind: y is down
        float top = std::min({f.y[0], f.y[1], f.y[2]}), bottom = std::max({f.y[0], f.y[1], f.y[2]});
        float left = std::min({f.x[0], f.x[1], f.x[2]}), right = std::max({f.x[0], f.x[1], f.x[2]});
        if (bottom <= 0 || top >= (float)out.height || right <= 0 || left >= (float)out.width) continue;
        int from = std::max((int)std::ceil(top - 0.5f), 0);
        int to = (int)std::min(std::floor(bottom - 0.5f), (float)out.height - 1); // the last row with a sample in it
        for (int b = from / BAND; b <= to / BAND && from <= to; ++b) in[(size_t)b].push_back((int32_t)t);
    }
    static const uint8_t bayer[16] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
    each((size_t)bands, threads, [&](size_t band) {
        int begin = (int)band * BAND, end = std::min(begin + BAND, out.height);
        for (int32_t t : in[band]) {
            const flat_triangle &f = all[(size_t)t];
            double x0 = f.x[0], y0 = f.y[0], x1 = f.x[1], y1 = f.y[1], x2 = f.x[2], y2 = f.y[2];
            double scale = 1 / ((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0));
            // Shares of corners 1 and 2, affine in the pixel.
            double bx = (y2 - y0) * scale, by = (x0 - x2) * scale, b0 = -bx * x0 - by * y0;
            double cx = (y0 - y1) * scale, cy = (x1 - x0) * scale, c0 = -cx * x0 - cy * y0;
            double top = std::min({y0, y1, y2}), bottom = std::max({y0, y1, y2});
            int from = std::max((int)std::ceil(top - 0.5), begin);
            int to = std::min((int)std::floor(std::min(bottom, 1e6) - 0.5), end - 1);
            bool clear = alpha[(size_t)t] < 16;
            for (int row = from; row <= to; ++row) {
                double y = row + 0.5, low = 0, high = out.width;
                // Columns between the edges: each share is affine along the row.
                double value[3] = {b0 + by * y, c0 + cy * y, 1 - b0 - c0 - (by + cy) * y},
                       slope[3] = {bx, cx, -bx - cx};
                bool none = false;
                for (int k = 0; k < 3; ++k) {
                    double v = value[k] + 1e-9;
                    if (slope[k] > 0) low = std::max(low, -v / slope[k]);
                    else if (slope[k] < 0) high = std::min(high, -v / slope[k]);
                    else if (v < 0) none = true;
                }
                if (none || !(low <= high)) continue;
                int first = (int)std::ceil(low - 0.5), last = std::min((int)std::floor(high - 0.5), out.width - 1);
                first = std::max(first, 0);
                float *depth = &out.depth[(size_t)row * (size_t)out.width];
                int32_t *which = out.keeps ? &out.which[(size_t)row * (size_t)out.width] : nullptr;
                double e1 = (double)f.d[1] - f.d[0], e2 = (double)f.d[2] - f.d[0];
                double d = f.d[0] + value[0] * e1 + value[1] * e2, dx = bx * e1 + cx * e2;
                for (int column = first; column <= last; ++column) {
                    float here = (float)(d + dx * (column + 0.5));
                    if (here < depth[column]) {
                        if (clear && bayer[(row & 3) * 4 + (column & 3)] >= alpha[(size_t)t]) continue;
                        depth[column] = here;
                        if (which) which[column] = t;
                    }
                }
            }
        }
    });
}

struct shading {
    std::vector<v3> at, normal, colour, direct; // of each sample; direct: light of the sun
    std::vector<float> fade;                    // of the ground, into what is behind all
    std::vector<float> open;                    // share of the sky
};

struct canvas {
    std::vector<v3> vertices, normals; // normals: 3 a triangle
    std::vector<int32_t> indices;
    std::vector<form> forms;
    std::mutex guard; // the buffers are those of one picture at a time
    std::vector<triangle> drawn;
    std::vector<flat_triangle> flat, above;
    std::vector<shared> common;
    std::vector<uint8_t> alpha;
    buffer seen, sun;
    shading samples;
};

template <class Array> void want(const Array &a, const char *name, size_t columns)
{
    size_t size = 1;
    for (size_t k = 1; k < a.ndim(); ++k) size *= a.shape(k);
    if (a.ndim() < 1 || size != columns)
        refuse_value(name, nb::none(), "must have " + std::to_string(columns) + " columns");
}

void add(canvas &c, floats vertices, ints triangles, floats normals, ints body, doubles position, doubles orientation,
         doubles scale, floats colour, bool ground, nb::object uv, nb::object image)
{
    want(vertices, "vertices", 3), want(triangles, "triangles", 3), want(normals, "normals", 9);
    want(position, "position", 3), want(orientation, "orientation", 4), want(scale, "scale", 3),
        want(colour, "colour", 4);
    size_t n = body.shape(0);
    for (size_t size : {position.shape(0), orientation.shape(0), scale.shape(0), colour.shape(0)})
        if (size != n) refuse_value("body", nb::none(), "must be as many as poses");
    if (normals.shape(0) != triangles.shape(0)) refuse_value("normals", nb::none(), "must be as many as triangles");
    for (size_t k = 0; k < 3 * triangles.shape(0); ++k)
        if (triangles.data()[k] < 0 || (size_t)triangles.data()[k] >= vertices.shape(0))
            refuse_value("triangles", nb::none(), "must be of the vertices");
    form f;
    f.first = c.vertices.size(), f.corners = vertices.shape(0);
    f.triangle = c.indices.size() / 3, f.triangles = triangles.shape(0);
    f.ground = ground, f.textured = !uv.is_none() && !image.is_none();
    if (f.textured) {
        auto points = nb::cast<floats>(uv);
        auto pixels = nb::cast<bytes8>(image);
        want(points, "uv", 6);
        if (points.shape(0) != f.triangles) refuse_value("uv", nb::none(), "must be as many as triangles");
        if (pixels.ndim() != 3 || pixels.shape(2) != 3 || !pixels.shape(0) || !pixels.shape(1))
            refuse_value("image", nb::none(), "must be height x width x 3");
        f.uv.assign(points.data(), points.data() + 6 * f.triangles);
        texture::level l{(int)pixels.shape(1), (int)pixels.shape(0), {}};
        l.at.resize(pixels.shape(0) * pixels.shape(1));
        float linear[256];
        for (int k = 0; k < 256; ++k) linear[k] = std::pow((float)k / 255, BRIGHT);
        for (size_t k = 0; k < l.at.size(); ++k) {
            const uint8_t *p = pixels.data() + 3 * k;
            l.at[k] = {linear[p[0]], linear[p[1]], linear[p[2]]};
        }
        f.image.levels.push_back(std::move(l));
        while (f.image.levels.back().width > 1 || f.image.levels.back().height > 1) {
            const texture::level &big = f.image.levels.back();
            texture::level half{std::max(big.width / 2, 1), std::max(big.height / 2, 1), {}};
            for (int y = 0; y < half.height; ++y)
                for (int x = 0; x < half.width; ++x) {
                    v3 sum{0, 0, 0};
                    for (int k = 0; k < 4; ++k) {
                        int i = std::min(2 * x + (k & 1), big.width - 1),
                            j = std::min(2 * y + (k >> 1), big.height - 1);
                        sum = sum + 0.25f * big.at[(size_t)j * (size_t)big.width + (size_t)i];
                    }
                    half.at.push_back(sum);
                }
            f.image.levels.push_back(std::move(half));
        }
    }
    f.body.assign(body.data(), body.data() + n);
    for (int32_t b : f.body)
        if (b < 0) refuse_value("body", nb::none(), "must be rows");
    f.position.assign(position.data(), position.data() + 3 * n);
    f.orientation.assign(orientation.data(), orientation.data() + 4 * n);
    f.scale.assign(scale.data(), scale.data() + 3 * n);
    f.colour.assign(colour.data(), colour.data() + 4 * n);
    for (size_t k = 0; k < f.corners; ++k) c.vertices.push_back(read3(vertices.data() + 3 * k));
    for (size_t k = 0; k < 3 * f.triangles; ++k) c.normals.push_back(read3(normals.data() + 3 * k));
    c.indices.insert(c.indices.end(), triangles.data(), triangles.data() + 3 * f.triangles);
    c.forms.push_back(std::move(f));
}

struct view {
    double centre[3]; // all of what follows is from here
    v3 eye, right, up, back, target;
    float focal, near, radius;
    v3 sun, sun_light, sky_light, ground_light, backdrop;
    int width, height, smooth, shadow, neighbours, threads;
};

void place(canvas &c, const double *positions, const double *orientations, size_t bodies,
           const std::vector<uint8_t> &hidden, const view &w)
{
    c.drawn.clear(), c.alpha.clear();
    std::vector<v3> at, normal;
    size_t instance_number = 0;
    for (size_t number = 0; number < c.forms.size(); ++number) {
        const form &f = c.forms[number];
        for (size_t k = 0; k < f.body.size(); ++k, ++instance_number) {
            float opaque = f.colour[4 * k + 3];
            if (hidden[instance_number] || opaque < 0.03f || (size_t)f.body[k] >= bodies) continue;
            size_t b = (size_t)f.body[k];
            turn3 outer = matrix(orientations + 4 * b), inner = matrix(&f.orientation[4 * k]), whole;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) {
                    double sum = 0;
                    for (int l = 0; l < 3; ++l) sum += outer.m[3 * i + l] * inner.m[3 * l + j];
                    whole.m[3 * i + j] = sum;
                }
            float m[9], n[9], p[3];
            for (int i = 0; i < 3; ++i) {
                double sum = positions[3 * b + (size_t)i] - w.centre[i];
                for (int l = 0; l < 3; ++l) sum += outer.m[3 * i + l] * f.position[3 * k + (size_t)l];
                p[i] = (float)sum;
                for (int j = 0; j < 3; ++j) {
                    m[3 * i + j] = (float)(whole.m[3 * i + j] * f.scale[3 * k + (size_t)j]);
                    n[3 * i + j] = (float)(whole.m[3 * i + j] / f.scale[3 * k + (size_t)j]);
                }
            }
            at.resize(f.corners);
            for (size_t i = 0; i < f.corners; ++i) {
                v3 x = c.vertices[f.first + i];
                at[i] = {m[0] * x.x + m[1] * x.y + m[2] * x.z + p[0], m[3] * x.x + m[4] * x.y + m[5] * x.z + p[1],
                         m[6] * x.x + m[7] * x.y + m[8] * x.z + p[2]};
            }
            uint8_t level = opaque >= 0.97f ? 16 : (uint8_t)std::max(1L, std::lround(16 * opaque));
            for (size_t t = 0; t < f.triangles; ++t) {
                const int32_t *i = &c.indices[3 * (f.triangle + t)];
                triangle d;
                d.form = (int32_t)number, d.instance = (int32_t)k;
                for (int j = 0; j < 3; ++j) {
                    v3 x = c.normals[3 * (f.triangle + t) + (size_t)j];
                    d.c[j].at = at[(size_t)i[j]];
                    d.c[j].normal = unit({n[0] * x.x + n[1] * x.y + n[2] * x.z, n[3] * x.x + n[4] * x.y + n[5] * x.z,
                                          n[6] * x.x + n[7] * x.y + n[8] * x.z});
                    d.c[j].u = f.textured ? f.uv[6 * t + 2 * (size_t)j] : 0;
                    d.c[j].v = f.textured ? f.uv[6 * t + 2 * (size_t)j + 1] : 0;
                }
                v3 area = cross(d.c[1].at - d.c[0].at, d.c[2].at - d.c[0].at);
                if (!(dot(area, area) > 0)) continue;
                d.flat = unit(area);
                c.drawn.push_back(d);
                c.alpha.push_back(level);
            }
        }
    }
}

// Triangles before the eye as the picture has them. Those that the near plane goes through are cut, and what is left of
// them is put at the end of `drawn`.
void project(canvas &c, const view &w)
{
    float wide = (float)(w.width * w.smooth), high = (float)(w.height * w.smooth);
    size_t count = c.drawn.size();
    auto away = [&](v3 x) { return -dot(x - w.eye, w.back); };
    for (size_t t = 0; t < count; ++t) {
        const triangle d = c.drawn[t];
        if (dot(d.flat, w.eye - d.c[0].at) <= 0) continue;
        float depth[3];
        int before = 0;
        for (int k = 0; k < 3; ++k) before += (depth[k] = away(d.c[k].at)) > w.near;
        if (before == 0 || before == 3) continue;
        corner cut[4];
        int n = 0;
        for (int k = 0; k < 3; ++k) {
            int l = (k + 1) % 3;
            if (depth[k] > w.near) cut[n++] = d.c[k];
            if ((depth[k] > w.near) != (depth[l] > w.near)) {
                float s = (depth[k] - w.near) / (depth[k] - depth[l]);
                const corner &a = d.c[k], &b = d.c[l];
                cut[n++] = {a.at + s * (b.at - a.at), unit(a.normal + s * (b.normal - a.normal)), a.u + s * (b.u - a.u),
                            a.v + s * (b.v - a.v)};
            }
        }
        for (int k = 1; k + 1 < n; ++k) {
            triangle part = d;
            part.c[0] = cut[0], part.c[1] = cut[k], part.c[2] = cut[k + 1];
            c.drawn.push_back(part);
            c.alpha.push_back(c.alpha[t]);
        }
    }
    c.flat.resize(c.drawn.size());
    c.common.resize(c.drawn.size());
    for (size_t t = 0; t < c.drawn.size(); ++t) {
        const triangle &d = c.drawn[t];
        flat_triangle &f = c.flat[t];
        f = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}; // nothing is seen of it
        float depth[3];
        bool out = dot(d.flat, w.eye - d.c[0].at) <= 0;
        for (int k = 0; k < 3; ++k) out |= (depth[k] = away(d.c[k].at)) < 0.999f * w.near;
        if (out) continue;
        for (int k = 0; k < 3; ++k) {
            v3 x = d.c[k].at - w.eye;
            f.x[k] = wide / 2 + w.focal * dot(x, w.right) / depth[k];
            f.y[k] = high / 2 - w.focal * dot(x, w.up) / depth[k];
            f.d[k] = 1 - w.near / depth[k];
        }
        v3 b = d.c[1].at - d.c[0].at, e = d.c[2].at - d.c[0].at, across = cross(b, e);
        float square = dot(across, across);
        shared &s = c.common[t];
        s.to_b = (1 / square) * cross(e, across), s.to_c = (1 / square) * cross(across, b);
        s.from_eye = dot(d.c[0].at - w.eye, d.flat);
        float uv = (d.c[1].u - d.c[0].u) * (d.c[2].v - d.c[0].v) - (d.c[2].u - d.c[0].u) * (d.c[1].v - d.c[0].v);
        s.texels = std::sqrt(std::fabs(uv) / std::sqrt(square));
        v3 one = d.c[1].normal - d.c[0].normal, two = d.c[2].normal - d.c[0].normal;
        s.even = dot(one, one) + dot(two, two) < 1e-8f;
    }
}

v3 power(v3 c, float p) { return {std::pow(c.x, p), std::pow(c.y, p), std::pow(c.z, p)}; }
v3 times(v3 a, v3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

void paint(canvas &c, const view &w, uint8_t *out)
{
    int wide = w.width * w.smooth, high = w.height * w.smooth, size = w.shadow;
    c.seen.width = wide, c.seen.height = high, c.sun.width = c.sun.height = size;
    c.seen.keeps = true, c.sun.keeps = false;
    // The sun's picture: what it sees, along its light.
    v3 side = unit(cross({0, 1, 0}, w.sun)), upward = cross(w.sun, side);
    float reach = 1.7f * w.radius, scale = (float)size / (2 * reach);
    size_t whole = c.drawn.size();
    c.above.resize(whole);
    for (size_t t = 0; t < whole; ++t)
        for (int k = 0; k < 3; ++k) {
            v3 x = c.drawn[t].c[k].at;
            c.above[t].x[k] = (float)size / 2 + scale * dot(x, side);
            c.above[t].y[k] = (float)size / 2 - scale * dot(x, upward);
            c.above[t].d[k] = -dot(x, w.sun);
        }
    rasterise(c.above, c.alpha, c.sun, w.threads);
    project(c, w);
    rasterise(c.flat, c.alpha, c.seen, w.threads);

    size_t samples = (size_t)wide * (size_t)high;
    shading &s = c.samples;
    for (std::vector<v3> *of : {&s.at, &s.normal, &s.colour, &s.direct}) of->resize(samples);
    s.fade.resize(samples), s.open.resize(samples);
    std::vector<v3> &direct = s.direct;
    std::vector<float> &fade = s.fade;
    std::vector<v3> linear; // of each instance, form by form
    std::vector<size_t> first;
    for (const form &f : c.forms) {
        first.push_back(linear.size());
        for (size_t k = 0; k < f.body.size(); ++k)
            linear.push_back(power({std::clamp(f.colour[4 * k], 0.f, 1.f), std::clamp(f.colour[4 * k + 1], 0.f, 1.f),
                                    std::clamp(f.colour[4 * k + 2], 0.f, 1.f)},
                                   BRIGHT));
    }
    each((size_t)((high + BAND - 1) / BAND), w.threads, [&](size_t band) {
        for (int row = (int)band * BAND; row < std::min(((int)band + 1) * BAND, high); ++row)
            for (int column = 0; column < wide; ++column) {
                size_t k = (size_t)row * (size_t)wide + (size_t)column;
                int32_t t = c.seen.which[k];
                if (t < 0) continue;
                const triangle &d = c.drawn[(size_t)t];
                const form &f = c.forms[(size_t)d.form];
                const shared &sh = c.common[(size_t)t];
                v3 ray = ((float)column + 0.5f - (float)wide / 2) / w.focal * w.right +
                         ((float)high / 2 - (float)row - 0.5f) / w.focal * w.up - w.back;
                float tilt = dot(ray, d.flat), away = sh.from_eye / tilt;
                v3 at = w.eye + away * ray, along = at - d.c[0].at;
                if (f.ground) {
                    float far = std::sqrt(at.x * at.x + at.y * at.y) / w.radius;
                    fade[k] = std::clamp((far - 1.8f) / 5, 0.f, 1.f);
                    fade[k] = std::sqrt(fade[k] * std::sqrt(fade[k]));
                    if (fade[k] >= 1) { // nothing of it is left
                        c.seen.which[k] = -1;
                        continue;
                    }
                } else fade[k] = 0;
                float sb = std::clamp(dot(along, sh.to_b), 0.f, 1.f), sc = std::clamp(dot(along, sh.to_c), 0.f, 1 - sb);
                float sa = 1 - sb - sc;
                v3 normal = d.c[0].normal;
                if (!sh.even) normal = unit(sa * d.c[0].normal + sb * d.c[1].normal + sc * d.c[2].normal);
                v3 base = linear[first[(size_t)d.form] + (size_t)d.instance];
                if (f.textured) {
                    float u = sa * d.c[0].u + sb * d.c[1].u + sc * d.c[2].u;
                    float v = sa * d.c[0].v + sb * d.c[1].v + sc * d.c[2].v;
                    const texture::level &l = f.image.levels[0];
                    float turned = std::max(std::fabs(tilt) / std::sqrt(dot(ray, ray)), 0.05f);
                    float sample = away / w.focal / std::sqrt(turned);
                    float texels = sh.texels * std::sqrt((float)l.width * (float)l.height);
                    base = times(base, f.image.sample(u, v, texels * sample));
                }
                // Is it in the sun? The corners' normals say where the round surface is that the triangle is a part of:
                // without that, its own flat sides would throw shadows on it.
                float facing = dot(normal, w.sun), lit = 0;
                if (facing > 0) {
                    v3 moved = at;
                    const float shares[3] = {sa, sb, sc};
                    for (int j = 0; j < 3 && !sh.even; ++j) {
                        float below = dot(at - d.c[j].at, d.c[j].normal);
                        if (below < 0) moved = moved - shares[j] * below * d.c[j].normal;
                    }
                    float slope = std::clamp(1 / std::max(facing, 0.1f), 1.f, 6.f);
                    moved = moved + (1.3f * slope / scale) * (dot(d.flat, w.sun) > 0.1f ? d.flat : normal);
                    float x = (float)size / 2 + scale * dot(moved, side),
                          y = (float)size / 2 - scale * dot(moved, upward);
                    float mine = -dot(moved, w.sun);
                    if (x < 2 || y < 2 || x > (float)size - 2 || y > (float)size - 2) lit = 1;
                    else { // of 4 x 4 texels around
                        const float *depth =
                            &c.sun.depth[(size_t)(int)(y - 1.5f) * (size_t)size + (size_t)(int)(x - 1.5f)];
                        float above = mine - 0.5f / scale;
                        int count = 0;
                        for (int j = 0; j < 4; ++j, depth += size)
                            for (int i = 0; i < 4; ++i) count += above <= depth[i];
                        lit = (float)count / 16;
                    }
                }
                s.at[k] = at, s.normal[k] = normal, s.colour[k] = base;
                direct[k] = std::max(facing, 0.f) * lit * w.sun_light;
            }
    });
    // Neighbours in the picture cover sky as they stand above the tangent plane, the less the farther away they are. A
    // spiral: as many near as far.
    float near = 0.14f * w.radius;
    v3 to = w.target - w.eye;
    float pixels = near * w.focal / std::sqrt(dot(to, to));
    std::vector<int> dx, dy;
    for (int k = 0; k < w.neighbours; ++k) {
        float far = std::max(pixels * std::pow((float)(k + 1) / (float)w.neighbours, 1.5f), 1.f);
        dx.push_back((int)std::lround(far * std::cos(2.4f * (float)k)));
        dy.push_back((int)std::lround(far * std::sin(2.4f * (float)k)));
    }
    // The share of the sky that is left at a sample. Of four samples side by side that are of one surface it is that of
    // the first, which each thread has done before.
    auto openness = [&](size_t k, int row, int column) {
        v3 at = s.at[k], normal = s.normal[k];
        float total = 0;
        for (int n = 0; n < w.neighbours && fade[k] < 0.9f; ++n) {
            int i = column + dx[(size_t)n], l = row + dy[(size_t)n];
            if (i < 0 || l < 0 || i >= wide || l >= high) continue;
            size_t other = (size_t)l * (size_t)wide + (size_t)i;
            if (c.seen.which[other] < 0) continue;
            v3 toward = s.at[other] - at;
            float height = dot(toward, normal);
            if (height <= 0) continue;
            float square = dot(toward, toward) + 1e-6f * near * near;
            if (square >= near * near) continue;
            float above = height / std::sqrt(square) - 0.1f;
            if (above > 0) total += above * (1 - square / (near * near));
        }
        return w.neighbours ? std::clamp(1 - 2.6f * total / (float)w.neighbours, 0.2f, 1.f) : 1.f;
    };
    static const auto curve = [] {
        std::vector<uint8_t> table(4097);
        for (size_t k = 0; k < table.size(); ++k)
            table[k] = (uint8_t)std::lround(255 * std::pow((float)k / 4096, 1 / BRIGHT));
        return table;
    }();
    each((size_t)((w.height + BAND - 1) / BAND), w.threads, [&](size_t band) {
        for (int y = (int)band * BAND; y < std::min(((int)band + 1) * BAND, w.height); ++y)
            for (int x = 0; x < w.width; ++x) {
                v3 sum{0, 0, 0};
                for (int j = 0; j < w.smooth; ++j)
                    for (int i = 0; i < w.smooth; ++i) {
                        int row = y * w.smooth + j, column = x * w.smooth + i;
                        size_t k = (size_t)row * (size_t)wide + (size_t)column;
                        v3 colour = w.backdrop;
                        if (c.seen.which[k] >= 0) {
                            v3 at = s.at[k], normal = s.normal[k];
                            size_t beside = (size_t)(row & ~1) * (size_t)wide + (size_t)(column & ~1);
                            v3 away = s.at[beside] - at;
                            bool same = beside != k && c.seen.which[beside] >= 0 &&
                                        dot(s.normal[beside], normal) > 0.95f && dot(away, away) < 0.01f * near * near;
                            float open = same ? s.open[beside] : openness(k, row, column);
                            s.open[k] = open;
                            float sky = 0.5f + 0.5f * normal.z;
                            v3 light = direct[k] + open * (sky * w.sky_light + (1 - sky) * w.ground_light);
                            colour = times(s.colour[k], light);
                            colour = colour + fade[k] * (w.backdrop - colour);
                        }
                        sum = sum + colour;
                    }
                float share = 4096 / (float)(w.smooth * w.smooth);
                uint8_t *p = out + 3 * ((size_t)y * (size_t)w.width + (size_t)x);
                p[0] = curve[(size_t)(int)std::clamp(sum.x * share + 0.5f, 0.f, 4096.f)];
                p[1] = curve[(size_t)(int)std::clamp(sum.y * share + 0.5f, 0.f, 4096.f)];
                p[2] = curve[(size_t)(int)std::clamp(sum.z * share + 0.5f, 0.f, 4096.f)];
            }
    });
}

v3 read_v3(const vec3 &x) { return {(float)x[0], (float)x[1], (float)x[2]}; }

nb::object draw(canvas &c, doubles positions, doubles orientations, bytes8 hidden, vec3 centre, vec3 eye, vec3 target,
                doubles axes, double focal, double near, double radius, vec3 sun, doubles light, int width, int height,
                int smooth, int shadow, int neighbours, int threads)
{
    want(positions, "positions", 3), want(orientations, "orientations", 4), want(axes, "axes", 3),
        want(light, "light", 3);
    size_t instances = 0;
    for (const form &f : c.forms) instances += f.body.size();
    if (hidden.shape(0) != instances || positions.shape(0) != orientations.shape(0) || axes.shape(0) != 3 ||
        light.shape(0) != 4)
        refuse_value("hidden", nb::none(), "must be as many as instances");
    if (width < 1 || height < 1 || smooth < 1 || shadow < 1 || neighbours < 0)
        refuse_value("width", nb::none(), "must be positive");
    view w;
    auto local = [&](const vec3 &x) {
        return v3{(float)(x[0] - centre[0]), (float)(x[1] - centre[1]), (float)(x[2] - centre[2])};
    };
    auto row = [](const doubles &a, size_t k) {
        const double *p = a.data() + 3 * k;
        return v3{(float)p[0], (float)p[1], (float)p[2]};
    };
    memcpy(w.centre, centre.data(), sizeof w.centre);
    w.eye = local(eye), w.target = local(target);
    w.right = row(axes, 0), w.up = row(axes, 1), w.back = row(axes, 2);
    w.focal = (float)focal, w.near = (float)near, w.radius = (float)radius, w.sun = read_v3(sun);
    w.sun_light = row(light, 0), w.sky_light = row(light, 1), w.ground_light = row(light, 2),
    w.backdrop = row(light, 3);
    w.width = width, w.height = height, w.smooth = smooth, w.shadow = shadow, w.neighbours = neighbours,
    w.threads = threads;
    std::vector<uint8_t> out_of_view(hidden.data(), hidden.data() + instances);
    uint8_t *out = new uint8_t[3 * (size_t)width * (size_t)height];
    nb::capsule owner(out, [](void *p) noexcept { delete[](uint8_t *) p; });
    {
        nb::gil_scoped_release released;
        std::lock_guard<std::mutex> one(c.guard);
        place(c, positions.data(), orientations.data(), positions.shape(0), out_of_view, w);
        paint(c, w, out);
    }
    return nb::cast(nb::ndarray<nb::numpy, uint8_t>(out, {(size_t)height, (size_t)width, 3}, owner));
}

} // namespace

void bind_draw(nb::module_ &m)
{
    nb::class_<canvas>(m, "_Canvas", "Meshes and their instances on bodies, to be drawn at any poses of the bodies.")
        .def(nb::init<>())
        .def("add", &add, "vertices"_a, "triangles"_a, "normals"_a, "body"_a, "position"_a, "orientation"_a, "scale"_a,
             "colour"_a, "ground"_a, "uv"_a.none(), "image"_a.none())
        .def("draw", &draw, "positions"_a, "orientations"_a, "hidden"_a, "centre"_a, "eye"_a, "target"_a, "axes"_a,
             "focal"_a, "near"_a, "radius"_a, "sun"_a, "light"_a, "width"_a, "height"_a, "smooth"_a, "shadow"_a,
             "neighbours"_a, "threads"_a);
}
