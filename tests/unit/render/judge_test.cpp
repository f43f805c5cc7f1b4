// The judge of rays that two ways of tracing answered differently, and the classes it sorts them into.
#include "judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>

#include "classify.h"
#include "mesh_tools.h"

namespace rtc::tools {
namespace {

constexpr Answer kMiss;

Scene scene_of(std::vector<Mesh> meshes) {
    Scene scene;
    scene.meshes = std::move(meshes);
    for (uint32_t i = 0; i < scene.meshes.size(); ++i) {
        Instance instance;
        instance.mesh = i;
        scene.instances.push_back(instance);
    }
    scene.finish(false);
    return scene;
}

// The square from (0, 0) to (1, 1) at height z, its diagonal from corner to corner.
Mesh square(float z) { return make_quad({0, 0, z}, {1, 0, 0}, {0, 1, 0}, 0); }

JudgedRay down(float x, float y) { return {{x, y, 1}, {0, 0, -1}, 1e30f}; }

// Which of the square's triangles lies at a point off the diagonal.
uint32_t side_of(const Judge& judge, float x, float y) { return judge.nearest(down(x, y)).primitive; }

TEST(Judge, InsideATriangleOnlyItsAnswerIsRight) {
    const Judge judge(scene_of({square(0)}));
    const uint32_t one = side_of(judge, 0.75f, 0.25f), other = side_of(judge, 0.25f, 0.75f);
    ASSERT_NE(one, other);
    EXPECT_EQ(judge.closest(down(0.75f, 0.25f), {0, one}), Ruling::Exact);
    EXPECT_EQ(judge.closest(down(0.75f, 0.25f), {0, other}), Ruling::Wrong);
    EXPECT_EQ(judge.closest(down(0.75f, 0.25f), kMiss), Ruling::Wrong);
    EXPECT_EQ(judge.closest(down(2, 2), kMiss), Ruling::Exact);
    EXPECT_EQ(judge.closest(down(2, 2), {0, one}), Ruling::Wrong);
}

TEST(Judge, OnASharedEdgeBothAreRightAndALeakIsNot) {
    const Judge judge(scene_of({square(0), square(-1)}));
    for (uint32_t primitive : {0u, 1u}) {
        EXPECT_EQ(judge.closest(down(0.5f, 0.5f), {0, primitive}), Ruling::Tie);
        EXPECT_EQ(judge.closest(down(0.5f, 0.5f), {1, primitive}), Ruling::Wrong);
    }
    EXPECT_EQ(judge.closest(down(0.5f, 0.5f), kMiss), Ruling::Wrong);
    EXPECT_EQ(judge.shadow(down(0.5f, 0.5f), true), Ruling::Wrong);
    EXPECT_EQ(judge.shadow(down(0.5f, 0.5f), false), Ruling::Tie);
}

TEST(Judge, ASilhouetteTouchedExactlyIsATie) {
    const Judge judge(scene_of({square(0)}));
    const uint32_t nearest = judge.nearest(down(1, 0.5f)).primitive;
    EXPECT_EQ(judge.closest(down(1, 0.5f), {0, nearest}), Ruling::Tie);
    EXPECT_EQ(judge.closest(down(1, 0.5f), kMiss), Ruling::Tie);
}

TEST(Judge, BesideAnEdgeWithinTheBoundIsRounding) {
    const Judge judge(scene_of({square(0)}));
    const float near = std::nextafter(1.0f, 2.0f);
    EXPECT_LT(double(near) - 1, judge.bound(down(near, 0.5f), 0));
    const uint32_t primitive = judge.nearest(down(1, 0.5f)).primitive;
    EXPECT_EQ(judge.closest(down(near, 0.5f), kMiss), Ruling::Exact);
    EXPECT_EQ(judge.closest(down(near, 0.5f), {0, primitive}), Ruling::Rounding);
    EXPECT_EQ(judge.shadow(down(near, 0.5f), false), Ruling::Rounding);
    // Ten bounds away nothing excuses it.
    const float far = 1 + float(10 * judge.bound(down(1, 0.5f), 0));
    EXPECT_EQ(judge.closest(down(far, 0.5f), {0, primitive}), Ruling::Wrong);
    EXPECT_EQ(judge.shadow(down(far, 0.5f), false), Ruling::Wrong);
    EXPECT_EQ(judge.shadow(down(far, 0.5f), true), Ruling::Exact);
}

TEST(Judge, TheDiagonalsNeighbourWithinTheBoundIsRounding) {
    const Judge judge(scene_of({square(0)}));
    const float x = std::nextafter(0.5f, 1.0f);
    const uint32_t exact = judge.nearest(down(x, 0.5f)).primitive;
    EXPECT_EQ(judge.closest(down(x, 0.5f), {0, exact}), Ruling::Exact);
    EXPECT_EQ(judge.closest(down(x, 0.5f), {0, 1 - exact}), Ruling::Rounding);
    EXPECT_EQ(judge.closest(down(x, 0.5f), kMiss), Ruling::Wrong);
}

TEST(Judge, CoplanarSurfacesTieAndNearlyCoplanarOnesRound) {
    const Judge same(scene_of({square(0), square(0)}));
    const uint32_t primitive = same.nearest(down(0.75f, 0.25f)).primitive;
    EXPECT_EQ(same.closest(down(0.75f, 0.25f), {0, primitive}), Ruling::Tie);
    EXPECT_EQ(same.closest(down(0.75f, 0.25f), {1, primitive}), Ruling::Tie);
    const Judge close(scene_of({square(0), square(-1e-8f)}));
    EXPECT_EQ(close.closest(down(0.75f, 0.25f), {0, primitive}), Ruling::Exact);
    EXPECT_EQ(close.closest(down(0.75f, 0.25f), {1, primitive}), Ruling::Rounding);
    const Judge apart(scene_of({square(0), square(-1e-3f)}));
    EXPECT_EQ(apart.closest(down(0.75f, 0.25f), {1, primitive}), Ruling::Wrong);
}

TEST(Judge, HitsCountOnlyBetweenTheEnds) {
    const Judge judge(scene_of({square(0)}));
    JudgedRay ray = down(0.75f, 0.25f);
    const uint32_t primitive = judge.nearest(ray).primitive;
    ray.end = 0.5f;
    EXPECT_EQ(judge.closest(ray, kMiss), Ruling::Exact);
    EXPECT_EQ(judge.closest(ray, {0, primitive}), Ruling::Wrong);
    ray.origin.z = -1;  // behind the ray
    ray.end = 1e30f;
    EXPECT_EQ(judge.closest(ray, kMiss), Ruling::Exact);
    EXPECT_EQ(judge.shadow(ray, true), Ruling::Exact);
}

TEST(Judge, InstancesAreJudgedInTheWorld) {
    Scene scene = scene_of({square(0)});
    glm::mat4 place = glm::translate(glm::mat4(1), {30, -20, 0});
    scene.instances[0].transform = glm::scale(glm::rotate(place, 0.7f, {0, 0, 1}), {3, 5, 2});
    const Judge judge(scene);
    const glm::vec4 inside = scene.instances[0].transform * glm::vec4(0.75f, 0.25f, 0, 1);
    const glm::vec4 outside = scene.instances[0].transform * glm::vec4(1.01f, 0.25f, 0, 1);
    const Answer answer = judge.nearest(down(inside.x, inside.y));
    EXPECT_EQ(answer.instance, 0u);
    EXPECT_EQ(judge.closest(down(inside.x, inside.y), answer), Ruling::Exact);
    EXPECT_EQ(judge.nearest(down(outside.x, outside.y)).instance, kNothing);
    // Far from the origin the rounding of the transform is larger.
    EXPECT_GT(judge.bound(down(inside.x, inside.y), 0), 10 * 16.0 / 16777216);
}

class Classes : public testing::Test {
  protected:
    static LoggedRay ray(float x, float y, uint32_t instance, uint32_t primitive = 0) {
        return {{x, y, 1}, 1, {0, 0, -1}, 1e30f, {instance, primitive, 0, 0}};
    }
    Classification run(const std::vector<LoggedRay>& native, const std::vector<LoggedRay>& ours) {
        partings.assign(1, 0);
        return classify(judge, 1.0, native, ours, uint32_t(native.size()), partings);
    }
    const Judge judge{scene_of({square(0), square(-1)})};
    const uint32_t near = side_of(judge, 0.75f, 0.25f);
    const LoggedRay none{};
    std::vector<uint8_t> partings;
};

TEST_F(Classes, EqualRecordsPartNowhere) {
    const Classification c = run({ray(0.75f, 0.25f, 0, near), none}, {ray(0.75f, 0.25f, 0, near), none});
    EXPECT_EQ(c.parted(), 0u);
    EXPECT_EQ(c.rays, 1u);
    EXPECT_EQ(c.same_hits, 1u);
    EXPECT_EQ(partings[0], 0);
}

TEST_F(Classes, TiesAndRounding) {
    EXPECT_EQ(run({ray(0.5f, 0.5f, 0, 0)}, {ray(0.5f, 0.5f, 0, 1)}).ties, 1u);
    EXPECT_EQ(partings[0], kPartedTie);
    const float x = std::nextafter(0.5f, 1.0f);
    const uint32_t exact = judge.nearest(down(x, 0.5f)).primitive;
    const Classification c = run({ray(x, 0.5f, 0, exact)}, {ray(x, 0.5f, 0, 1 - exact)});
    EXPECT_EQ(c.rounding, 1u);
    EXPECT_EQ(c.exact_is_native, 1u);
    EXPECT_EQ(c.primary_hits_differ, 1u);
    EXPECT_EQ(partings[0], kPartedRounding);
}

TEST_F(Classes, WrongAnswersAreSomebodysAndShown) {
    Classification c = run({ray(0.75f, 0.25f, 0, near)}, {ray(0.75f, 0.25f, 1, near)});
    EXPECT_EQ(c.ours_wrong, 1u);
    EXPECT_EQ(partings[0], kPartedWrong);
    ASSERT_EQ(c.examples.size(), 1u);
    EXPECT_NE(c.examples[0].find("rtc: ray from (0x1.8p-1"), std::string::npos) << c.examples[0];
    c = run({ray(0.75f, 0.25f, kNothing)}, {ray(0.75f, 0.25f, 0, near)});
    EXPECT_EQ(c.native_wrong, 1u);
    // Also where the rays differ: each side answers for its own.
    c = run({ray(0.75f, 0.25f, 0, near)}, {ray(0.8f, 0.25f, kNothing)});
    EXPECT_EQ(c.ours_wrong, 1u);
}

TEST_F(Classes, RaysThatDifferedAndDecisions) {
    LoggedRay first = ray(0.75f, 0.25f, 0, near), other = first;
    Classification c = run({first, ray(0.75f, 0.25f, 0, near)}, {other, ray(0.25f, 0.75f, 0, 1 - near)});
    EXPECT_EQ(c.other_rays, 1u);
    EXPECT_EQ(c.began_in_shading, 1u);
    EXPECT_GT(c.parted_origin, 0.5);
    other.hit[2] = 1;  // barycentrics
    c = run({first, ray(0.75f, 0.25f, 0, near)}, {other, ray(0.25f, 0.75f, 0, 1 - near)});
    EXPECT_EQ(c.began_in_barycentrics, 1u);
    EXPECT_GT(c.barycentrics_apart, 0.0);
    EXPECT_LT(c.barycentrics_apart, 1e-3);
    c = run({first, none}, {first, ray(0.75f, 0.25f, 0, near)});
    EXPECT_EQ(c.decisions, 1u);
    EXPECT_EQ(partings[0], kPartedOtherRays);
}

TEST(Differences, PixelsCountByTheWorstThatHappened) {
    const DifferingPixels pixels = sort_pixels({0, 1, 1, 1, 1, 0.5}, 1e-3,
                                               {kPartedWrong, kPartedWrong | kPartedTie, kPartedTie,
                                                kPartedRounding | kPartedOtherRays, kPartedOtherRays, 0});
    EXPECT_EQ(pixels.total(), 5u);
    EXPECT_EQ(pixels.wrong, 1u);
    EXPECT_EQ(pixels.ties, 1u);
    EXPECT_EQ(pixels.rounding, 1u);
    EXPECT_EQ(pixels.other_rays, 1u);
    EXPECT_EQ(pixels.shading, 1u);
    EXPECT_EQ(pixels.largest_shading, 0.5);
}

}  // namespace
}  // namespace rtc::tools
