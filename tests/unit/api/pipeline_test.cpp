#include "api_util.h"

#include <vector>

using ::testing::HasSubstr;

namespace {

TEST(PipelineTest, StagesLinkIntoOneModule) {
    const Result result = compile(small_pipeline());
    ASSERT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(result.get());
    EXPECT_THAT(rtcc_result_assembly(result.get()), HasSubstr("OpEntryPoint GLCompute"));
    EXPECT_EQ(rtcc_result_dependency_count(result.get()), 2u);
}

TEST(PipelineTest, IndicesAndNamesAreChecked) {
    Pipeline pipeline(rtcc_pipeline_create());
    EXPECT_EQ(add(pipeline, kRaygen, "a.rgen"), 0);
    EXPECT_EQ(add(pipeline, kMiss, "b.rmiss", "sky"), 1);
    EXPECT_EQ(add(pipeline, kMiss, "c.rmiss", "sky"), -1) << "a name used before";
    EXPECT_EQ(add(pipeline, kMiss, "a.rgen"), -1) << "the file's name is the default name";
    EXPECT_EQ(add(pipeline, kMiss, "", ""), -1) << "no name at all";
    EXPECT_EQ(rtcc_pipeline_add_glsl(nullptr, RTCC_STAGE_MISS, "x", "x", "", 0), -1);
    EXPECT_EQ(rtcc_pipeline_add_glsl(pipeline.get(), RTCC_STAGE_MISS, "x", "x", nullptr, 4), -1);
    EXPECT_EQ(rtcc_pipeline_add_spirv(pipeline.get(), RTCC_STAGE_MISS, "x", "x", nullptr, 4, nullptr), -1);
    EXPECT_EQ(rtcc_pipeline_add_general_group(pipeline.get(), nullptr, 0), 0);
    EXPECT_EQ(rtcc_pipeline_add_general_group(pipeline.get(), nullptr, 0), -1) << "that name is taken";
    EXPECT_EQ(rtcc_pipeline_add_general_group(pipeline.get(), "again", 0), 1);
    EXPECT_EQ(rtcc_pipeline_add_general_group(pipeline.get(), "x", 7), -1);
    EXPECT_EQ(rtcc_pipeline_add_general_group(pipeline.get(), "x", -1), -1);
    EXPECT_EQ(rtcc_pipeline_add_hit_group(pipeline.get(), "null", -1, -1, -1), 2);
    EXPECT_EQ(rtcc_pipeline_add_hit_group(pipeline.get(), nullptr, -1, -1, -1), -1) << "a group needs a name";
    EXPECT_EQ(rtcc_pipeline_add_hit_group(pipeline.get(), "x", 9, -1, -1), -1);
    EXPECT_EQ(rtcc_pipeline_specialize(pipeline.get(), 9, 0, 0), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_pipeline_specialize_text(pipeline.get(), 0, 0, nullptr), RTCC_STATUS_INVALID_ARGUMENT);
}

TEST(PipelineTest, EmptyPipelinesAreErrors) {
    const Result result = compile(Pipeline(rtcc_pipeline_create()));
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_LINK_ERROR);
    EXPECT_STREQ(rtcc_result_diagnostic(result.get(), 0).id, "pipeline-empty");
}

TEST(PipelineTest, EveryBadStageIsReportedAtOnce) {
    Pipeline pipeline(rtcc_pipeline_create());
    add(pipeline, "#version 460\nbroken", "a.rgen");
    add(pipeline, "#version 460\nbroken", "b.rmiss");
    const Result result = compile(pipeline);
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_THAT(rtcc_result_messages(result.get()), HasSubstr("a.rgen:2: error:"));
    EXPECT_THAT(rtcc_result_messages(result.get()), HasSubstr("b.rmiss:2: error:"));
}

TEST(PipelineTest, GroupsTakeStagesOfTheirKind) {
    Pipeline pipeline(rtcc_pipeline_create());
    const int32_t raygen = add(pipeline, kRaygen, "a.rgen");
    rtcc_pipeline_add_general_group(pipeline.get(), nullptr, raygen);
    rtcc_pipeline_add_hit_group(pipeline.get(), "hit", raygen, -1, -1);
    const Result result = compile(pipeline);
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_LINK_ERROR);
    EXPECT_STREQ(rtcc_result_diagnostic(result.get(), 0).id, "group-stage-kind");
    EXPECT_THAT(rtcc_result_diagnostic(result.get(), 0).text,
                HasSubstr("group 'hit': stage 'a.rgen' is of kind rgen, expected rchit"));
}

