// A reflection with something in every member, and a module to carry it.
#pragma once

#include <spirv-tools/libspirv.hpp>

#include "pipeline.h"
#include "rtc/abi.h"

inline rtc::Reflection sample_reflection() {
    rtc::Reflection r;
    r.stages = {{rtc::StageKind::RayGen, "camera", "shaders/a.rgen", 2, 3, 0, 16},
                {rtc::StageKind::Callable, "tint", "C:\\shaders\\t.rcall", 5, 1, 4, 0}};
    rtc::GroupReport general;
    general.name = "camera";
    general.handle[0] = 2;
    general.handle[3] = RTC_GROUP_GENERAL + 1;
    general.handle[7] = 0xdeadbeef;
    rtc::GroupReport hit;
    hit.kind = rtc::GroupKind::Procedural;
    hit.name = "ball \"quoted\" \xc3\xa4";
    for (uint32_t i = 0; i < RTC_HANDLE_WORDS; ++i) hit.handle[i] = 0xf0000000u + i;
    r.groups = {general, hit};
    r.resources = {{"scene", "camera", 0, 1, "acceleration-structure", 0}, {"", "tint", 3, 2, "sampler", 7}};
    r.spec_constants = {{"camera", "kScale", 1, 0, "float64", 0x3ff8000000000000ull},
                        {"tint", "kOn", 2, 1, "bool", 1}};
    r.trace_sites = {{"camera", "shaders/a.rgen", 12, false, 0, {}},
                     {"tint", "C:\\shaders\\t.rcall", 9, true, 24, {"color", "(temporary)"}}};
    r.required_features = {"shaderFloat64", "shaderInt64"};
    r.flags = RTC_MODULE_RESUMABLE;
    r.accuracy = rtc::Accuracy::Exact;
    r.identity = 0xdeadbeef;
    r.reserved_set = 4;
    r.reserved_binding = 10;
    r.used_bindings = 1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_SCRATCH;
    r.push_constant_bytes = 64;
    r.state_count = 6;
    r.max_recursion_depth = 3;
    r.max_callable_depth = 2;
    r.stack_words = 11;
    r.scratch_words = 12;
    r.payload_words = 13;
    r.attribute_words = 14;
    r.callable_words = 15;
    r.spirv_version = 0x10500;
    r.instruction_count = 1234;
    return r;
}

inline std::vector<uint32_t> sample_module() {
    std::vector<uint32_t> words;
    spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_3)
        .Assemble(R"(OpCapability Shader
                     OpMemoryModel Logical GLSL450
                     OpEntryPoint GLCompute %main "main"
                     OpExecutionMode %main LocalSize 1 1 1
                     %file = OpString "a.rgen"
                     OpSource GLSL 460 %file "void main() {}"
                     OpName %main "main"
                     %void = OpTypeVoid
                     %fn = OpTypeFunction %void
                     %main = OpFunction %void None %fn
                     %label = OpLabel
                     OpReturn
                     OpFunctionEnd)",
                  &words);
    return words;
}
