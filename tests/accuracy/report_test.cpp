// The laboratory's tables and pictures, from JSON made by hand, and Embree as a subject.
#include "report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cases.h"
#include "embree_tracer.h"
#include "image_file.h"
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
    EXPECT_EQ(dominated(example().subjects), std::vector<std::string>{"native"});
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

Json agreement(uint64_t other, double t_p999, double t_p50 = 0.4) {
    Json rows;
    for (const char* axis : {"offset", "all"})
        rows.push_back({{"axis", axis}, {"rays", 5000}, {"hits", 4000}, {"missed", 0}, {"invented", 0}, {"other", other},
                        {"of_these_denormal", 0}, {"by_rule", 0}, {"missed_plainly", 0}, {"invented_plainly", 0}, {"later", 0},
                        {"t_ulp_p50", t_p50}, {"t_ulp_p99", 1.0}, {"t_ulp_p99_9", t_p999}, {"t_ulp_max", 9.0}});
    return rows;
}

Json run(const char* device, std::vector<Json> tiers) { return {{"device", device}, {"by_cpu", true}, {"tiers", tiers}}; }

Json full(const char* name, uint64_t edge_events, uint64_t other = 0, double ratio = 1) {
    Json tier = subject(name, 1e-3, ratio, edge_events);
    for (Json& row : tier["leaks"]) row.update(Json{{"axis", "mesh"}, {"value", "closed"}, {"mesh", "knot"}});
    tier["leaks"][3]["value"] = "far";
    tier["agreement"] = agreement(other, 0.5);
    return tier;
}

TEST(Chance, IsBinomial) {
    EXPECT_DOUBLE_EQ(chance({0, 100}, {0, 100}), 1);
    EXPECT_NEAR(chance({0, 1000}, {5, 1000}), 2 * std::pow(0.5, 5), 1e-12);
    EXPECT_NEAR(chance({0, 3000}, {2, 1000}), 1.0 / 16, 1e-12);  // both in the one quarter of the rays
    EXPECT_GT(chance({4000, 10000}, {40500, 100000}), 0.01);
    EXPECT_LT(chance({4000, 10000}, {50000, 100000}), 1e-9);
}

TEST(Check, ARunAgreesWithItselfAndWithinNoise) {
    const Json then = run("llvmpipe (LLVM 15, 256 bits) x", {full("fast", 300, 50), full("watertight", 0, 20, 1.1)});
    EXPECT_TRUE(compare_runs({then}, {then}).disagreements.empty());
    EXPECT_GT(compare_runs({then}, {then}).compared, 20u);
    // Another processor, other counts, other noise.
    const Json now = run("llvmpipe (LLVM 15, 512 bits) x", {full("fast", 330, 60), full("watertight", 0, 12, 1.19)});
    const Verdict verdict = compare_runs({now}, {then});
    EXPECT_TRUE(verdict.disagreements.empty()) << verdict.disagreements.front();
    EXPECT_TRUE(verdict.notes.empty());
}

TEST(Check, NamesWhatDisagrees) {
    const Json then = run("a", {full("fast", 300, 50), full("watertight", 0, 20, 1.1), full("exact", 0)});
    auto only = [&](const Json& now) {
        const Verdict verdict = compare_runs({now}, {then});
        EXPECT_EQ(verdict.disagreements.size(), 1u);
        return verdict.disagreements.empty() ? std::string() : verdict.disagreements[0];
    };
    EXPECT_NE(only(run("a", {full("fast", 500, 50)})).find("leaks mesh closed knot edge unbalanced: 500 of 3000, before 300 of 3000"),
              std::string::npos);
    EXPECT_NE(only(run("a", {full("watertight", 1, 20, 1.1)})).find("1 leaks or double hits where none are promised"),
              std::string::npos);
    EXPECT_NE(only(run("a", {full("exact", 0, 1)})).find("1 first hits other"), std::string::npos);
    Json slow = full("watertight", 0, 20, 1.1);
    slow["cost"][1]["against_first"] = 1.3;
    EXPECT_NE(only(run("a", {slow})).find("random, time over the first's: 1.3, before 1.1"), std::string::npos);
    Json blind = full("contracted", 0);
    blind["leaks"][3]["unbalanced"] = 0;
    EXPECT_NE(only(run("a", {blind})).find("does not leak"), std::string::npos);
}

