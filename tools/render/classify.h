// Why pixels of two ways of tracing differ: the first ray of a sample that found something else on one
// side is looked up in both records and judged by exact arithmetic.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "judge.h"
#include "scene.h"

namespace rtc::tools {

// One record of testdata/shaders/render/trace_log.glsl.
struct LoggedRay {
    float origin[3];
    uint32_t kind;  // 0 none, 1 closest hit, 2 shadow ray
    float direction[3];
    float end;
    uint32_t hit[4];  // closest: instance (~0: none), primitive, barycentrics' bits; shadow: 1 for open
};

// Bits of what happened in any sample of a pixel.
enum Parting : uint8_t { kPartedWrong = 1, kPartedTie = 2, kPartedRounding = 4, kPartedOtherRays = 8 };

struct Classification {
    uint64_t samples = 0;    // pixels times launches
    uint64_t rays = 0;       // that both sides traced
    uint64_t same_rays = 0;  // of which equal bit for bit
    uint64_t same_hits = 0;  // of which found the same
    // What came first in samples whose records part:
    uint64_t ties = 0;          // equal rays, and exact arithmetic puts both answers on a par
    uint64_t rounding = 0;      // equal rays, both answers within Judge::bound of the exact one
    uint64_t native_wrong = 0;  // equal rays or not: the answer is outside the bound for its own ray
    uint64_t ours_wrong = 0;
    uint64_t both_wrong = 0;
    uint64_t other_rays = 0;  // the rays already differed, each found what its own ray meets
    uint64_t decisions = 0;   // one side's shader traced a ray where the other's did not
    // Of `rounding`: whose answer was the exact one.
    uint64_t exact_is_native = 0, exact_is_ours = 0;
    // Where records' bits part first, of samples with other_rays or decisions: after equal hits
    // (the two compilations of the shaders rounded differently) or after barycentrics of the same hit that differ.
    uint64_t began_in_shading = 0, began_in_barycentrics = 0;
    // Primary rays.
    uint64_t primary_rays = 0, primary_hits_differ = 0;
    // How far apart the rays were, relative to the scene's size (origins) and as an angle: at their first
    // difference in bits, and at the first difference of what they found (largest of all samples).
    double first_origin = 0, first_angle = 0, parted_origin = 0, parted_angle = 0;
    // Barycentrics of the same triangle by equal rays, apart across the ray, in units of Judge::bound.
    double barycentrics_apart = 0;
    std::vector<std::string> examples;  // of wrong answers: the ray and who said what

    uint64_t parted() const {
        return ties + rounding + native_wrong + ours_wrong + both_wrong + other_rays + decisions;
    }
    void add(const Classification& other);
};

// `native` and `ours`: `places` records a pixel, of one launch. Adds to `pixels`, a byte of Parting bits each.
Classification classify(const Judge& judge, double scene_size, const std::vector<LoggedRay>& native,
                        const std::vector<LoggedRay>& ours, uint32_t places, std::vector<uint8_t>& pixels);

// The differing pixels of two pictures by the worst that happened in them.
struct DifferingPixels {
    uint64_t wrong = 0, ties = 0, rounding = 0, other_rays = 0;
    uint64_t shading = 0;          // all rays of all samples found the same
    double largest_shading = 0;    // relative difference of those
    uint64_t total() const { return wrong + ties + rounding + other_rays + shading; }
};
// `differences`: relative, one a pixel (Comparison); those up to `tolerance` do not count.
DifferingPixels sort_pixels(const std::vector<double>& differences, double tolerance,
                            const std::vector<uint8_t>& partings);

std::string as_text(const Classification& classification);
std::string as_json(const Classification& classification);
std::string as_text(const DifferingPixels& pixels);
std::string as_json(const DifferingPixels& pixels);

}  // namespace rtc::tools
