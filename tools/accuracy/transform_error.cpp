#include "transform_error.h"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "cases.h"
#include "error.h"

namespace rtc::lab {
namespace {

using Matrix = std::array<std::array<mpq_class, 4>, 3>;

Matrix exact_inverse(const Transform& m) {
    std::array<std::array<mpq_class, 3>, 3> a;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) a[r][c] = m[r][c];
    Matrix w;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) {
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            w[r][c] = a[r1][c1] * a[r2][c2] - a[r1][c2] * a[r2][c1];
        }
    const mpq_class determinant = a[0][0] * w[0][0] + a[0][1] * w[1][0] + a[0][2] * w[2][0];
    if (determinant == 0) throw tools::Error("a singular transform has no inverse");
    for (auto& row : w) {
        row[3] = 0;
        for (int c = 0; c < 3; ++c) {
            row[c] /= determinant;
            row[3] -= row[c] * mpq_class(m[c][3]);
        }
    }
    return w;
}

struct Off {
    std::array<double, 3> absolute{}, steps{};
};

// `got` against the exact transform of v.
Off off_by(const Matrix& w, const Vec3& v, bool point, const Vec3& got) {
    Off off;
    for (int r = 0; r < 3; ++r) {
        mpq_class sum = point ? w[r][3] : mpq_class(0), size = abs(sum);
        for (int c = 0; c < 3; ++c) {
            const mpq_class term = w[r][c] * mpq_class(v[c]);
            sum += term;
            size += abs(term);
        }
        const mpq_class error = abs(mpq_class(got[r]) - sum);
        off.absolute[r] = error.get_d();
        off.steps[r] = size == 0 ? 0 : mpq_class(error / size).get_d() * 0x1p23;
    }
    return off;
}

Vec3 to_world(const Transform& m, const Vec3& p) {
    float out[3];
    for (int r = 0; r < 3; ++r)
        out[r] = float(double(m[r][0]) * p.x + double(m[r][1]) * p.y + double(m[r][2]) * p.z + m[r][3]);
    return {out[0], out[1], out[2]};
}

// The widening of leaf_instances.comp for a box of this reach on all axes.
std::array<double, 3> widening(const Transform& m, const Transform& w, double reach) {
    std::array<double, 3> size, back, pad;
    for (int r = 0; r < 3; ++r)
        size[r] = (std::fabs(m[r][0]) + std::fabs(m[r][1]) + std::fabs(m[r][2])) * reach + std::fabs(m[r][3]);
    for (int r = 0; r < 3; ++r)
        back[r] = std::fabs(w[r][0]) * size[0] + std::fabs(w[r][1]) * size[1] + std::fabs(w[r][2]) * size[2];
    for (int r = 0; r < 3; ++r)
        pad[r] = (8 * size[r] + 4 * (std::fabs(m[r][0]) * back[0] + std::fabs(m[r][1]) * back[1] +
                                     std::fabs(m[r][2]) * back[2])) * 0x1p-24;
    return pad;
}

}  // namespace

std::vector<TransformError> measure_transform_errors(PipelineTracer& tracer, unsigned points) {
    std::vector<TransformError> errors;
    std::mt19937_64 random(23);
    std::uniform_real_distribution<double> unit(-1, 1);
    auto any = [&](double by) { return Vec3{float(by * unit(random)), float(by * unit(random)), float(by * unit(random))}; };
    for (const auto& [name, m] : lab_transforms()) {
        Instance instance;
        instance.object_to_world = m;
        const Triangle corners = {Vec3{-1, -1, -1}, Vec3{1, 1, -1}, Vec3{-1, 1, 1}};  // its box reaches 1
        tracer.set_scene(build_scene({Blas{{{{corners}, {}, true}}}}, {instance}));
        const Transform w = tracer.world_to_object(0).value();
        const Matrix exact = exact_inverse(m);
        const std::array<double, 3> pad = widening(m, w, 1);
        TransformError e{name};
        for (unsigned i = 0; i < points; ++i) {
            // Origins round the object, directions of the world.
            const Vec3 origin = to_world(m, any(5)), direction = any(1), inside = to_world(m, any(1));
            for (const double steps : off_by(exact, origin, true, transform_point(w, origin)).steps)
                e.origin = std::max(e.origin, steps);
            for (const double steps : off_by(exact, direction, false, transform_vector(w, direction)).steps)
                e.direction = std::max(e.direction, steps);
            const Off off = off_by(exact, inside, true, transform_point(w, inside));
            for (int r = 0; r < 3; ++r) {
                const double moved = std::fabs(m[r][0]) * off.absolute[0] + std::fabs(m[r][1]) * off.absolute[1] +
                                     std::fabs(m[r][2]) * off.absolute[2];
                e.of_padding = std::max(e.of_padding, moved / pad[r]);
            }
        }
        errors.push_back(e);
    }
    return errors;
}

std::string transform_table(const std::vector<TransformError>& errors) {
    char line[200];
    std::snprintf(line, sizeof line,
                  "| transform | origin, ulps of \\|W\\|\\|p\\| + \\|w\\| | direction, ulps of \\|W\\|\\|d\\| | share of the box's "
                  "widening |\n|---|---|---|---|\n");
    std::string text = line;
    for (const TransformError& e : errors) {
        std::snprintf(line, sizeof line, "| %s | %.2f | %.2f | %.2f |\n", e.name.c_str(), e.origin, e.direction, e.of_padding);
        text += line;
    }
    std::snprintf(line, sizeof line, "| bound | 2.5 | 2 | 1 |\n");
    return text + line;
}

}  // namespace rtc::lab
