// libFuzzer target of the linker: the input's bytes are one stage's SPIR-V; linking it may fail with a message, but
// not crash, hang, report an internal error or give an invalid module. The first byte picks the kind of stage and the
// options. A stage that is no ray generation shader stands beside a good one, which traces and executes a callable.
#include <spirv-tools/libspirv.hpp>

#include <cstdio>
#include <cstdlib>

#include "fuzz_words.h"
#include "pipeline.h"

namespace {

const char kRayGen[] = R"(
OpCapability Shader
OpCapability RayTracingNV
OpExtension "SPV_NV_ray_tracing"
OpMemoryModel Logical GLSL450
OpEntryPoint RayGenerationNV %main "main"
OpDecorate %payload Location 0
OpDecorate %data Location 1
OpDecorate %scene DescriptorSet 7
OpDecorate %scene Binding 0
%void = OpTypeVoid
%main_type = OpTypeFunction %void
%uint = OpTypeInt 32 0
%float = OpTypeFloat 32
%vec3 = OpTypeVector %float 3
%vec4 = OpTypeVector %float 4
%payload_pointer = OpTypePointer RayPayloadNV %vec4
%payload = OpVariable %payload_pointer RayPayloadNV
%data_pointer = OpTypePointer CallableDataNV %vec4
%data = OpVariable %data_pointer CallableDataNV
%as = OpTypeAccelerationStructureNV
%as_pointer = OpTypePointer UniformConstant %as
%scene = OpVariable %as_pointer UniformConstant
%u0 = OpConstant %uint 0
%u1 = OpConstant %uint 1
%mask = OpConstant %uint 255
%tmin = OpConstant %float 0
%tmax = OpConstant %float 100
%origin = OpConstantComposite %vec3 %tmin %tmin %tmin
%main = OpFunction %void None %main_type
%entry = OpLabel
%a = OpLoad %as %scene
OpTraceNV %a %u0 %mask %u0 %u0 %u0 %origin %tmin %origin %tmax %u0
%result = OpLoad %vec4 %payload
OpStore %data %result
OpExecuteCallableNV %u1 %u1
OpReturn
OpFunctionEnd
)";

const std::vector<uint32_t>& good_raygen() {
    static const std::vector<uint32_t> words = [] {
        std::vector<uint32_t> made;
        const spvtools::SpirvTools tools(SPV_ENV_UNIVERSAL_1_3);
        if (!tools.Assemble(kRayGen, &made)) std::abort();
        return made;
    }();
    return words;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size < 1) return 0;
    const uint8_t choice = data[0];
    rtc::PipelineInput input;
    rtc::StageInput stage;
    stage.kind = static_cast<rtc::StageKind>(choice % 6);
    stage.name = stage.file = "fuzz";
    stage.spirv = rtc::fuzz::words_of(data, size);
    rtc::GroupInput group;
    group.name = "fuzz";
    switch (stage.kind) {
        case rtc::StageKind::ClosestHit: group.kind = rtc::GroupKind::Triangles; group.closest_hit = 0; break;
        case rtc::StageKind::AnyHit: group.kind = rtc::GroupKind::Triangles; group.any_hit = 0; break;
        case rtc::StageKind::Intersection: group.kind = rtc::GroupKind::Procedural; group.intersection = 0; break;
        default: group.general = 0;
    }
    const bool alone = stage.kind == rtc::StageKind::RayGen;
    input.stages.push_back(std::move(stage));
    input.groups.push_back(group);
    if (!alone) {
        rtc::StageInput raygen;
        raygen.name = raygen.file = "raygen";
        raygen.spirv = good_raygen();
        input.stages.push_back(std::move(raygen));
        input.groups.push_back({rtc::GroupKind::General, "raygen", 1, -1, -1, -1});
    }
    const unsigned options_choice = choice / 6;  // 0 to 42
    rtc::LinkOptions options;
    options.max_recursion_depth = 1 + options_choice % 4;
    options.resumable = options_choice / 4 % 2;
    options.debug_info = options_choice / 8 % 2;
    options.addressing = options_choice / 16 % 2 ? rtc::Addressing::Address : rtc::Addressing::Heap;
    const rtc::LinkResult result = rtc::link_pipeline(input, options);
    for (const rtc::Diagnostic& diagnostic : result.diagnostics) {
        if (diagnostic.id != "internal-error" && diagnostic.id != "internal-invalid-module") continue;
        std::fprintf(stderr, "%s: %s\n", diagnostic.id.c_str(), diagnostic.text.c_str());
        std::abort();
    }
    return 0;
}
