// One input per diagnostic of the core: it gives this id and a text, and, for an error, no module.
// tests/unit/core/diagnostics_listed.py checks that no id is missing here and in docs/troubleshooting.md.
#include <gtest/gtest.h>

#include "core_test_util.h"
#include "ir/module.h"
#include "rtc/abi.h"

namespace rtc::test {
namespace {

std::vector<uint32_t> module_of(const StageText& parts, unsigned minor_version = 3) {
    return assemble(stage_text(parts), minor_version);
}

StageText raygen(const std::string& globals, const std::string& body, const std::string& annotations = "",
                 const std::string& functions = "") {
    StageText parts;
    parts.globals = globals;
    parts.body = body;
    parts.annotations = annotations;
    parts.functions = functions;
    return parts;
}

StageText stage(const char* model, const std::string& globals = "", const std::string& body = "",
                const std::string& annotations = "") {
    StageText parts = raygen(globals, body, annotations);
    parts.model = model;
    return parts;
}

StageText tracing_raygen() { return raygen(kPayload, kTrace, kPayloadLocation); }

void expect_error(const LinkResult& result, const std::string& id) {
    EXPECT_FALSE(result.ok) << "accepted; expected " << id;
    EXPECT_TRUE(has_diagnostic(result, id)) << "expected " << id << "; got: " << describe(result);
    EXPECT_TRUE(result.spirv.empty());
}

void expect_error(const StageText& raygen_parts, const std::string& id) {
    expect_error(link({{StageKind::RayGen, module_of(raygen_parts)}}), id);
}

// What spirv-val refuses today, so that only rtc without validation gets to say it.
void expect_error_behind_validation(const StageText& raygen_parts, const std::string& id) {
    const std::vector<Stage> stages{{StageKind::RayGen, module_of(raygen_parts)}};
    expect_error(link(stages), "spirv-invalid");
    LinkOptions options;
    options.validate = false;
    const LinkResult result = link(stages, options);
    if (!has_diagnostic(result, "spirv-invalid")) expect_error(result, id);
}

// Of a second stage beside a ray generation stage.
void expect_error(StageKind kind, const StageText& parts, const std::string& id) {
    expect_error(link({{StageKind::RayGen, module_of(raygen("", ""))}, {kind, module_of(parts)}}), id);
}

void expect_warning(const StageText& raygen_parts, const std::string& id) {
    const LinkResult result =
        link({{StageKind::RayGen, module_of(raygen_parts)}, {StageKind::Miss, module_of(stage("MissNV"))}});
    EXPECT_TRUE(result.ok) << describe(result);
    EXPECT_TRUE(has_diagnostic(result, id, Severity::Warning)) << "expected " << id << "; got: " << describe(result);
}

TEST(Diagnostics, TheTestsOwnStagesLink) {
    const LinkResult result =
        link({{StageKind::RayGen, module_of(tracing_raygen())}, {StageKind::Miss, module_of(stage("MissNV"))}});
    EXPECT_TRUE(result.ok) << describe(result);
    EXPECT_TRUE(result.diagnostics.empty()) << describe(result);
}

// ---- traces ----

TEST(Diagnostics, TraceLocations) {
    const auto trace = [](const char* payload) { return trace_text("%uint_0", "%uint_255", "%uint_0", "%uint_0", payload); };
    expect_error(raygen(kPayload, trace("%uint_255"), kPayloadLocation), "trace-location-unknown");
    expect_error(raygen(kPayload, "%number = OpIAdd %uint %uint_0 %uint_0\n" + trace("%number"), kPayloadLocation),
                 "trace-location-not-constant");
}

TEST(Diagnostics, TraceOperands) {
    expect_error(raygen(kPayload, trace_text("%float_0", "%uint_255", "%uint_0", "%uint_0", "%uint_0"), kPayloadLocation),
                 "call-operand");
}

TEST(Diagnostics, InstructionsOfOtherStages) {
    expect_error(StageKind::AnyHit, stage("AnyHitNV", kPayload, kTrace, kPayloadLocation), "call-stage");
    expect_error(raygen("", "OpIgnoreIntersectionNV\n"), "call-stage");
}

TEST(Diagnostics, VariablesOfOtherStages) {
    expect_error_behind_validation(
        raygen("%pi = OpTypePointer HitAttributeNV %float\n%attribute = OpVariable %pi HitAttributeNV\n",
               "%v = OpLoad %float %attribute\n"),
        "storage-stage");
}

TEST(Diagnostics, TracesThatCannotHit) {
    const auto trace = [](const char* flags, const char* mask, const char* offset, const char* miss) {
        return raygen(std::string(kPayload) + "%uint_3 = OpConstant %uint 3\n%uint_9 = OpConstant %uint 9\n",
                      trace_text(flags, mask, offset, miss, "%uint_0"), kPayloadLocation);
    };
    expect_warning(trace("%uint_0", "%uint_0", "%uint_0", "%uint_0"), "cull-mask-zero");
    expect_warning(trace("%uint_3", "%uint_255", "%uint_0", "%uint_0"), "ray-flags-contradict");
    expect_warning(trace("%uint_0", "%uint_255", "%uint_0", "%uint_9"), "miss-index-range");
    expect_warning(trace("%uint_0", "%uint_255", "%uint_9", "%uint_0"), "sbt-offset-range");
}

TEST(Diagnostics, PayloadTypes) {
    const LinkResult result = link({{StageKind::RayGen, module_of(tracing_raygen())},
                                    {StageKind::Miss, module_of(stage("MissNV",
                                                                      "%pi = OpTypePointer IncomingRayPayloadNV %v3float\n"
                                                                      "%p = OpVariable %pi IncomingRayPayloadNV\n",
                                                                      "OpStore %p %zero3\n"))}});
    EXPECT_TRUE(result.ok) << describe(result);
    EXPECT_TRUE(has_diagnostic(result, "payload-mismatch", Severity::Warning)) << describe(result);
}

// ---- what ray tracing shaders cannot have, or rtc not yet ----

StageText reading_input(const std::string& decoration) {
    StageText parts = raygen("%pi = OpTypePointer Input %float\n%input = OpVariable %pi Input\n",
                             "%v = OpLoad %float %input\n", "OpDecorate %input " + decoration + "\n");
    parts.interface = "%input";
    return parts;
}

TEST(Diagnostics, OutsideRayTracing) {
    expect_error_behind_validation(raygen("%pw = OpTypePointer Workgroup %float\n%shared = OpVariable %pw Workgroup\n",
                                          "OpStore %shared %float_0\n"),
                                   "shared-memory");
    expect_error_behind_validation(
        raygen("%uint_2 = OpConstant %uint 2\n", "OpControlBarrier %uint_2 %uint_2 %uint_0\n"), "barrier");
    expect_error_behind_validation(
        raygen("%true = OpConstantTrue %bool\n",
               "OpSelectionMerge %m None\nOpBranchConditional %true %k %m\n%k = OpLabel\nOpKill\n%m = OpLabel\n"),
        "kill");
    expect_error(reading_input("Location 0"), "input-without-builtin");
}

TEST(Diagnostics, NotYet) {
    StageText motion = raygen(kPayload,
                              "%s = OpLoad %as %scene\n"
                              "OpTraceMotionNV %s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 "
                              "%float_0 %uint_0\n",
                              kPayloadLocation);
    motion.preamble = "OpCapability RayTracingMotionBlurNV\nOpExtension \"SPV_NV_ray_tracing_motion_blur\"\n";
    expect_error(motion, "motion-unsupported");

    const char* const khr =
        "OpCapability RayTracingKHR\n%s\nOpExtension \"SPV_KHR_ray_tracing\"\n%s\nOpMemoryModel Logical GLSL450\n"
        "OpEntryPoint RayGenerationKHR %%main \"main\"%s\n%%void = OpTypeVoid\n%%fn = OpTypeFunction %%void\n"
        "%%uint = OpTypeInt 32 0\n%%uint_0 = OpConstant %%uint 0\n%%v2 = OpTypeVector %%uint 2\n"
        "%%pair = OpConstantComposite %%v2 %%uint_0 %%uint_0\n%%as = OpTypeAccelerationStructureKHR\n%s\n"
        "%%main = OpFunction %%void None %%fn\n%%l = OpLabel\n%s\nOpReturn\nOpFunctionEnd\n";
    char text[2048];
    std::snprintf(text, sizeof text, khr, "", "", "", "", "%s = OpConvertUToAccelerationStructureKHR %as %pair");
    expect_error(link({{StageKind::RayGen, assemble(text, 4)}}), "as-from-address");
    std::snprintf(text, sizeof text, khr, "OpCapability RayQueryKHR", "OpExtension \"SPV_KHR_ray_query\"", "",
                  "%rq = OpTypeRayQueryKHR\n%prq = OpTypePointer Function %rq\n%bool = OpTypeBool\n",
                  "%query = OpVariable %prq Function\n%p = OpRayQueryProceedKHR %bool %query");
    expect_error(link({{StageKind::RayGen, assemble(text, 4)}}), "ray-query-unsupported");
}

TEST(Diagnostics, BuiltIns) {
    expect_error_behind_validation(reading_input("BuiltIn RayTmaxNV"), "builtin-stage");
    expect_error_behind_validation(reading_input("BuiltIn FragDepth"), "builtin-unsupported");
}

// ---- payloads, attributes, records ----

TEST(Diagnostics, SeveralWhereOneIsAllowed) {
    expect_error(StageKind::Miss,
                 stage("MissNV",
                       "%pi = OpTypePointer IncomingRayPayloadNV %float\n%a = OpVariable %pi IncomingRayPayloadNV\n"
                       "%b = OpVariable %pi IncomingRayPayloadNV\n",
                       "OpStore %a %float_0\nOpStore %b %float_0\n"),
                 "several-incoming");
    expect_error(raygen("%block = OpTypeStruct %float\n%pr = OpTypePointer ShaderRecordBufferNV %block\n"
                        "%pf = OpTypePointer ShaderRecordBufferNV %float\n"
                        "%a = OpVariable %pr ShaderRecordBufferNV\n%b = OpVariable %pr ShaderRecordBufferNV\n",
                        "%x = OpAccessChain %pf %a %uint_0\n%v = OpLoad %float %x\n"
                        "%y = OpAccessChain %pf %b %uint_0\n%w = OpLoad %float %y\n",
                        "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset 0\n"),
                 "several-records");
}

TEST(Diagnostics, RecordsAreReadOnly) {
    expect_error_behind_validation(
        raygen("%block = OpTypeStruct %float\n%pr = OpTypePointer ShaderRecordBufferNV %block\n"
               "%pf = OpTypePointer ShaderRecordBufferNV %float\n%a = OpVariable %pr ShaderRecordBufferNV\n",
               "%x = OpAccessChain %pf %a %uint_0\nOpStore %x %float_0\n",
               "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset 0\n"),
        "record-access");
}

TEST(Diagnostics, Sizes) {
    const auto payload_of = [](const std::string& type) {
        return raygen(type + "%pt = OpTypePointer RayPayloadNV %t\n%payload = OpVariable %pt RayPayloadNV\n", kTrace,
                      kPayloadLocation);
    };
    expect_error(payload_of("%n = OpConstant %uint 100000\n%t = OpTypeArray %float %n\n"), "value-too-large");
    expect_error(payload_of("%t = OpTypeStruct %as\n"), "value-not-storable");
    StageText sized = payload_of("%n = OpSpecConstant %uint 4\n%t = OpTypeArray %float %n\n");
    sized.annotations += "OpDecorate %n SpecId 3\n";
    expect_error(sized, "spec-sized-array");
    expect_error(StageKind::ClosestHit,
                 stage("ClosestHitNV",
                       "%uint_9 = OpConstant %uint 9\n%t = OpTypeArray %float %uint_9\n"
                       "%pt = OpTypePointer HitAttributeNV %t\n%attribute = OpVariable %pt HitAttributeNV\n",
                       "%v = OpLoad %t %attribute\n"),
                 "attribute-too-large");
}

// Each function calls the one before twice, and the first traces: 2^17 traces once inlined.
TEST(Diagnostics, InliningIsBounded) {
    std::string functions = "%f0 = OpFunction %void None %fn\n%l0 = OpLabel\n" + std::string(kTrace) + "OpReturn\nOpFunctionEnd\n";
    for (int i = 1; i <= 17; ++i) {
        const std::string n = std::to_string(i), before = std::to_string(i - 1);
        functions += "%f" + n + " = OpFunction %void None %fn\n%l" + n + " = OpLabel\n%a" + n +
                     " = OpFunctionCall %void %f" + before + "\n%b" + n + " = OpFunctionCall %void %f" + before +
                     "\nOpReturn\nOpFunctionEnd\n";
    }
    expect_error(raygen(kPayload, "%call = OpFunctionCall %void %f17\n", kPayloadLocation, functions), "inline-too-large");
}

TEST(Diagnostics, FunctionRecursion) {
    expect_error_behind_validation(raygen("", "%v = OpFunctionCall %void %f\n", "",
                                          "%f = OpFunction %void None %fn\n%fl = OpLabel\n%fv = OpFunctionCall %void %f\n"
                                          "OpReturn\nOpFunctionEnd\n"),
                                   "function-recursion");
    expect_error_behind_validation(raygen("", "%v = OpFunctionCall %void %nowhere\n"), "function-missing");
}

// ---- resources ----

const char* const kBlock =
    "%block = OpTypeStruct %float\n%pb = OpTypePointer Uniform %block\n%pf = OpTypePointer Uniform %float\n"
    "%buffer = OpVariable %pb Uniform\n";
const char* const kReadBlock = "%x = OpAccessChain %pf %buffer %uint_0\n%v = OpLoad %float %x\n";
const char* const kBlockLayout = "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset 0\n";

TEST(Diagnostics, ResourceWithoutBinding) {
    expect_error_behind_validation(raygen(kBlock, kReadBlock, kBlockLayout), "resource-without-binding");
}

TEST(Diagnostics, ResourceConflict) {
    StageText reader = stage("MissNV", kBlock, kReadBlock,
                             std::string(kBlockLayout) + "OpDecorate %buffer DescriptorSet 0\nOpDecorate %buffer Binding 0\n");
    expect_error(link({{StageKind::RayGen, module_of(tracing_raygen())}, {StageKind::Miss, module_of(reader)}}),
                 "resource-conflict");
}

TEST(Diagnostics, TargetCapability) {
    std::vector<uint32_t> words = module_of(tracing_raygen());
    words.insert(words.begin() + 5, {2u << 16 | 17u, 21u});  // OpCapability AtomicStorage, which is OpenGL's
    expect_error(link({{StageKind::RayGen, words}}), "target-capability");
    // With OpenCL's Kernel, signed integers would not be valid: the traversal's.
    std::vector<uint32_t> kernel = module_of(stage("MissNV"));
    kernel.insert(kernel.begin() + 5, {2u << 16 | 17u, 6u});
    expect_error(link({{StageKind::RayGen, module_of(tracing_raygen())}, {StageKind::Miss, kernel}}), "target-capability");
}

// An input that is HitTriangleVertexPositionsKHR (5335), behind RayTracingPositionFetchKHR (5336).
std::vector<uint32_t> fetching(const char* model, const std::string& type,
                               const std::string& body = "%v = OpLoad %positions %input\n") {
    StageText parts = stage(model, type + "%pi = OpTypePointer Input %positions\n%input = OpVariable %pi Input\n", body,
                            "OpDecorate %input BuiltIn !5335\n");
    parts.interface = "%input";
    std::vector<uint32_t> words = module_of(parts);
    words.insert(words.begin() + 5, {2u << 16 | 17u, 5336u});
    return words;
}

TEST(Diagnostics, PositionFetch) {
    const std::string good = "%n = OpConstant %uint 3\n%positions = OpTypeArray %v3float %n\n";
    auto linked = [&](StageKind kind, const char* model, const std::string& type) {
        return link({{StageKind::RayGen, module_of(tracing_raygen())}, {kind, fetching(model, type)}});
    };
    EXPECT_TRUE(linked(StageKind::ClosestHit, "ClosestHitNV", good).ok);
    EXPECT_TRUE(linked(StageKind::AnyHit, "AnyHitNV", good).ok);
    expect_error(linked(StageKind::Intersection, "IntersectionNV", good), "builtin-stage");
    expect_error(linked(StageKind::Miss, "MissNV", good), "builtin-stage");
    const std::string two = "%n = OpConstant %uint 2\n%positions = OpTypeArray %v3float %n\n";
    const std::string flat = "%vec2 = OpTypeVector %float 2\n%n = OpConstant %uint 3\n%positions = OpTypeArray %vec2 %n\n";
    for (const std::string& type : {two, flat, std::string("%positions = OpTypeVector %float 2\n")})
        expect_error(linked(StageKind::ClosestHit, "ClosestHitNV", type), "position-fetch");
    // What SPIRV-Tools does not know hides nothing else from it.
    const std::vector<uint32_t> mistyped = fetching("ClosestHitNV", good, "%v = OpLoad %float %input\n");
    expect_error(link({{StageKind::RayGen, module_of(tracing_raygen())}, {StageKind::ClosestHit, mistyped}}),
                 "spirv-invalid");
}

// Keeping where a triangle's vertices lie costs registers: only for who reads them.
TEST(Diagnostics, PositionsAreKeptOnlyWhereRead) {
    const std::string good = "%n = OpConstant %uint 3\n%positions = OpTypeArray %v3float %n\n";
    LinkOptions options;
    options.debug_info = true;
    for (bool specialize : {false, true}) {
        options.specialize = specialize;
        auto keeps = [&](const std::vector<uint32_t>& closest_hit) {
            const LinkResult result =
                link({{StageKind::RayGen, module_of(tracing_raygen())}, {StageKind::ClosestHit, closest_hit}}, options);
            EXPECT_TRUE(result.ok) << describe(result);
            return rtc::ir::to_text(result.spirv).find("\"rtc_hit_slot\"") != std::string::npos;
        };
        EXPECT_EQ(keeps(fetching("ClosestHitNV", good)), !specialize);  // loaded, but never used
        EXPECT_FALSE(keeps(module_of(stage("ClosestHitNV"))));
    }
}

TEST(Diagnostics, ReservedConflict) {
    LinkOptions options;
    options.reserved_set = 0;
    options.reserved_binding = 0;
    expect_error(link({{StageKind::RayGen, module_of(tracing_raygen())}}, options), "reserved-conflict");
}

// Without --reserved the set above the highest one used is taken.
TEST(Diagnostics, NoSetAboveTheHighest) {
    std::string text = stage_text(tracing_raygen());
    const std::string set = "OpDecorate %scene DescriptorSet ";
    const size_t at = text.find(set) + set.size();
    const auto with_set = [&](const char* number) {
        return link({{StageKind::RayGen, assemble(std::string(text).replace(at, 1, number))}});
    };
    EXPECT_EQ(with_set("6").reflection.reserved_set, 7u);
    EXPECT_EQ(with_set("2147483647").reflection.reserved_set, 2147483648u);
    expect_error(with_set("4294967295"), "reserved-conflict");
}

TEST(Diagnostics, SpecialisationOfNoConstant) {
    Stage specialised{StageKind::RayGen, module_of(tracing_raygen()), "main", {{4711, 1}}};
    const LinkResult result = link({specialised});
    EXPECT_TRUE(has_diagnostic(result, "spec-unknown", Severity::Error) ||
                has_diagnostic(result, "spec-unknown", Severity::Warning))
        << describe(result);
}

// ---- pipelines ----

TEST(Diagnostics, Pipelines) {
    expect_error(link_pipeline({}, {}), "pipeline-empty");
    expect_error(link({{StageKind::Miss, module_of(stage("MissNV"))}}), "pipeline-without-raygen");
    const Stage raygen_stage{StageKind::RayGen, module_of(raygen("", ""))};
    expect_error(link(std::vector<Stage>(4001, raygen_stage)), "pipeline-too-large");
    LinkOptions options;
    options.max_recursion_depth = 32;
    expect_error(link({raygen_stage}, options), "recursion-limit");
    expect_error(link({{StageKind::RayGen, raygen_stage.spirv, "other"}}), "entry-point-missing");
    LinkOptions both;
    both.assumptions = RTC_FACT_HAS_TRIANGLES | RTC_FACT_HAS_AABBS;
    expect_error(link({raygen_stage}, both), "assumption-conflict");
}

TEST(Diagnostics, Groups) {
    PipelineInput input = pipeline({{StageKind::RayGen, module_of(raygen("", ""))},
                                    {StageKind::ClosestHit, module_of(stage("ClosestHitNV"))},
                                    {StageKind::Intersection, module_of(stage("IntersectionNV"))}});
    PipelineInput bad = input;
    bad.groups[1].closest_hit = 0;
    expect_error(link_pipeline(bad, {}), "group-stage");
    bad = input;
    bad.groups[0].general = 99;
    expect_error(link_pipeline(bad, {}), "group-stage");
    bad = input;
    bad.groups[1].kind = GroupKind::Procedural;
    expect_error(link_pipeline(bad, {}), "group-without-intersection");
    bad = input;
    bad.groups[1].intersection = 2;
    expect_error(link_pipeline(bad, {}), "group-intersection");
}

// ---- SPIR-V itself; malformed_test.cpp has many more of the first ----

TEST(Diagnostics, Binaries) {
    const std::vector<uint32_t> good = module_of(tracing_raygen());
    std::vector<uint32_t> words = good;
    words[0] = 1;
    expect_error(link({{StageKind::RayGen, words}}), "spirv-malformed");
    words = good;
    words[1] = 0x00020000;
    expect_error(link({{StageKind::RayGen, words}}), "spirv-version");
    words = good;
    words.insert(words.begin() + 5, 1u << 16 | 0xfff0u);
    expect_error(link({{StageKind::RayGen, words}}), "spirv-unknown-opcode");
    StageText parts = raygen("", "");
    parts.preamble = "%set = OpExtInstImport \"OpenCL.std\"\n";
    std::string text = stage_text(parts);
    // The import belongs behind the extensions.
    const std::string import = parts.preamble;
    text.erase(text.find(import), import.size());
    text.insert(text.find("OpMemoryModel"), import);
    expect_error(link({{StageKind::RayGen, assemble(text)}}), "spirv-unknown-instruction-set");
    expect_error(raygen("", "%sum = OpIAdd %float %uint_0 %uint_0\n"), "spirv-invalid");
}

}  // namespace
}  // namespace rtc::test
