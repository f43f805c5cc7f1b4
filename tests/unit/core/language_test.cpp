// What valid input may look like beyond what today's glslang writes: other versions and producers, several entry
// points, specialised locations, differing push constants, shared descriptors, scopes, debug information.
#include <gtest/gtest.h>

#include "core_test_util.h"
#include "ir/module.h"
#include "link/link.h"

namespace rtc::test {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string tracing_text() { return raygen_text(kPayload, kTrace, kPayloadLocation); }

StageText stage(const char* model, const std::string& globals, const std::string& body,
                const std::string& annotations) {
    StageText parts;
    parts.model = model;
    parts.globals = globals;
    parts.body = body;
    parts.annotations = annotations;
    return parts;
}

void expect_valid(const LinkResult& result) {
    ASSERT_TRUE(result.ok) << describe(result);
    EXPECT_EQ(link::validate(result.spirv, result.reflection.spirv_version >= 0x00010600u   ? 3
                                           : result.reflection.spirv_version >= 0x00010400u ? 2
                                                                                            : 1),
              "");
}

size_t count(const std::string& text, const std::string& part) {
    size_t n = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

TEST(Language, EveryVersionOfSpirv) {
    for (uint32_t minor = 0; minor <= 6; ++minor) {
        std::vector<uint32_t> words = assemble(tracing_text());
        words[1] = 0x00010000u | minor << 8;
        if (minor >= 4)  // the interface lists every variable
            words = assemble(replaced(tracing_text(), "\"main\"", "\"main\" %scene %payload"), minor);
        const LinkResult result = link({{StageKind::RayGen, words}});
        SCOPED_TRACE("SPIR-V 1." + std::to_string(minor));
        expect_valid(result);
    }
}

TEST(Language, OldGlslangAndSlangAsProducers) {
    std::vector<uint32_t> words = assemble(tracing_text());
    for (uint32_t generator : {0x00080007u, 0x00080001u, 0x00080008u, 0x0008000au, 0x00280000u}) {
        words[2] = generator;
        expect_valid(link({{StageKind::RayGen, words}}));
    }
    // OpSource with a language number that SPIRV-Tools does not know: Slang's 11.
    const std::string text = replaced(tracing_text(), "OpDecorate %scene DescriptorSet 0", "OpSource GLSL 460\nOpDecorate %scene DescriptorSet 0");
    words = assemble(text);
    for (size_t at = 5; at < words.size(); at += words[at] >> 16)
        if ((words[at] & 0xffff) == static_cast<uint32_t>(ir::Op::OpSource)) words[at + 1] = 11;
    expect_valid(link({{StageKind::RayGen, words}}));
}

TEST(Language, OneOfSeveralEntryPoints) {
    std::string text = replaced(tracing_text(), "OpEntryPoint RayGenerationNV %main \"main\"",
                                "OpEntryPoint RayGenerationNV %main \"main\"\nOpEntryPoint RayGenerationNV %other "
                                "\"other\"\nOpEntryPoint MissNV %sky \"main\"");
    text += "%other = OpFunction %void None %fn\n%b = OpLabel\nOpReturn\nOpFunctionEnd\n"
            "%sky = OpFunction %void None %fn\n%c = OpLabel\nOpReturn\nOpFunctionEnd\n";
    const std::vector<uint32_t> words = assemble(text);
    const LinkResult traces = link({{StageKind::RayGen, words}, {StageKind::Miss, words}});
    expect_valid(traces);
    EXPECT_EQ(traces.reflection.trace_sites.size(), 1u);
    const LinkResult other = link({{StageKind::RayGen, words, "other"}});
    expect_valid(other);
    EXPECT_EQ(other.reflection.trace_sites.size(), 0u);
}

TEST(Language, SpecialisedPayloadLocation) {
    const std::string globals = std::string(kPayload) + "%other = OpVariable %ptr_payload RayPayloadNV\n%loc = OpSpecConstant %uint 0\n";
    std::string body = kTrace;
    body = replaced(body, "%up3 %float_1 %uint_0", "%up3 %float_1 %loc");
    const std::string annotations =
        std::string(kPayloadLocation) + "OpDecorate %other Location 5\nOpDecorate %loc SpecId 3\n";
    const std::vector<uint32_t> words = assemble(raygen_text(globals, body, annotations));
    const LinkResult open = link({{StageKind::RayGen, words}});
    expect_valid(open);
    // Decided when linking, so no longer a constant of the pipeline.
    EXPECT_TRUE(open.reflection.spec_constants.empty());
    expect_valid(link({{StageKind::RayGen, words, "main", {{3, 5}}}}));
    const LinkResult wrong = link({{StageKind::RayGen, words, "main", {{3, 4}}}});
    EXPECT_TRUE(has_diagnostic(wrong, "trace-location-unknown")) << describe(wrong);
}

StageText pushes(const char* model, const std::string& type, const std::string& offset) {
    return stage(model,
                 "%block = OpTypeStruct " + type + "\n%pb = OpTypePointer PushConstant %block\n%pf = OpTypePointer "
                 "PushConstant " + type + "\n%constants = OpVariable %pb PushConstant\n",
                 "%x = OpAccessChain %pf %constants %uint_0\n%v = OpLoad " + type + " %x\n",
                 "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset " + offset + "\n");
}

TEST(Language, PushConstantsThatDifferBecomeWords) {
    const auto link_two = [](const StageText& a, const StageText& b) {
        LinkOptions options;
        options.stop_after = "finish";
        options.specialize = false;  // the values are not used: it would remove them
        return link({{StageKind::RayGen, assemble(stage_text(a))}, {StageKind::Miss, assemble(stage_text(b))}}, options);
    };
    const LinkResult same = link_two(pushes("RayGenerationNV", "%float", "4"), pushes("MissNV", "%float", "4"));
    expect_valid(same);
    EXPECT_EQ(count(same.dump, " PushConstant\n"), 1u);
    EXPECT_EQ(same.reflection.push_constant_bytes, 8u);
    // Overlapping, of other types: each stage reads its own view of the words.
    const LinkResult different = link_two(pushes("RayGenerationNV", "%float", "4"), pushes("MissNV", "%v3float", "0"));
    expect_valid(different);
    EXPECT_EQ(count(different.dump, " OpVariable "), count(different.dump, " OpVariable "));
    EXPECT_EQ(different.reflection.push_constant_bytes, 12u);
    EXPECT_EQ(count(different.dump, " PushConstant\n"), 1u);
    EXPECT_NE(different.dump.find("_arr_uint_uint_3"), std::string::npos);
}

TEST(Language, CombinedDescriptorsServeAsTheirParts) {
    const auto uses = [](const char* model, const std::string& type) {
        return stage(model,
                     "%image = OpTypeImage %float 2D 0 0 0 1 Unknown\n%sampler = OpTypeSampler\n%both = OpTypeSampledImage "
                     "%image\n%pt = OpTypePointer UniformConstant " + type + "\n%thing = OpVariable %pt UniformConstant\n",
                     "%t = OpLoad " + type + " %thing\n",
                     "OpDecorate %thing DescriptorSet 0\nOpDecorate %thing Binding 3\n");
    };
    const LinkResult result = link({{StageKind::RayGen, assemble(stage_text(uses("RayGenerationNV", "%image")))},
                                    {StageKind::Miss, assemble(stage_text(uses("MissNV", "%both")))}});
    expect_valid(result);
    size_t combined = 0;
    for (const ResourceReport& resource : result.reflection.resources)
        combined += resource.binding == 3 && resource.type == "combined-image-sampler";
    EXPECT_EQ(combined, 2u);
}

TEST(Language, ShaderCallScopeIsTheInvocation) {
    StageText parts;
    parts.globals = "%scope = OpConstant %uint 6\n%relaxed = OpConstant %uint 64\n%acquire = OpConstant %uint 72\n"
                    "%block = OpTypeStruct %uint\n%pb = OpTypePointer StorageBuffer %block\n%pu = OpTypePointer "
                    "StorageBuffer %uint\n%data = OpVariable %pb StorageBuffer\n";
    parts.body = "%x = OpAccessChain %pu %data %uint_0\n%old = OpAtomicIAdd %uint %x %scope %relaxed %uint_255\n"
                 "OpMemoryBarrier %scope %acquire\n";
    parts.annotations = "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset 0\nOpDecorate %data DescriptorSet 0\n"
                        "OpDecorate %data Binding 1\n";
    std::string text = replaced(stage_text(parts), "OpCapability RayTracingNV", "OpCapability RayTracingKHR");
    text = replaced(text, "SPV_NV_ray_tracing", "SPV_KHR_ray_tracing");
    text = replaced(text, "\"main\"", "\"main\" %data");
    LinkOptions options;
    options.stop_after = "finish";
    const LinkResult result = link({{StageKind::RayGen, assemble(text, 4)}}, options);
    expect_valid(result);
    EXPECT_NE(result.dump.find("OpAtomicIAdd %uint"), std::string::npos);
    EXPECT_EQ(result.dump.find("OpMemoryBarrier"), std::string::npos);
    EXPECT_NE(result.dump.find("%uint_2 %uint_64 %uint_255"), std::string::npos) << "workgroup scope";
}

TEST(Language, LinesSurviveAndDebugInstructionsDoNotDisturb) {
    std::string text = replaced(tracing_text(), "OpMemoryModel Logical GLSL450",
                                "%info = OpExtInstImport \"NonSemantic.Shader.DebugInfo.100\"\nOpMemoryModel Logical GLSL450");
    text = replaced(text, "OpExtension \"SPV_NV_ray_tracing\"",
                    "OpExtension \"SPV_NV_ray_tracing\"\nOpExtension \"SPV_KHR_non_semantic_info\"");
    text = replaced(text, "OpDecorate %scene DescriptorSet 0", "%file = OpString \"camera.rgen\"\nOpDecorate %scene DescriptorSet 0");
    text = replaced(text, "%s = OpLoad %as %scene", "OpLine %file 17 0\n%s = OpLoad %as %scene");
    text = replaced(text, "%main = OpFunction", "%nothing = OpExtInst %void %info 0\n%main = OpFunction");
    LinkOptions options;
    options.debug_info = true;
    options.stop_after = "finish";
    for (Optimization level : {Optimization::None, Optimization::Performance}) {
        options.optimize = level;
        const LinkResult result = link({{StageKind::RayGen, assemble(text)}}, options);
        expect_valid(result);
        EXPECT_NE(result.dump.find("OpString \"camera.rgen\""), std::string::npos);
        EXPECT_NE(result.dump.find(" 17 0"), std::string::npos) << "OpLine";
        EXPECT_EQ(result.dump.find("NonSemantic"), std::string::npos);
    }
    options.debug_info = false;
    const LinkResult bare = link({{StageKind::RayGen, assemble(text)}}, options);
    expect_valid(bare);
    EXPECT_EQ(bare.dump.find("OpLine"), std::string::npos);
}

// NVIDIA's compiler crashes on some machines that write small arrays by a computed index: testdata/driver-cases.
TEST(Language, ComputedIndicesIntoSmallArraysAreSelections) {
    auto selections = [](const char* length, const char* operands) {
        const std::string globals = std::string(kPayload) + "%n = OpConstant %uint " + length +
                                    "\n%array = OpTypeArray %float %n\n%parray = OpTypePointer Private %array\n"
                                    "%pelement = OpTypePointer Private %float\n%values = OpVariable %parray Private\n"
                                    "%pindex = OpTypePointer Private %uint\n%where = OpVariable %pindex Private\n";
        const std::string body = "%index = OpLoad %uint %where\n%at = OpAccessChain %pelement %values %index\n"
                                 "OpStore %at %float_0 " + std::string(operands) + "\n%there = OpLoad %float %at " + operands + "\n";
        LinkOptions options;
        options.specialize = false;
        const LinkResult result =
            link({{StageKind::RayGen, assemble(raygen_text(globals, body + kTrace, kPayloadLocation))}}, options);
        expect_valid(result);
        return count(ir::to_text(result.spirv), "OpSelect %float ");
    };
    const size_t none = selections("9", "");
    EXPECT_EQ(selections("8", ""), none + 8 + 7);  // a store, a load
    EXPECT_EQ(selections("3", ""), none + 3 + 2);
    EXPECT_EQ(selections("3", "Volatile"), none);
}

}  // namespace
}  // namespace rtc::test