TEST(PipelineTest, SpirvStagesNeedTheirEntryPoint) {
    const Result stage = compile_stage(kMiss, "b.rmiss");
    const auto status = [&](rtcc_stage kind, const char* entry) {
        Pipeline pipeline(rtcc_pipeline_create());
        rtcc_pipeline_add_general_group(pipeline.get(), nullptr, add(pipeline, kRaygen, "a.rgen"));
        rtcc_pipeline_add_general_group(
            pipeline.get(), nullptr,
            rtcc_pipeline_add_spirv(pipeline.get(), kind, nullptr, "b.spv", rtcc_result_words(stage.get()),
                                    rtcc_result_word_count(stage.get()), entry));
        return rtcc_result_status(compile(pipeline).get());
    };
    EXPECT_EQ(status(RTCC_STAGE_AUTO, nullptr), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(status(RTCC_STAGE_MISS, "main"), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(status(RTCC_STAGE_MISS, "start"), RTCC_STATUS_INVALID_SPIRV);
    EXPECT_EQ(status(RTCC_STAGE_CLOSEST_HIT, nullptr), RTCC_STATUS_INVALID_SPIRV);
}

TEST(PipelineTest, DamagedSpirvIsAnError) {
    const Result stage = compile_stage(kMiss, "b.rmiss");
    std::vector<uint32_t> words(rtcc_result_words(stage.get()),
                                rtcc_result_words(stage.get()) + rtcc_result_word_count(stage.get()));
    // Every word in turn is replaced; a module that still frames goes to the core, which must survive it too.
    for (size_t i = 0; i < words.size(); i += 3) {
        std::vector<uint32_t> damaged = words;
        damaged[i] ^= 0x00ff0101;
        Pipeline pipeline(rtcc_pipeline_create());
        rtcc_pipeline_add_general_group(pipeline.get(), nullptr, add(pipeline, kRaygen, "a.rgen"));
        rtcc_pipeline_add_general_group(pipeline.get(), "b",
                                        rtcc_pipeline_add_spirv(pipeline.get(), RTCC_STAGE_MISS, "b", "b.spv",
                                                                damaged.data(), damaged.size(), nullptr));
        const Result result = compile(pipeline);
        ASSERT_NE(result, nullptr);
        EXPECT_EQ(rtcc_result_status(result.get()) == RTCC_STATUS_SUCCESS,
                  rtcc_result_error_count(result.get()) == 0)
            << "word " << i;
    }
}

TEST(PipelineTest, SpecialisationByBitsAndByText) {
    const auto module = [&](bool by_text) {
        Pipeline pipeline = small_pipeline();
        EXPECT_EQ(by_text ? rtcc_pipeline_specialize_text(pipeline.get(), 0, 5, "-3")
                          : rtcc_pipeline_specialize(pipeline.get(), 0, 5, 0xfffffffd),
                  RTCC_STATUS_SUCCESS);
        const Result result = compile(pipeline);
        EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS)
            << rtcc_result_messages(result.get());
        return bytes_of(result);
    };
    EXPECT_EQ(module(true), module(false));
    EXPECT_NE(module(true), bytes_of(compile(small_pipeline())));

    Pipeline unknown = small_pipeline();
    rtcc_pipeline_specialize(unknown.get(), 0, 6, 1);
    const Result result = compile(unknown);
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_LINK_ERROR);
    EXPECT_STREQ(rtcc_result_diagnostic(result.get(), 0).id, "spec-constant-unknown");
    Pipeline wrong = small_pipeline();
    rtcc_pipeline_specialize_text(wrong.get(), 0, 5, "4294967296");
    EXPECT_STREQ(rtcc_result_diagnostic(compile(wrong).get(), 0).id, "spec-constant-value");
}

TEST(PipelineTest, StopAfterGivesTheDump) {
    Options options(rtcc_options_create());
    rtcc_options_set_stop_after(options.get(), "split");
    const Result result = compile(small_pipeline(), options.get());
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS);
    EXPECT_THAT(rtcc_result_text(result.get()), HasSubstr("OpFunction"));
}

}  // namespace
