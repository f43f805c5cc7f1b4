// rtc-bench: variants from their text, ratios and means, the scenes it makes.
#include <gtest/gtest.h>

#include "bench_scenes.h"
#include "error.h"
#include "trace_report.h"
#include "trace_variant.h"

namespace rtc::bench {
namespace {

std::string error_of(const std::string& variant) {
    try {
        parse_variant(variant);
    } catch (const tools::Error& error) {
        return error.what();
    }
    return "";
}

TEST(TraceVariantText, SetsWhatItNamesAndLeavesTheRestToTheDevice) {
    const TraceVariant variant = parse_variant("fetch=storage,loop=while,stack=16,build=fast,resumable=0");
    EXPECT_EQ(variant.options.fetch, RTR_FETCH_STORAGE);
    EXPECT_EQ(variant.options.whileWhile, 1u);
    EXPECT_EQ(variant.options.sharedStack, 16u);
    EXPECT_EQ(variant.options.workgroupSize, RTR_DEFAULT);
    EXPECT_TRUE(variant.fast_build);
    EXPECT_EQ(variant.resumable, 0);
    EXPECT_EQ(variant.addressing, tools::Addressing::Recommended);
    EXPECT_EQ(parse_variant("addressing=address").addressing, tools::Addressing::Address);
    EXPECT_EQ(parse_variant("addressing=heap").addressing, tools::Addressing::Heap);
    EXPECT_EQ(parse_variant("").name, "rtc");
    EXPECT_EQ(parse_variant("name=a b,loop=if").name, "a b");
}

TEST(TraceVariantText, ErrorsNameTheKeyAndWhatToWrite) {
    EXPECT_NE(error_of("fetsch=texel").find("fetch"), std::string::npos);
    EXPECT_NE(error_of("fetch=fast").find("storage"), std::string::npos);
    EXPECT_NE(error_of("addressing=page").find("address"), std::string::npos);
    EXPECT_NE(error_of("stack=-1x").find("stack"), std::string::npos);
    EXPECT_NE(error_of("loop"), "");
}

TraceRow row(const char* scene, const char* runner, bool native, std::vector<double> times, bool reduced = false) {
    TraceRow made;
    made.scene = scene;
    made.workload = "primary";
    made.runner = runner;
    made.native = native;
    made.rays = 1e6;
    made.times = std::move(times);
    made.reduced = reduced;
    return made;
}

TEST(TraceReports, MeansAreGeometricOverMediansAndLeaveReducedOnesOut) {
    TraceReport report;
    report.rows = {row("a", "native", true, {4, 4, 100}), row("a", "rtc", false, {2, 1, 2}),
                   row("b", "native", true, {1}),         row("b", "rtc", false, {2}),
                   row("c", "native", true, {1}, true),   row("c", "rtc", false, {100}),
                   row("d", "native", true, {1}),         row("d", "rtc", false, {})};
    const nlohmann::ordered_json json = as_json(report);
    ASSERT_EQ(json["means"].size(), 1u);
    EXPECT_NEAR(json["means"][0]["geometric_mean"].get<double>(), 1.0, 1e-12);  // 2 and 1/2
    EXPECT_NEAR(json["means"][0]["lowest"].get<double>(), 0.5, 1e-12);
    EXPECT_EQ(json["means"][0]["measurements"], 2);
    EXPECT_NE(scene_table(report, "c").find("(0.01)"), std::string::npos);
}

TEST(BenchScenes, HaveAboutTheTrianglesAskedForAndAreDeterministic) {
    for (const auto make : {make_blob, make_soup, make_strands}) {
        const tools::Mesh mesh = make(20000);
        EXPECT_NEAR(double(mesh.triangle_count()), 20000, 400);
        EXPECT_EQ(mesh.positions, make(20000).positions);
    }
    for (const std::string& name : bench_scene_names()) EXPECT_GT(bench_scene(name, 0.01).triangle_count(), 0u);
    EXPECT_THROW(bench_scene("nowhere"), tools::Error);
}

}  // namespace
}  // namespace rtc::bench
