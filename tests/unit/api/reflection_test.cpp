#include "api_util.h"

#include <nlohmann/json.hpp>

namespace {

TEST(ReflectionTest, StructuresDescribeThePipeline) {
    const Result result = compile(small_pipeline());
    const rtcc_reflection* r = rtcc_result_reflection(result.get());
    ASSERT_NE(r, nullptr) << rtcc_result_messages(result.get());
    ASSERT_EQ(r->stage_count, 2u);
    EXPECT_EQ(r->stages[0].stage, RTCC_STAGE_RAYGEN);
    EXPECT_STREQ(r->stages[0].name, "a.rgen");
    EXPECT_EQ(r->stages[1].stage, RTCC_STAGE_MISS);
    EXPECT_EQ(r->stages[1].payload_words, 4u);
    ASSERT_EQ(r->group_count, 2u);
    EXPECT_EQ(r->groups[0].kind, RTCC_GROUP_KIND_GENERAL);
    EXPECT_NE(r->groups[0].handle[0], 0u);
    EXPECT_EQ(r->groups[0].handle[7], r->identity);
    ASSERT_EQ(r->trace_site_count, 1u);
    EXPECT_STREQ(r->trace_sites[0].file, "a.rgen");
    EXPECT_EQ(r->trace_sites[0].line, 8u);
    ASSERT_EQ(r->spec_constant_count, 1u);
    EXPECT_EQ(r->spec_constants[0].original_id, 5u);
    EXPECT_STREQ(r->spec_constants[0].name, "kIndex");
    EXPECT_EQ(r->reserved_set, 1u);
    EXPECT_GT(r->instruction_count, 0u);
}

TEST(ReflectionTest, JsonSaysTheSame) {
    const Result result = compile(small_pipeline());
    const rtcc_reflection* r = rtcc_result_reflection(result.get());
    ASSERT_NE(r, nullptr);
    const auto json = nlohmann::json::parse(rtcc_result_reflection_json(result.get()));
    EXPECT_EQ(json["states"], r->state_count);
    EXPECT_EQ(json["stages"].size(), r->stage_count);
    EXPECT_EQ(json["resources"].size(), r->resource_count);
}

TEST(ReflectionTest, AFinishedModuleCarriesIt) {
    const Result made = compile(small_pipeline());
    ASSERT_EQ(rtcc_result_status(made.get()), RTCC_STATUS_SUCCESS);
    Compiler compiler(rtcc_compiler_create());
    const Result read(rtcc_reflect_module(compiler.get(), "m.spv", rtcc_result_words(made.get()),
                                          rtcc_result_word_count(made.get())));
    ASSERT_EQ(rtcc_result_status(read.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(read.get());
    EXPECT_STREQ(rtcc_result_reflection_json(read.get()), rtcc_result_reflection_json(made.get()));
    EXPECT_EQ(bytes_of(read), bytes_of(made));

    const Result stage = compile_stage(kMiss, "a.rmiss");
    const Result none(rtcc_reflect_module(compiler.get(), "m.spv", rtcc_result_words(stage.get()),
                                          rtcc_result_word_count(stage.get())));
    EXPECT_EQ(rtcc_result_status(none.get()), RTCC_STATUS_NO_REFLECTION);
    EXPECT_EQ(rtcc_result_reflection(none.get()), nullptr);
}

}  // namespace
