// Leak campaigns: closed meshes, rays that host and device make alike, and a measurement that can fail.
#include <map>
#include <set>

#include "campaign.h"
#include "error.h"
#include "lab_fixture.h"

namespace rtc::lab {
namespace {

// Of every mesh: at the origin as it is, and far away in the vertices, rotated.
const std::vector<CampaignPoint>& some_points() {
    static const std::vector<CampaignPoint> points = [] {
        std::vector<CampaignPoint> chosen;
        for (const CampaignPoint& point : campaign_points(false)) {
            const bool near = point.offset == 0 && point.transform == "identity";
            const bool far = point.offset == 100 && point.transform == "rotated" && point.place == "vertices";
            if (near || far) chosen.push_back(point);
        }
        return chosen;
    }();
    return points;
}

CampaignReport campaign(const std::string& subject, uint64_t rays, CampaignSettings settings = {}) {
    const auto context = campaign_context(subject, "", true);
    const auto tracer = make_campaign_tracer(*context, subject, settings.program, some_points(), 4096);
    settings.rays = rays;
    settings.quiet = true;
    CampaignReport report = run_campaign(*tracer, some_points(), false, settings);
    EXPECT_TRUE(context->validation_messages().empty()) << context->validation_messages().front();
    return report;
}

TEST(Campaign, ShapesAreClosedManifolds) {
    std::set<const IndexedMesh*> seen;
    for (const CampaignPoint& point : campaign_points(false)) {
        if (point.offset != 0 || !seen.insert(point.shape.get()).second) continue;
        std::map<std::pair<uint32_t, uint32_t>, int> edges;
        for (const auto& t : point.shape->triangles)
            for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
        for (const auto& [edge, count] : edges) {
            EXPECT_EQ(count, 1) << point.mesh;
            EXPECT_EQ(edges.count({edge.second, edge.first}), 1u) << point.mesh;
        }
        const long euler = long(point.shape->vertices.size()) - long(edges.size() / 2) +
                           long(point.shape->triangles.size());
        EXPECT_EQ(euler, point.mesh == "mug" || point.mesh == "torus-knot" ? 0 : 2) << point.mesh;
    }
    EXPECT_EQ(seen.size(), 4u);
}

TEST(Campaign, CoversWhatIsPromised) {
    std::map<std::string, int> meshes, transforms;
    std::set<double> offsets;
    for (const CampaignPoint& point : campaign_points(false)) {
        ++meshes[point.mesh];
        ++transforms[point.transform];
        offsets.insert(point.offset);
        EXPECT_TRUE(point.promised);
    }
    EXPECT_EQ(meshes.size(), 4u);
    EXPECT_EQ(transforms.size(), 4u);
    for (const auto& [name, count] : transforms) EXPECT_EQ(count, transforms["identity"]) << name;
    EXPECT_EQ(offsets, (std::set<double>{0, 10, 100, 1000, 10000}));
    for (const CampaignPoint& point : campaign_points(true)) EXPECT_FALSE(point.promised);
}

// The judge itself must find every ray balanced: whether it is aimed at edges, at vertices, or along axes.
TEST(Campaign, ExactArithmeticBalancesEveryRay) {
    for (const CampaignPoint& point : some_points()) {
        const auto triangles = point.shape->soup();
        const Transform inverse = invert(point.object_to_world);
        uint32_t touched = 0;
        for (const uint32_t aim : {kModeEdge, kModeVertex}) {
            CampaignPush push{};
            for (int i = 0; i < 12; ++i) push.object_to_world[i] = point.object_to_world[i / 4][i % 4];
            std::copy_n(point.ball, 4, push.ball);
            push.mode = aim | kModeAxes;
            push.triangles = uint32_t(triangles.size());
            for (uint64_t number = 0; number < 30; ++number) {
                const CampaignRay ray = campaign_ray(push, triangles, number);
                const ExactBalance balance = exact_balance(transform_point(inverse, ray.origin),
                                                           transform_vector(inverse, ray.direction), triangles);
                EXPECT_EQ(balance.front, balance.back) << point.mesh << " " << point.transform << " " << number;
                touched += balance.touched;
            }
        }
        if (point.offset == 0) {
            EXPECT_GT(touched, 0u) << point.mesh << ": no ray met a vertex exactly";
        }
    }
}

TEST(Campaign, WatertightIsBalanced) {
    const CampaignReport report = campaign("watertight", 40000);
    EXPECT_EQ(report.events(true), 0u);
    EXPECT_GE(report.rays(true), 80000u);
    EXPECT_EQ(report.rows.size(), some_points().size() * 2);
}

TEST(Campaign, FastLeaksAndHostMakesTheSameRays) {
    const CampaignReport report = campaign("fast", 8000);
    EXPECT_GT(report.events(true), 100u);
    EXPECT_GT(report.offenders.size(), 20u);
    bool inside = false;
    for (const CampaignOffender& o : report.offenders) {
        EXPECT_TRUE(o.same_ray) << o.number;
        const uint32_t due = o.exact.back - o.exact.front;
        EXPECT_TRUE(due == 0 || due == 1) << o.number;
        if (o.closest) {
            EXPECT_EQ(o.front + o.back, 0u) << o.number;
        } else {
            EXPECT_NE(o.back - o.front, due) << o.number << ": balanced, but counted as unbalanced";
        }
        inside = inside || due == 1;
    }
    EXPECT_TRUE(inside) << "no ray started inside";
}

TEST(Campaign, NegativeControlLeaks) {
    std::unique_ptr<tools::Context> context;
    try {
        context = campaign_context("contracted", "", false);
    } catch (const tools::MissingFeature& problem) {
        GTEST_SKIP() << problem.what();
    }
    context.reset();
    EXPECT_GT(campaign("contracted", 30000).events(true), 0u);
}

TEST(Campaign, SameSeedSameRays) {
    const CampaignReport a = campaign("fast", 1000), b = campaign("fast", 1000);
    ASSERT_EQ(a.rows.size(), b.rows.size());
    for (size_t i = 0; i < a.rows.size(); ++i) {
        EXPECT_EQ(a.rows[i].events, b.rows[i].events);
        EXPECT_EQ(a.rows[i].missed, b.rows[i].missed);
    }
}

TEST(Campaign, SpawnedRaysDoNotHitTheirTriangle) {
    CampaignSettings settings;
    settings.program = CampaignProgram::Spawn;
    const CampaignReport report = campaign("watertight", 20000, settings);
    EXPECT_EQ(report.events(true), 0u);
    uint64_t missed = 0;
    for (const CampaignRow& row : report.rows) missed += row.missed;
    EXPECT_LT(missed, report.rays(true) / 2) << "few rays hit anything to leave";
    settings.naive = true;
    EXPECT_GT(campaign("watertight", 2000, settings).events(true), 100u) << "the control must hit itself";
}

// Thin triangles leave sideways, others along the normal: both, and what lies between.
TEST(Campaign, SpawnedRaysDoNotHitSliversOfAnyThinness) {
    std::vector<CampaignPoint> points;
    for (const CampaignPoint& point : spawn_points())
        if (point.mesh.rfind("slivers", 0) == 0 && point.offset == 0 && point.transform == "identity") points.push_back(point);
    ASSERT_GE(points.size(), 5u);
    const auto context = campaign_context("watertight", "", true);
    const auto tracer = make_campaign_tracer(*context, "watertight", CampaignProgram::Spawn, points, 4096);
    CampaignSettings settings;
    settings.program = CampaignProgram::Spawn;
    settings.rays = 40000;
    settings.quiet = true;
    const CampaignReport report = run_campaign(*tracer, points, false, settings);
    for (const CampaignRow& row : report.rows) {
        EXPECT_EQ(row.events, 0u) << row.mesh << ' ' << row.aim;
        EXPECT_LT(row.missed, row.rays * 3 / 4) << row.mesh << ' ' << row.aim;
    }
}

TEST(Campaign, UnknownTierIsNamed) {
    try {
        campaign_context("waterproof", "", false);
        FAIL() << "no error";
    } catch (const tools::Error& problem) {
        EXPECT_NE(std::string(problem.what()).find("waterproof"), std::string::npos);
    }
}

}  // namespace
}  // namespace rtc::lab
