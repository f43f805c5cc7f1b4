#include "synthetic.h"

namespace rtc::bench {
namespace {

const std::string kHead =
    "#version 460\n"
    "#extension GL_NV_ray_tracing : require\n"
    "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n";

// 24 multiply-adds on four values, different in each shader so that no two merge.
std::string arithmetic(unsigned seed) {
    std::string text;
    const char* names[] = {"a", "b", "c", "d"};
    for (unsigned i = 0; i < 24; ++i) {
        seed = seed * 1664525u + 1013904223u;
        const std::string constant = std::to_string(1 + (seed >> 8) % 997) + ".0 / 512.0";
        text += std::string("    ") + names[i % 4] + " = " + names[i % 4] + " * " + names[(i + 1 + seed % 3) % 4] + " + " +
                constant + ";\n";
    }
    return text;
}

std::string closest_hit(unsigned index) {
    return kHead +
           "layout(location = 0) rayPayloadInNV vec4 incoming;\n"
           "layout(location = 1) rayPayloadNV vec4 outgoing;\n"
           "void main() {\n"
           "    float a = incoming.x, b = incoming.y, c = gl_HitTNV, d = float(gl_PrimitiveID);\n" +
           arithmetic(2 * index + 1) +
           "    outgoing = vec4(a, b, 0.0, 1.0);\n"
           "    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, gl_WorldRayOriginNV + c * gl_WorldRayDirectionNV, 0.001,\n"
           "            vec3(a, b, d), 1.0e4, 1);\n" +
           arithmetic(2 * index + 2) +
           "    incoming = vec4(a, b, c, d) + outgoing;\n"
           "}\n";
}

}  // namespace

SyntheticPipeline synthetic_pipeline(unsigned count) {
    SyntheticPipeline pipeline;
    pipeline.sources.push_back(
        {StageKind::RayGen, "camera.rgen",
         kHead +
             "layout(set = 0, binding = 1, std430) buffer Result { vec4 result[]; };\n"
             "layout(location = 0) rayPayloadNV vec4 payload;\n"
             "void main() {\n"
             "    payload = vec4(gl_LaunchIDNV, 1.0);\n"
             "    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(gl_LaunchIDNV), 0.0, vec3(0.0, 0.0, 1.0), 1.0e4, 0);\n"
             "    result[gl_LaunchIDNV.x] = payload;\n"
             "}\n"});
    pipeline.sources.push_back({StageKind::Miss, "sky.rmiss",
                                kHead +
                                    "layout(location = 0) rayPayloadInNV vec4 payload;\n"
                                    "void main() { payload += vec4(gl_WorldRayDirectionNV, 0.0); }\n"});
    for (unsigned i = 0; i < count; ++i)
        pipeline.sources.push_back({StageKind::ClosestHit, "hit" + std::to_string(i) + ".rchit", closest_hit(i)});
    return pipeline;
}

PipelineInput link_input(const std::vector<std::vector<uint32_t>>& modules) {
    PipelineInput input;
    for (size_t i = 0; i < modules.size(); ++i) {
        const int stage = static_cast<int>(i);
        GroupInput group;
        StageInput in;
        in.kind = i == 0 ? StageKind::RayGen : i == 1 ? StageKind::Miss : StageKind::ClosestHit;
        in.name = in.file = std::string(stage_kind_name(in.kind)) + std::to_string(i);
        in.spirv = modules[i];
        group.name = in.name;
        if (in.kind == StageKind::ClosestHit) {
            group.kind = GroupKind::Triangles;
            group.closest_hit = stage;
        } else {
            group.general = stage;
        }
        input.stages.push_back(std::move(in));
        input.groups.push_back(std::move(group));
    }
    return input;
}

}  // namespace rtc::bench
