// libFuzzer target: the input's bytes are one stage's SPIR-V; linking it may fail but must not crash.
// The first byte picks the kind of stage and whether a good raygen stands beside it.
#include <cstdint>
#include <cstring>
#include <vector>

#include "pipeline.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 1) return 0;
    const uint8_t choice = data[0];
    rtc::StageInput stage;
    stage.kind = static_cast<rtc::StageKind>(choice % 6);
    stage.name = stage.file = "fuzz";
    stage.spirv.resize((size - 1) / 4);
    if (!stage.spirv.empty()) std::memcpy(stage.spirv.data(), data + 1, stage.spirv.size() * 4);

    rtc::GroupInput group;
    group.name = "fuzz";
    switch (stage.kind) {
        case rtc::StageKind::ClosestHit: group.kind = rtc::GroupKind::Triangles; group.closest_hit = 0; break;
        case rtc::StageKind::AnyHit: group.kind = rtc::GroupKind::Triangles; group.any_hit = 0; break;
        case rtc::StageKind::Intersection: group.kind = rtc::GroupKind::Procedural; group.intersection = 0; break;
        default: group.general = 0;
    }
    rtc::PipelineInput input;
    input.stages.push_back(std::move(stage));
    input.groups.push_back(group);
    rtc::LinkOptions options;
    options.max_recursion_depth = 1 + (choice / 6) % 4;
    options.validate = false;  // spirv-val is not what is tested here
    rtc::link_pipeline(input, options);
    return 0;
}