TEST(Check, PromisesHoldWhereNothingIsCheckedIn) {
    const Json then = run("a", {full("fast", 300, 50)});
    const Verdict fine = compare_runs({run("b", {full("watertight", 0)})}, {then});
    EXPECT_TRUE(fine.disagreements.empty());
    EXPECT_EQ(fine.notes.size(), 1u);
    EXPECT_EQ(compare_runs({run("b", {full("watertight", 3)})}, {then}).disagreements.size(), 1u);
    EXPECT_EQ(compare_runs({}, {then}).disagreements.size(), 1u) << "nothing compared";
}

TEST(Report, LeaksAndDoubleHitsAreToldApart) {
    Json tier = full("fast", 300);
    tier["leaks"][1].update(Json{{"looked_at", 48}, {"of_these_leaks", 36}, {"of_these_doubles", 10}, {"seconds", 0.003}});
    const DeviceReport report = summarise({run("a", {tier})}).at(0);
    EXPECT_DOUBLE_EQ(report.subjects[0].leaks, 300.0 * 36 / 48 / 6000);
    EXPECT_DOUBLE_EQ(report.subjects[0].doubles, 300.0 * 10 / 48 / 6000);
    EXPECT_DOUBLE_EQ(report.subjects[0].aimed_speed, 1);
    EXPECT_NE(markdown_table(report, "").find("| 3.8e+07 | 1e+07 |"), std::string::npos);
    EXPECT_NE(markdown_table(report, "").find("| mesh | 0.033 |"), std::string::npos) << "by axis";
}

TEST(Report, KnobsHaveATableOfTheirOwn) {
    Json small = full("box16", 0, 20, 1.1), slow = full("t64", 0, 20, 1.3);
    for (Json& row : small["cost"]) row["scene_bytes"] = 50000;
    for (Json& row : slow["cost"]) row["seconds"] = 2e-3;
    const DeviceReport report = summarise({run("a", {full("fast", 300, 50), full("watertight", 0, 20, 1.1), small, slow})}).at(0);
    EXPECT_EQ(report.subjects.size(), 2u);
    ASSERT_EQ(report.knobs.size(), 3u);
    EXPECT_EQ(report.knobs[0].name, "watertight");
    EXPECT_EQ(dominated(report.knobs, true), (std::vector<std::string>{"watertight", "t64"})) << "box16 is smaller";
    EXPECT_EQ(dominated(report.knobs, false), (std::vector<std::string>{"t64"}));
    const std::string table = knob_table(report);
    EXPECT_NE(table.find("| `t64` | 1.18 |"), std::string::npos) << table;
    EXPECT_EQ(markdown_table(report, "").find("box16"), std::string::npos);
    EXPECT_EQ(knob_table(example()), "");
}

TEST(Report, NoiseDominatesNobody) {
    // Slower by 1 %, fewer events by chance.
    Json a = full("fast", 300), b = full("watertight", 310);
    for (Json& row : b["cost"]) row["seconds"] = 0.99e-3;
    EXPECT_TRUE(dominated(summarise({run("a", {a, b})}).at(0).subjects).empty());
    // Nor does one of which only the cost is known.
    Json cheap{{"tier", "native"}, {"cost", cost(1e-4, 0.1)}};
    EXPECT_TRUE(dominated(summarise({run("a", {a, cheap})}).at(0).subjects).empty());
}

TEST(Report, PictureAsPng) {
    const std::string path = testing::TempDir() + "rtc_plot.png";
    write_plot_png(example(), path);
    const tools::Picture picture = tools::read_picture(path, false);
    const std::string svg = plot_svg(example());
    EXPECT_EQ(picture.width, 2 * uint32_t(std::atof(svg.c_str() + svg.find("width=\"") + 7)));
    // The colours of three subjects and of the letters are there.
    auto pixels_of = [&](int r, int g, int b) {
        size_t count = 0;
        for (uint32_t y = 0; y < picture.height; ++y)
            for (uint32_t x = 0; x < picture.width; ++x) {
                const float* p = picture.at(x, y);
                count += std::fabs(p[0] * 255 - r) + std::fabs(p[1] * 255 - g) + std::fabs(p[2] * 255 - b) < 60;  // edges are blended
            }
        return count;
    };
    EXPECT_GT(pixels_of(0xd9, 0x5f, 0x02), 40u) << "fast";
    EXPECT_GT(pixels_of(0xe7, 0x29, 0x8a), 40u) << "native";
    EXPECT_GT(pixels_of(0x1b, 0x9e, 0x77), 10u) << "watertight, hollow";
    EXPECT_GT(pixels_of(0x22, 0x22, 0x22), 1000u) << "letters";
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
