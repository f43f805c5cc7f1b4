// The laboratory's tables and pictures, from JSON made by hand, and Embree as a subject.
#include "report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cases.h"
#include "embree_tracer.h"
#include "leaks.h"
#include "meshes.h"

namespace rtc::lab {
namespace {

using Json = nlohmann::ordered_json;

Json cost(double seconds, double against_first) {
    Json rows;
    for (const char* workload : {"primary", "random"})
        rows.push_back({{"workload", workload},
                        {"triangles", 1000},
                        {"rays", 1000000},
                        {"seconds", seconds},
                        {"cpu_time", true},
                        {"against_first", against_first},
                        {"turns_per_ray", 20.0},
                        {"scene_bytes", 64000}});
    return rows;
}

Json leaks(uint64_t edge_events, uint64_t beyond_events) {
    Json rows;
    auto add = [&](const char* aim, uint64_t events, bool promised) {
        rows.push_back({{"aim", aim}, {"rays", 3000}, {"unbalanced", events}, {"promised_zero", promised}});
    };
    add("interior", 0, true);
    add("edge", edge_events, true);
    add("vertex", 0, true);
    add("edge", beyond_events, false);
    return rows;
}

Json subject(const char* name, double seconds, double against_first, uint64_t edge_events) {
    return {{"tier", name}, {"cost", cost(seconds, against_first)}, {"leaks", leaks(edge_events, 7)}};
}

const DeviceReport& example() {
    static const DeviceReport report =
        summarise({{{"device", "a CPU"},
                    {"by_cpu", true},
                    {"tiers", {subject("fast", 1, 1, 300), subject("watertight", 1.1, 1.1, 0), subject("native", 2, 2, 30)}}}})
            .at(0);
    return report;
}

TEST(Report, SumsWhatIsPromisedApartFromWhatIsNot) {
    const Summary& fast = example().subjects.at(0);
    EXPECT_EQ(fast.edges.events, 300u);
    EXPECT_EQ(fast.edges.rays, 3000u);
    EXPECT_EQ(fast.beyond.events, 7u);
    EXPECT_EQ(fast.aimed().rays, 6000u);
    EXPECT_DOUBLE_EQ(fast.primary, 1.0);
    EXPECT_DOUBLE_EQ(fast.bytes, 64.0);
    EXPECT_FALSE(example().subjects.at(2).tier);
}

TEST(Report, ZeroComesWithItsBound) {
    EXPECT_DOUBLE_EQ(example().subjects.at(1).aimed().bound(), 3.0 / 6000);
    EXPECT_NE(markdown_table(example(), "").find("0 (< 1.0e-03)"), std::string::npos);  // 3 / 3000
}

TEST(Report, NamesWhoIsDominated) {
    // native is slower than watertight and leaks more; fast is cheapest, watertight is best.
    EXPECT_EQ(dominated(example()), std::vector<std::string>{"native"});
}

TEST(Report, LaterRunsOfADeviceReplaceEarlierOnes) {
    const Json first{{"device", "a"}, {"tiers", {subject("fast", 1, 1, 1), subject("exact", 2, 2, 0)}}};
    const Json other{{"device", "b"}, {"tiers", {subject("fast", 1, 1, 1)}}};
    const Json again{{"device", "a"}, {"tiers", {Json{{"tier", "exact"}, {"cost", cost(3, 3)}}, subject("native", 1, 1, 0)}}};
    const auto reports = summarise({first, other, again});
    ASSERT_EQ(reports.size(), 2u);
    ASSERT_EQ(reports[0].subjects.size(), 3u);
    EXPECT_DOUBLE_EQ(reports[0].subjects[1].against_first, 3);
    EXPECT_TRUE(reports[0].subjects[1].edges.measured()) << "what was not measured again stays";
    EXPECT_EQ(reports[0].subjects[2].name, "native");
    EXPECT_THROW(summarise({Json::array()}), std::runtime_error);
    EXPECT_THROW(summarise({{{"device", "a"}}}), std::runtime_error);
}

TEST(Report, PictureHasEverySubjectAndMarksBounds) {
    const std::string svg = plot_svg(example());
    EXPECT_EQ(svg.rfind("<svg", 0), 0u);
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
    for (const char* name : {">fast<", ">watertight<", ">native<"}) EXPECT_NE(svg.find(name), std::string::npos) << name;
    EXPECT_NE(svg.find("fill=\"#ffffff\"/>\n<path"), std::string::npos) << "watertight's zero has no arrow";
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
    const DeviceReport nothing{"<none>", true, {}};
    EXPECT_NE(plot_svg(nothing).find("&lt;none&gt;"), std::string::npos);
}

TEST(Embree, SeesWhatRtcSees) {
    if (!have_embree()) GTEST_SKIP() << "built without Embree";
    const IndexedMesh sphere = make_icosphere(3);
    const auto tracer = make_embree_tracer(EmbreeMode::Robust, 1);
    for (const char* transform : {"identity", "rotated", "mirrored"}) {
        LeakCase c;
        c.mesh = &sphere;
        c.aim = Aim::Interior;
        for (const auto& [name, matrix] : lab_transforms())
            if (name == transform) c.instance.object_to_world = matrix;
        tracer->set_scene(leak_scene(c));
        for (const bool inside : {false, true}) {
            c.from_inside = inside;
            const LeakCounts counts = count_leaks(*tracer, c, 2000);
            EXPECT_EQ(counts.unbalanced, 0u) << transform << inside;
            EXPECT_LT(counts.missed, 20u) << transform << inside;
        }
    }
    EXPECT_GT(tracer->scene_bytes(), sphere.triangles.size() * 20);
}

TEST(Embree, RaysThatItCannotTakeMiss) {
    if (!have_embree()) GTEST_SKIP() << "built without Embree";
    const IndexedMesh sphere = make_icosphere(1);
    const auto tracer = make_embree_tracer(EmbreeMode::Fast, 1);
    Instance instance;
    instance.object_to_world = {{{1e-30f, 0, 0, 0}, {0, 1e-30f, 0, 0}, {0, 0, 1e-30f, 0}}};
    for (const bool scaled : {false, true}) {
        tracer->set_scene(build_scene({Blas{{{sphere.soup(), {}, true}}}}, {scaled ? instance : Instance{}}));
        for (const float x : {1e30f, std::numeric_limits<float>::infinity(), std::nanf("")}) {
            Ray ray;
            ray.origin = {0, 0, 3};
            ray.direction = {x, 0, -1};
            ray.tmax = 10;
            EXPECT_EQ(tracer->trace({ray}).at(0).instance, kNoInstance);
        }
    }
}

}  // namespace
}  // namespace rtc::lab
