// Rays through a traversal module on a device.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "ray_tracer.h"
#include "vulkan_context.h"

namespace rtc::lab {

// The tiers; the negative control; points beside the tiers, all `watertight` but for one thing (scene_knobs.h,
// lab_nodes.glsl, lab_t64.glsl). Probe traces nothing: it asks for lanes and records (lab_probe.comp).
enum class Variant { Watertight, Fast, Exact, Exact64, Contracted, Box16, Box8, FloatInverse, T64, Probe };
Variant parse_variant(std::string_view name);  // throws tools::Error
const char* variant_name(Variant variant);

struct TracerOptions {
    Variant variant = Variant::Watertight;
    bool storage_fetch = false;
    bool while_while = false;
    uint32_t shared_stack = 0;
    uint32_t step_budget = 0xffffffffu;
    // Lanes that use up their budget end and go on in another dispatch, as a resumable pipeline's do.
    bool pause = false;
    bool any_hit = true, aabbs = true, triangles = true, resumable = true;
};

class DeviceTracer final : public RayTracer {
  public:
    DeviceTracer(const tools::Context& context, const TracerOptions& options);
    ~DeviceTracer() override;

    // Float64: for the negative control, exact64 and t64.
    static bool needs_float64(Variant variant) {
        return variant == Variant::Contracted || variant == Variant::Exact64 || variant == Variant::T64;
    }

    void set_scene(const HostScene& scene) override;
    std::vector<RayResult> trace(const std::vector<Ray>& rays) override;
    uint64_t scene_bytes() const override;

    // Variant::Probe: a dispatch of `groups_x` by `groups_y` with these parameter and SBT words.
    // `indices` has one entry a lane; results are 16 words a lane.
    std::vector<uint32_t> probe(const std::vector<uint32_t>& params, const std::vector<uint32_t>& sbt,
                                const std::vector<uint32_t>& indices, uint32_t groups_x, uint32_t groups_y);
    std::vector<uint32_t> control() const;  // control block words of the last dispatch

    uint32_t error = 0;  // launch error of the last trace
    uint32_t error_count = 0;
    uint32_t error_detail = 0;

  private:
    void dispatch(const std::vector<uint32_t>& params, const void* input, size_t input_bytes, uint32_t lanes,
                  uint32_t groups_x, uint32_t groups_y);
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace rtc::lab
