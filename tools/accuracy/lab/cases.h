// Scenes and rays that sweep one property each from the ordinary to the
// extreme: what tier `exact` is compared on, against exact arithmetic. Meshes
// need not be closed here (leaks.h wants closed ones).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "device_tracer.h"
#include "host_scene.h"

namespace rtc::lab {

struct ExactCase {
    std::string axis, value;
    std::vector<Blas> blases;
    std::vector<Instance> instances;
    // Rays `first` to `first + count` of this case: the same whatever the batches.
    std::function<std::vector<Ray>(uint64_t first, uint64_t count)> rays;
    BuildOptions build;
};

// `ordinary` is no part of these: it is for what most rays are.
// offset, size, aspect, distance, speed, zeros, grazing, aim, interval, transform, degenerate, build, mixed.
const std::vector<std::string>& exact_axis_names();
std::vector<ExactCase> exact_cases(const std::string& axis);  // throws tools::Error: no such axis

Transform rotation(double a, double b);
Transform translated(Transform m, float x, float y, float z);
Transform product(const Transform& a, const Transform& b);
Transform scaled(float x, float y, float z);
const std::vector<std::pair<std::string, Transform>>& lab_transforms();

}  // namespace rtc::lab
