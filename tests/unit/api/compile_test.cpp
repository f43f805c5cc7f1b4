#include "api_util.h"

#include <vector>

extern "C" int c_header_round_trip(void);

using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace {

TEST(Compile, TheHeaderIsC) { EXPECT_TRUE(c_header_round_trip()); }

TEST(Compile, VersionsAgree) {
    EXPECT_EQ(rtcc_abi_version(), RTC_ABI_VERSION);
    EXPECT_THAT(rtcc_version(), HasSubstr("."));
    EXPECT_THAT(rtcc_front_end_version(), StartsWith("glslang "));
}

TEST(Compile, AStageBecomesSpirv) {
    const Result result = compile_stage(kMiss, "a.rmiss");
    ASSERT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(result.get());
    ASSERT_GT(rtcc_result_word_count(result.get()), 5u);
    EXPECT_EQ(rtcc_result_words(result.get())[0], 0x07230203u);
    EXPECT_EQ(rtcc_result_words(result.get())[1], 0x00010300u) << "NV is parsed for Vulkan 1.1";
    EXPECT_EQ(rtcc_result_reflection(result.get()), nullptr);
    EXPECT_STREQ(rtcc_result_reflection_json(result.get()), "");
    EXPECT_EQ(rtcc_result_dependency_count(result.get()), 1u);
    EXPECT_STREQ(rtcc_result_dependency(result.get(), 0), "a.rmiss");
    EXPECT_EQ(rtcc_result_dependency(result.get(), 1), nullptr);
    EXPECT_THAT(rtcc_result_assembly(result.get()), HasSubstr("OpEntryPoint Miss"));
}

TEST(Compile, ExtStagesAreParsedForVulkan12WithSpirv14) {
    const std::string source =
        "#version 460\n#extension GL_EXT_ray_tracing : require\n"
        "layout(location = 0) rayPayloadInEXT vec4 color;\nvoid main() { color = vec4(0.0); }\n";
    const Result result = compile_stage(source, "a.rmiss");
    ASSERT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(result.get());
    EXPECT_EQ(rtcc_result_words(result.get())[1], 0x00010400u);
}

TEST(Compile, ErrorsComeAsStructuresAndText) {
    const Result result = compile_stage(
        "#version 460\n#extension GL_NV_ray_tracing : require\n"
        "void main() {\n  int x = nothing;\n}\n",
        "bad.rmiss");
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_EQ(rtcc_result_words(result.get()), nullptr);
    EXPECT_EQ(rtcc_result_word_count(result.get()), 0u);
    EXPECT_STREQ(rtcc_result_assembly(result.get()), "");
    ASSERT_EQ(rtcc_result_error_count(result.get()), 1u);
    EXPECT_EQ(rtcc_result_warning_count(result.get()), 0u);
    const rtcc_diagnostic message = rtcc_result_diagnostic(result.get(), 0);
    EXPECT_EQ(message.severity, RTCC_SEVERITY_ERROR);
    EXPECT_STREQ(message.id, "glsl-error");
    EXPECT_STREQ(message.file, "bad.rmiss");
    EXPECT_EQ(message.line, 4u);
    EXPECT_THAT(message.text, HasSubstr("undeclared identifier"));
    EXPECT_STREQ(rtcc_result_messages(result.get()),
                 "bad.rmiss:4: error: 'nothing' : undeclared identifier\n");
    const rtcc_diagnostic beyond = rtcc_result_diagnostic(result.get(), 1);
    EXPECT_STREQ(beyond.text, "");
    EXPECT_EQ(beyond.line, 0u);
}

TEST(Compile, StagesThatCannotBeTold) {
    EXPECT_EQ(rtcc_result_status(compile_stage(kMiss, "a.txt").get()), RTCC_STATUS_INVALID_STAGE);
    EXPECT_EQ(rtcc_result_status(compile_stage(kMiss, nullptr).get()), RTCC_STATUS_INVALID_STAGE);
    EXPECT_EQ(rtcc_stage_from_source("a.txt", kMiss.data(), kMiss.size()), RTCC_STAGE_AUTO);
    const std::string pragma = "#version 460\n#pragma shader_stage(callable)\n";
    EXPECT_EQ(rtcc_stage_from_source("a.txt", pragma.data(), pragma.size()), RTCC_STAGE_CALLABLE);
    EXPECT_EQ(rtcc_stage_from_file_name("x/y.rahit.glsl"), RTCC_STAGE_ANY_HIT);
    EXPECT_EQ(rtcc_stage_from_file_name("rahit"), RTCC_STAGE_AUTO);
    EXPECT_EQ(rtcc_stage_from_file_name(nullptr), RTCC_STAGE_AUTO);
    for (int stage = 0; stage < 6; ++stage)
        EXPECT_EQ(rtcc_stage_from_name(rtcc_stage_name(static_cast<rtcc_stage>(stage))), stage);
    EXPECT_STREQ(rtcc_stage_name(RTCC_STAGE_AUTO), "auto");
}

TEST(Compile, NullArgumentsAreErrorsNotCrashes) {
    Compiler compiler(rtcc_compiler_create());
    EXPECT_EQ(rtcc_result_status(Result(rtcc_compile_pipeline(nullptr, nullptr, nullptr)).get()),
              RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_result_status(Result(rtcc_compile_pipeline(compiler.get(), nullptr, nullptr)).get()),
              RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(
        rtcc_result_status(
            Result(rtcc_compile_stage(compiler.get(), RTCC_STAGE_MISS, nullptr, nullptr, 5, nullptr)).get()),
        RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_result_status(
                  Result(rtcc_compile_stage(compiler.get(), static_cast<rtcc_stage>(77), "", "", 0, nullptr))
                      .get()),
              RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_result_status(Result(rtcc_reflect_module(compiler.get(), nullptr, nullptr, 3)).get()),
              RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_result_status(Result(rtcc_module_from_bytes(nullptr, nullptr, 3)).get()),
              RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_result_status(nullptr), RTCC_STATUS_INTERNAL_ERROR);
    EXPECT_EQ(rtcc_result_words(nullptr), nullptr);
    EXPECT_EQ(rtcc_result_word_count(nullptr), 0u);
    EXPECT_STREQ(rtcc_result_text(nullptr), "");
    EXPECT_STREQ(rtcc_result_messages(nullptr), "");
    EXPECT_STREQ(rtcc_result_assembly(nullptr), "");
    EXPECT_EQ(rtcc_result_diagnostic_count(nullptr), 0u);
    EXPECT_EQ(rtcc_result_dependency(nullptr, 0), nullptr);
    EXPECT_EQ(rtcc_result_reflection(nullptr), nullptr);
    EXPECT_EQ(rtcc_is_spirv(nullptr, 8), 0);
    EXPECT_EQ(rtcc_module_stage(nullptr, 0, nullptr), RTCC_STAGE_AUTO);
    rtcc_compiler_release(nullptr);
    rtcc_options_release(nullptr);
    rtcc_pipeline_release(nullptr);
    rtcc_result_release(nullptr);
}

TEST(Compile, PreprocessGivesText) {
    Compiler compiler(rtcc_compiler_create());
    const std::string source = "#version 460\n#define N 3\nint n = N;\n";
    const Result result(
        rtcc_preprocess_stage(compiler.get(), RTCC_STAGE_MISS, "a", source.data(), source.size(), nullptr));
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS);
    EXPECT_THAT(rtcc_result_text(result.get()), HasSubstr("int n = 3;"));
    EXPECT_EQ(rtcc_result_text_size(result.get()), std::string(rtcc_result_text(result.get())).size());
}

TEST(Compile, ModulesFromBytes) {
    const Result stage = compile_stage(kMiss, "a.rmiss");
    std::string bytes = bytes_of(stage);
    EXPECT_TRUE(rtcc_is_spirv(bytes.data(), bytes.size()));
    const std::string shifted = "x" + bytes;  // any alignment
    const Result whole(rtcc_module_from_bytes("m.spv", shifted.data() + 1, bytes.size()));
    EXPECT_EQ(bytes_of(whole), bytes);
    EXPECT_EQ(rtcc_module_stage(rtcc_result_words(whole.get()), rtcc_result_word_count(whole.get()), nullptr),
              RTCC_STAGE_MISS);
    EXPECT_EQ(rtcc_module_stage(rtcc_result_words(whole.get()), rtcc_result_word_count(whole.get()), "other"),
              RTCC_STAGE_AUTO);
    for (size_t i = 0; i + 3 < bytes.size(); i += 4) {
        std::swap(bytes[i], bytes[i + 3]);
        std::swap(bytes[i + 1], bytes[i + 2]);
    }
    const Result swapped(rtcc_module_from_bytes("m.spv", bytes.data(), bytes.size()));
    EXPECT_EQ(bytes_of(swapped), bytes_of(stage));

    for (size_t cut : {size_t{0}, size_t{3}, size_t{8}, size_t{21}, bytes.size() - 1}) {
        const Result damaged(rtcc_module_from_bytes("m.spv", bytes.data(), cut));
        EXPECT_EQ(rtcc_result_status(damaged.get()), RTCC_STATUS_INVALID_SPIRV) << cut;
        EXPECT_EQ(rtcc_result_error_count(damaged.get()), 1u) << cut;
    }
}

TEST(Compile, MisuseHasIds) {
    Compiler compiler(rtcc_compiler_create());
    const Result none(rtcc_compile_stage(nullptr, RTCC_STAGE_AUTO, "a.rmiss", kMiss.data(), kMiss.size(), nullptr));
    EXPECT_EQ(rtcc_result_status(none.get()), RTCC_STATUS_INVALID_ARGUMENT);
    ASSERT_EQ(rtcc_result_error_count(none.get()), 1u);
    EXPECT_STREQ(rtcc_result_diagnostic(none.get(), 0).id, "invalid-argument");
    // A stage is no linked pipeline.
    const Result stage = compile_stage(kMiss, "a.rmiss");
    const Result reflection(rtcc_reflect_module(compiler.get(), "a.spv", rtcc_result_words(stage.get()),
                                                rtcc_result_word_count(stage.get())));
    EXPECT_EQ(rtcc_result_status(reflection.get()), RTCC_STATUS_NO_REFLECTION);
    ASSERT_EQ(rtcc_result_error_count(reflection.get()), 1u);
    const rtcc_diagnostic message = rtcc_result_diagnostic(reflection.get(), 0);
    EXPECT_STREQ(message.id, "no-reflection");
    EXPECT_STREQ(message.file, "a.spv");
    EXPECT_STRNE(message.text, "");
}

}  // namespace
