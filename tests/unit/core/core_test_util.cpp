#include "core_test_util.h"

#include <gtest/gtest.h>

#include "spirv-tools/libspirv.hpp"

namespace rtc::test {

std::vector<uint32_t> assemble(const std::string& text, unsigned minor_version) {
    const spv_target_env env = minor_version >= 6   ? SPV_ENV_UNIVERSAL_1_6
                               : minor_version == 5 ? SPV_ENV_UNIVERSAL_1_5
                               : minor_version == 4 ? SPV_ENV_UNIVERSAL_1_4
                                                    : SPV_ENV_UNIVERSAL_1_3;
    spvtools::SpirvTools tools(env);
    std::string message;
    tools.SetMessageConsumer([&](spv_message_level_t, const char*, const spv_position_t& at, const char* what) {
        message += std::to_string(at.line + 1) + ": " + what + "\n";
    });
    std::vector<uint32_t> words;
    if (!tools.Assemble(text, &words)) {
        ADD_FAILURE() << "the test's own assembly is wrong:\n" << message << text;
        words.clear();
    }
    return words;
}

PipelineInput pipeline(const std::vector<Stage>& stages) {
    PipelineInput input;
    for (const Stage& stage : stages) {
        const int index = static_cast<int>(input.stages.size());
        StageInput in;
        in.kind = stage.kind;
        in.name = std::string(stage_kind_name(stage.kind)) + std::to_string(index);
        in.file = in.name + ".spv";
        in.spirv = stage.spirv;
        in.entry = stage.entry;
        in.specialization = stage.specialization;
        GroupInput group;
        group.name = in.name;
        switch (stage.kind) {
            case StageKind::ClosestHit:
                group.kind = GroupKind::Triangles;
                group.closest_hit = index;
                break;
            case StageKind::AnyHit:
                group.kind = GroupKind::Triangles;
                group.any_hit = index;
                break;
            case StageKind::Intersection:
                group.kind = GroupKind::Procedural;
                group.intersection = index;
                break;
            default: group.general = index;
        }
        input.stages.push_back(std::move(in));
        input.groups.push_back(std::move(group));
    }
    return input;
}

LinkResult link(const std::vector<Stage>& stages, LinkOptions options) {
    return link_pipeline(pipeline(stages), options);
}

std::string describe(const LinkResult& result) {
    std::string text = result.ok ? "linked\n" : "not linked\n";
    for (const Diagnostic& d : result.diagnostics)
        text += std::string(d.severity == Severity::Error ? "error " : "warning ") + d.id + ": " + d.file + ":" +
                std::to_string(d.line) + ": " + d.text + "\n";
    return text;
}

bool has_diagnostic(const LinkResult& result, const std::string& id, Severity severity) {
    for (const Diagnostic& d : result.diagnostics)
        if (d.id == id && d.severity == severity) return true;
    return false;
}

void expect_clear_error(const LinkResult& result, const std::string& what) {
    EXPECT_FALSE(result.ok) << what << " was accepted";
    bool named = false;
    for (const Diagnostic& d : result.diagnostics)
        if (d.severity == Severity::Error && !d.id.empty() && !d.text.empty()) named = true;
    EXPECT_TRUE(named || result.ok) << what << " failed without a message";
    for (const Diagnostic& d : result.diagnostics)
        EXPECT_NE(d.id.rfind("internal", 0), 0u) << what << " was not recognised:\n" << describe(result);
}

const char* const kPayload =
    "%ptr_payload = OpTypePointer RayPayloadNV %float\n%payload = OpVariable %ptr_payload RayPayloadNV\n";
const char* const kPayloadLocation = "OpDecorate %payload Location 0\n";
const char* const kTrace =
    "%s = OpLoad %as %scene\n"
    "OpTraceNV %s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_0\n";

std::string trace_text(const std::string& flags, const std::string& mask, const std::string& offset,
                       const std::string& miss, const std::string& payload) {
    return "%s = OpLoad %as %scene\nOpTraceNV %s " + flags + " " + mask + " " + offset + " %uint_0 " + miss +
           " %zero3 %float_0 %up3 %float_1 " + payload + "\n";
}

std::string stage_text(const StageText& parts) {
    return "OpCapability RayTracingNV\n" + parts.preamble + R"(OpExtension "SPV_NV_ray_tracing"
OpMemoryModel Logical GLSL450
OpEntryPoint )" + parts.model + R"( %main "main" )" + parts.interface + R"(
OpDecorate %scene DescriptorSet 0
OpDecorate %scene Binding 0
)" + parts.annotations + R"(
%void = OpTypeVoid
%fn = OpTypeFunction %void
%bool = OpTypeBool
%float = OpTypeFloat 32
%uint = OpTypeInt 32 0
%int = OpTypeInt 32 1
%v3float = OpTypeVector %float 3
%float_0 = OpConstant %float 0
%float_1 = OpConstant %float 1
%uint_0 = OpConstant %uint 0
%uint_255 = OpConstant %uint 255
%zero3 = OpConstantComposite %v3float %float_0 %float_0 %float_0
%up3 = OpConstantComposite %v3float %float_0 %float_1 %float_0
%as = OpTypeAccelerationStructureNV
%ptr_as = OpTypePointer UniformConstant %as
%scene = OpVariable %ptr_as UniformConstant
)" + parts.globals + R"(
%main = OpFunction %void None %fn
%entry = OpLabel
)" + parts.body + R"(
OpReturn
OpFunctionEnd
)" + parts.functions;
}

std::string raygen_text(const std::string& globals, const std::string& body, const std::string& annotations,
                        const std::string& functions) {
    StageText parts;
    parts.globals = globals;
    parts.body = body;
    parts.annotations = annotations;
    parts.functions = functions;
    return stage_text(parts);
}

}  // namespace rtc::test
