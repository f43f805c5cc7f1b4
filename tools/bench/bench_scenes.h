// The benchmark's scenes: rtc-render's, and some made for measuring only.
#pragma once

#include <string>
#include <vector>

#include "scene.h"

namespace rtc::bench {

// A scene of bench_scene_names(), one of rtc-render's built-in ones, or a file. `scale` multiplies the number of
// primitives of the scenes made here. Deterministic. Throws tools::Error naming what there is.
tools::Scene bench_scene(const std::string& name, double scale = 1.0);

// Scenes made here: "blob", "soup", "strands", "instances".
std::vector<std::string> bench_scene_names();

// Meshes of about `triangles` triangles for the build benchmark.
tools::Mesh make_blob(size_t triangles);
tools::Mesh make_soup(size_t triangles);
tools::Mesh make_strands(size_t triangles);

}  // namespace rtc::bench
