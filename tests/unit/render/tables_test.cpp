// The tables the shaders read.
#include <gtest/gtest.h>

#include <map>

#include "mesh_tools.h"
#include "scene_tables.h"

namespace rtc::tools {
namespace {

TEST(SceneTables, LayoutIsThatOfTheShaders) {
    EXPECT_EQ(sizeof(InstanceEntry), 112u);
    EXPECT_EQ(sizeof(VertexEntry), 32u);
    EXPECT_EQ(sizeof(MaterialEntry), 48u);
    EXPECT_EQ(sizeof(FrameBlock), 128u);
}

TEST(SceneTables, AliasTableGivesEachEmitterItsShareOfThePower) {
    Scene scene;
    for (int i = 0; i < 5; ++i) {
        Material material;
        material.emission = glm::vec3(float(i));
        scene.materials.push_back(material);
        scene.meshes.push_back(
            make_quad({float(3 * i), 0, 0}, {1.0f + float(i), 0, 0}, {0, 1, 0}, uint32_t(i)));
        Instance instance;
        instance.mesh = uint32_t(i);
        scene.instances.push_back(instance);
    }
    scene.finish(true);
    const SceneTables tables = make_tables(scene, 1.0f);
    const uint32_t count = tables.frame.emitter_count;
    ASSERT_EQ(count, 8u);  // material 0 does not shine
    EXPECT_EQ(tables.frame.emitter_chance, 1.0f);
    std::map<uint32_t, double> chance;
    for (uint32_t i = 0; i < count; ++i) {
        const double threshold = double(tables.lights[4 * i].w);
        chance[i] += threshold / count;
        chance[uint32_t(tables.lights[4 * i + 1].w)] += (1 - threshold) / count;
    }
    double sum = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const double area = 0.5 * double(glm::length(glm::cross(glm::vec3(tables.lights[4 * i + 1]),
                                                                glm::vec3(tables.lights[4 * i + 2]))));
        const double expected =
            double(tables.lights[4 * i + 2].w) * area * double(tables.frame.emitter_pdf_scale);
        EXPECT_NEAR(chance[i], expected, 1e-6);
        sum += expected;
    }
    EXPECT_NEAR(sum, 1.0, 1e-6);
}

TEST(SceneTables, NormalsOfStretchedInstancesStayPerpendicular) {
    Scene scene;
    scene.meshes.push_back(make_icosphere(1.0f, 1, 0));
    Instance instance;
    instance.transform = glm::mat4(glm::mat3(2, 0.5f, 0, 0, 0.25f, 0, 1, 0, 3));
    scene.instances.push_back(instance);
    scene.finish(true);
    const SceneTables tables = make_tables(scene, 1.0f);
    const InstanceEntry& entry = tables.instances[0];
    const glm::vec3 n = glm::normalize(glm::vec3(1, 2, 3));
    const glm::vec3 tangent = glm::cross(n, glm::vec3(0, 0, 1));
    glm::vec3 world_n, world_t;
    for (int row = 0; row < 3; ++row) {
        world_n[row] = glm::dot(glm::vec3(entry.to_normal[row]), n);
        world_t[row] = glm::dot(glm::vec3(entry.to_world[row]), tangent);
    }
    EXPECT_NEAR(glm::dot(glm::normalize(world_n), glm::normalize(world_t)), 0.0f, 1e-5f);
}

}  // namespace
}  // namespace rtc::tools
