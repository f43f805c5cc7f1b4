#include "frontend/scan.h"

#include <gtest/gtest.h>

namespace {

TEST(Scan, FindsTheDialect) {
    EXPECT_TRUE(rtc::scan_source("#version 460\n#extension GL_NV_ray_tracing : require\n").names_nv);
    EXPECT_TRUE(rtc::scan_source("  #  extension   GL_EXT_ray_tracing:enable").names_ext);
    EXPECT_TRUE(rtc::scan_source("#extension GL_EXT_ray_cull_mask : require").names_ext);
    EXPECT_FALSE(rtc::scan_source("#extension GL_NV_ray_tracing : require").names_ext);
}

TEST(Scan, IgnoresComments) {
    EXPECT_FALSE(rtc::scan_source("// #extension GL_EXT_ray_tracing : require\n").names_ext);
    EXPECT_FALSE(rtc::scan_source("/*\n#extension GL_EXT_ray_tracing : require\n*/").names_ext);
    EXPECT_FALSE(rtc::scan_source("// joined \\\n#extension GL_EXT_ray_tracing : require\n").names_ext);
    EXPECT_TRUE(rtc::scan_source("/* a */ #extension GL_EXT_ray_tracing : require").names_ext);
    EXPECT_TRUE(rtc::scan_source("#line 3 \"/*\"\n#extension GL_EXT_ray_tracing : require").names_ext);
}

TEST(Scan, FindsTheVersion) {
    const rtc::SourceFacts facts = rtc::scan_source("// head\n\n#version 460 core\n");
    EXPECT_EQ(facts.version, 460);
    EXPECT_EQ(facts.profile, "core");
    EXPECT_EQ(facts.version_line, 3u);
    EXPECT_EQ(rtc::scan_source("void main() {}").version, 0);
    EXPECT_EQ(rtc::scan_source("#version abc").version, 0);
}

TEST(Scan, FindsStagePragmas) {
    const rtc::SourceFacts facts = rtc::scan_source(
        "#version 460\n#pragma shader_stage(miss)\n#pragma shader_stage ( raygen )\n#pragma once\n");
    ASSERT_EQ(facts.stage_pragmas.size(), 2u);
    EXPECT_EQ(facts.stage_pragmas[0].name, "miss");
    EXPECT_EQ(facts.stage_pragmas[0].line, 2u);
    EXPECT_EQ(facts.stage_pragmas[1].name, "raygen");
    EXPECT_TRUE(rtc::scan_source("#pragma shader_stage miss").stage_pragmas.empty());
}

TEST(Scan, StripsCommentsAndKeepsLines) {
    EXPECT_EQ(rtc::strip_comments("a/*b\nc*/d//e\nf"), "a \nd\nf");
    EXPECT_EQ(rtc::strip_comments("a / b"), "a / b");
    EXPECT_EQ(rtc::strip_comments("/*never closed"), " ");
    EXPECT_EQ(rtc::strip_comments("\"//\" x"), "\"//\" x");
    EXPECT_EQ(rtc::strip_comments(""), "");
}

}  // namespace
