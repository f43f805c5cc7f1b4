#include "api_util.h"

using ::testing::HasSubstr;

namespace {

const std::string kNeedsMacro =
    "#version 460\n#extension GL_NV_ray_tracing : require\n"
    "layout(location = 0) rayPayloadInNV vec4 color;\nvoid main() { color = vec4(VALUE); }\n";

TEST(OptionsTest, MacrosReachTheSource) {
    Options options(rtcc_options_create());
    EXPECT_EQ(rtcc_result_status(compile_stage(kNeedsMacro, "a.rmiss", options.get()).get()),
              RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_EQ(rtcc_options_add_macro(options.get(), "VALUE", "0.5"), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_result_status(compile_stage(kNeedsMacro, "a.rmiss", options.get()).get()),
              RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_options_undefine_macro(options.get(), "VALUE"), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_result_status(compile_stage(kNeedsMacro, "a.rmiss", options.get()).get()),
              RTCC_STATUS_COMPILATION_ERROR);
}

TEST(OptionsTest, ACloneSharesNothing) {
    Options options(rtcc_options_create());
    rtcc_options_add_macro(options.get(), "VALUE", "0.5");
    Options clone(rtcc_options_clone(options.get()));
    rtcc_options_undefine_macro(options.get(), "VALUE");
    EXPECT_EQ(rtcc_result_status(compile_stage(kNeedsMacro, "a.rmiss", clone.get()).get()),
              RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_result_status(compile_stage(kNeedsMacro, "a.rmiss", options.get()).get()),
              RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_NE(Options(rtcc_options_clone(nullptr)), nullptr);
}

TEST(OptionsTest, BadValuesAreRefusedAndChangeNothing) {
    Options options(rtcc_options_create());
    rtcc_options_t o = options.get();
    EXPECT_EQ(rtcc_options_add_macro(o, "VALUE", "0.5"), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_options_add_macro(o, "1A", "x"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_add_macro(o, "", "x"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_add_macro(o, nullptr, "x"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_add_macro(o, "A", "x\n#error injected"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_add_macro(o, "A(x)\n", "x"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_undefine_macro(o, "A B"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_glsl_version(o, "461"), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_max_recursion_depth(o, 0), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_max_recursion_depth(o, 32), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_max_callable_depth(o, 32), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_reserved(o, -2, 0), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_target_env(o, static_cast<rtcc_target_env>(9)), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_optimization(o, static_cast<rtcc_optimization>(9)),
              RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_accuracy(o, static_cast<rtcc_accuracy>(9)), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_add_include_directory(o, nullptr), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_set_debug_info(nullptr, 1), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_result_status(compile_stage(kNeedsMacro, "a.rmiss", o).get()), RTCC_STATUS_SUCCESS);
}

TEST(OptionsTest, WarningsCanBeErrorsOrSilent) {
    const std::string source =
        "#version 460\n#extension GL_NV_ray_tracing : require\n#extension GL_XX_unknown : enable\nvoid "
        "main() {}\n";
    Options options(rtcc_options_create());
    EXPECT_EQ(rtcc_result_warning_count(compile_stage(source, "a.rmiss", options.get()).get()), 1u);
    rtcc_options_set_warnings_as_errors(options.get(), 1);
    const Result strict = compile_stage(source, "a.rmiss", options.get());
    EXPECT_EQ(rtcc_result_status(strict.get()), RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_EQ(rtcc_result_error_count(strict.get()), 1u);
    EXPECT_EQ(rtcc_result_word_count(strict.get()), 0u);
    rtcc_options_set_suppress_warnings(options.get(), 1);
    const Result silent = compile_stage(source, "a.rmiss", options.get());
    EXPECT_EQ(rtcc_result_status(silent.get()), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_result_diagnostic_count(silent.get()), 0u);
}

TEST(OptionsTest, DebugInfoOfOneStage) {
    Options options(rtcc_options_create());
    EXPECT_THAT(rtcc_result_assembly(compile_stage(kMiss, "a.rmiss", options.get()).get()),
                ::testing::Not(HasSubstr("OpLine")));
    rtcc_options_set_debug_info(options.get(), 1);
    EXPECT_THAT(rtcc_result_assembly(compile_stage(kMiss, "a.rmiss", options.get()).get()),
                HasSubstr("OpLine"));
}

TEST(OptionsTest, GlslVersionOverridesTheSource) {
    Options options(rtcc_options_create());
    EXPECT_EQ(rtcc_options_set_glsl_version(options.get(), "460core"), RTCC_STATUS_SUCCESS);
    const std::string old = "#version 450\n" + kMiss.substr(13);
    EXPECT_EQ(rtcc_result_status(compile_stage(old, "a.rmiss").get()), RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_EQ(rtcc_result_status(compile_stage(old, "a.rmiss", options.get()).get()), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_options_set_glsl_version(options.get(), nullptr), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_result_status(compile_stage(old, "a.rmiss", options.get()).get()),
              RTCC_STATUS_COMPILATION_ERROR);
}

}  // namespace
